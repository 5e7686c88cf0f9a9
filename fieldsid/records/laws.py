"""The shape of a fit file: laws over speed, the points they were fitted to, and the models of these points."""

from __future__ import annotations

from fieldsid.records.check import AXES, HEAD, Shape, at_least_one, each, maybe, number, one_of, text, whole_number
from fieldsid.records.model import EXPONENT, MODEL, SPEED

LARGEST_COEFFICIENT = 1e6
"""Largest coefficient of a law of powers of the speed in SI."""
LARGEST_LOGARITHM = 50.0
"""Largest of the two coefficients ln k and e of a law k u^e."""
REGRESSION: Shape = {
    "kind": text,
    "powers": [EXPONENT],
    "coefficients": [number(-LARGEST_COEFFICIENT, LARGEST_COEFFICIENT)],
    "covariance": [[maybe(number(-(LARGEST_COEFFICIENT**2), LARGEST_COEFFICIENT**2))]],
    "dof": whole_number,
    "r2": maybe(number()),
    "rms": maybe(number(0.0)),
}
FIT: Shape = {
    **HEAD,
    "axis": one_of(AXES),
    "points": at_least_one({"name": text, "speed_m_s": SPEED, "values": each(number()), "std_errors": each(number(0.0))}),
    "laws": each({"sign": number(-1.0, 1.0), "chosen": text, "candidates": each(REGRESSION)}),
    "models?": [{"name": text, "record": MODEL}],
}
