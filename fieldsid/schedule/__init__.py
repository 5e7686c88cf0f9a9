"""Gain schedules over speed: design, verification, simulation. Copies of the node of `templates/ros2` import `load_schedule`."""

from fieldsid.schedule.record import load_schedule

__all__ = ["load_schedule"]
