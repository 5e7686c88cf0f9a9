"""The estimation problem: the parameter vector, the free run and its sensitivities, the contract of an estimator."""
