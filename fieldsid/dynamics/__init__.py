"""From parameters to a simulated motion: the compiled kernels and what they are fed."""
