"""Convert fins and motors logged in counts of a servo: a byte about 128, or the microseconds of a pulse about 1500.

A fin's angle is (count - centre) x scale. The scale is that of the servo: its range in rad over its range in counts. Where the
scale is not stated, the full travel is assumed to be `FULL_RAD`. The authority identified with such a fin (b2, d2) is then one
per count; heading, rates, time constants and the results that follow from them do not depend on the scale.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from fieldsid.logs.convert.units import unit_among
from fieldsid.logs.run import FINS, MOTORS, Note, signal_of
from fieldsid.numerics.arrays import FloatArray

COUNTS = "counts"
COUNTED = (*FINS, "thrust", "thrust_ratio")
SUMMED = (*FINS, *MOTORS)
"""Signals that may be the sum of several fins or motors."""
FULL_RAD = math.radians(30.0)
"""Assumed deflection at full travel of a servo whose range is not stated."""


@dataclass(frozen=True, slots=True)
class Servo:
    """A kind of counts: its name, the count at zero, the counts to full travel, and the least and largest possible count."""

    says: str
    centre: float
    travel: float
    least: float
    largest: float


SERVOS = (Servo("a byte", 128.0, 127.0, 0.0, 255.0), Servo("pulses in us", 1500.0, 400.0, 800.0, 2200.0))
BY_UNIT: Mapping[str, Servo] = MappingProxyType({
    "us": SERVOS[1],
    "%": Servo("percent of its range", 0.0, 100.0, -100.0, 100.0),
    "1": Servo("shares of its range", 0.0, 1.0, -1.0, 1.0),
})  # fmt: skip
"""Kinds of counts by the unit that a fin's mapping states: a pulse's length, or a share of the range."""


def counts_unit(signal: str, unit: str | None) -> str | None:
    """Return the unit of counts that is stated for a signal: `counts`, or for a fin also `us`, `1` and `%`; None for others."""
    signal = signal_of(signal)
    if unit is None or signal not in COUNTED or unit == COUNTS:
        return unit if signal in COUNTED else None
    found = unit_among(unit, ("time", "ratio")) if signal in FINS else None
    return found.name if found is not None and found.name in BY_UNIT else None


def servo_of(values: FloatArray) -> Servo | None:
    """Return the kind of counts that numbers (n,) are, by their size; None where they are none.

    Counts are whole numbers that are not negative, and their mean is near the centre of their kind.
    """
    seen = values[np.isfinite(values)]
    if not seen.size or float(np.ptp(seen)) == 0.0 or not bool((seen == np.round(seen)).all()):
        return None
    for servo in SERVOS:
        inside = bool((seen >= servo.least).all() and (seen <= servo.largest).all())
        reaches = float(seen.max()) > servo.centre > float(seen.min()) or servo.least > 0.0
        if inside and reaches and abs(float(np.mean(seen)) - servo.centre) < servo.travel:
            return servo
    return None


def turned_from_counts(
    signal: str, values: FloatArray, unit: str, centre: float | None, scale: float | None
) -> tuple[FloatArray, list[Note]]:
    """Return the angle (n,) in rad of a fin's counts, or a motor's counts from its centre, and a note on an assumed scale."""
    servo = BY_UNIT.get(unit) or next((s for s in SERVOS if s.centre == centre), None) or servo_of(values)
    middle = centre if centre is not None else servo.centre if servo is not None else 0.0
    if signal_of(signal) not in FINS:
        return (values - middle) * (scale or 1.0), []
    if scale is not None:
        return (values - middle) * scale, []
    travel = servo.travel if servo is not None else max(float(np.nanmax(np.abs(values - middle), initial=0.0)), 1.0)
    worth = FULL_RAD / travel
    message = (
        f"{signal} is in {_in_words(unit, middle)}, and what one is worth is not known: taken as {math.degrees(worth):.3g} deg; "
        "the fin's authority is per count then: set `scale`, in rad a count, from the servo's range"
    )
    return (values - middle) * worth, [Note(COUNTS, message, {"signal": signal, "centre": middle, "scale": worth})]


def _in_words(unit: str, middle: float) -> str:
    return f"counts about {middle:g}" if unit == COUNTS else f"{BY_UNIT[unit].says}"
