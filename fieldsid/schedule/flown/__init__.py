"""A loop flown in time: the compiled closed loop, steps of every draw, the speed a vehicle keeps, a straight leg."""
