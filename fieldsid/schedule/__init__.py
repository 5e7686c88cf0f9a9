"""Gains per speed: designed, verified, flown. A copy of the node of `templates/ros2` takes `load_schedule` from here."""

from fieldsid.schedule.record import load_schedule

__all__ = ["load_schedule"]
