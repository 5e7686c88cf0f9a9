"""Time simulations of the closed loop: the compiled kernels, steps of every draw with the loss of speed, a straight leg."""
