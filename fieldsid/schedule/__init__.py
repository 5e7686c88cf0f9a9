"""Gains per speed: `design_schedule` and `verify_schedule` are `sysid schedule design` and `verify`."""

from fieldsid.schedule.linear_plant import FinLimits
from fieldsid.schedule.make import design_schedule
from fieldsid.schedule.record import Schedule, load_schedule, save_schedule
from fieldsid.schedule.verify import Verification, verify_schedule
from fieldsid.schedule.wish import Wish

__all__ = [
    "FinLimits",
    "Schedule",
    "Verification",
    "Wish",
    "design_schedule",
    "load_schedule",
    "save_schedule",
    "verify_schedule",
]
