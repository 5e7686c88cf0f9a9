"""From parameters to a simulated motion: the compiled kernels and their inputs."""
