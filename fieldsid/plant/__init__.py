"""The vehicle as turns and gain schedules need it: parameters at a speed, and the yaw plant."""
