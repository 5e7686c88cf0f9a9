"""The plant for turns and gain schedules: parameters at a speed, and the yaw plant."""
