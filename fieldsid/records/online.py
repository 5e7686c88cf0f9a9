"""The shape of the saved state of a live estimate."""

from __future__ import annotations

from fieldsid.records.check import AXES, Shape, above_zero, each, flag, maybe, number, one_of, text, times, whole_number

ANY = number(-1e60, 1e60)
"""A number whose square does not overflow."""
NOT_MEASURED = maybe(ANY)
LINE = maybe((ANY, ANY))
COUNT = number(0.0, 1e15)
RECENT = 256
GATE: Shape = {"recent": times(RECENT, NOT_MEASURED), "seen": whole_number, "limit": maybe(number(0.0)), "spikes": whole_number}
FILTER: Shape = {
    "memory": times(24, ANY),
    "packed": times(14, ANY),
    "late": [(ANY, NOT_MEASURED, flag, LINE)],
    "moves": [(ANY, ANY, LINE)],
    "numbers": {"fin": NOT_MEASURED, "last_angle": NOT_MEASURED},
    "counts": dict.fromkeys(("used", "missing", "repeated", "gaps", "restarts", "late"), whole_number),
    "lagged": {
        "numbers": (COUNT, ANY, ANY, COUNT, COUNT, COUNT, COUNT, COUNT),
        "0": times(5, ANY),
        "1": times(257 * 5, ANY),
        "2": times(257 * 25, ANY),
    },
    "angle_gate": GATE,
    "rate_gate": GATE,
}
LOOK: Shape = {
    "time": NOT_MEASURED,
    "values": each(NOT_MEASURED),
    "std_errors": each(NOT_MEASURED),
    "used": whole_number,
    "speed": NOT_MEASURED,
}
STATE: Shape = {
    "schema": text,
    "source": text,
    "state": {
        "version": whole_number,
        "axis": one_of(AXES),
        "settings": {"bandwidth": number(0.01, 1000.0), "forgetting": above_zero(1.0)},
        "by_rate": maybe(flag),
        "first_time": NOT_MEASURED,
        "window": times(1024, (NOT_MEASURED, NOT_MEASURED, NOT_MEASURED, NOT_MEASURED, NOT_MEASURED)),
        "authority": {"numbers": (NOT_MEASURED,) * 4, "sums": [(NOT_MEASURED, COUNT, times(21, ANY))]},
        "fin": (ANY, flag),
        "jump": maybe((ANY, ANY, ANY)),
        "seen": whole_number,
        "speed": (ANY, whole_number),
        "filter": maybe(FILTER),
    },
    "watch": {
        "looks": [LOOK],
        "excitation": {"time": NOT_MEASURED, **dict.fromkeys(("weights", "means", "squares"), (ANY, ANY))},
    },
}
