"""The tour: a trial that the package makes itself, with an effect hidden in it, and what each command says about it."""
