"""What is estimated: the parameter vector, the free run and its sensitivities, the estimator's contract."""
