"""The shape of the saved state of a live estimate."""

from __future__ import annotations

from fieldsid.records.check import AXES, Shape, above_zero, flag, maybe, number, one_of, text, times, whole_number

ANY = number(-1e60, 1e60)
"""A number whose square does not overflow."""
NOT_MEASURED = maybe(ANY)
LINE = (NOT_MEASURED, NOT_MEASURED)
COUNT = number(0.0, 1e15)
RECENT = 256
GATE: Shape = {"recent": times(RECENT, NOT_MEASURED), "seen": whole_number, "limit": maybe(number(0.0)), "spikes": whole_number}
FILTER: Shape = {
    "memory": times(24, ANY),
    "packed": times(14, ANY),
    "late": [(ANY, NOT_MEASURED, flag, LINE)],
    "moves": [(ANY, ANY, LINE)],
    "fin": NOT_MEASURED,
    "last_angle": NOT_MEASURED,
    "counts": dict.fromkeys(("used", "missing", "repeated", "gaps", "restarts", "late"), whole_number),
    "lagged": {
        **dict.fromkeys(("rows", "duration", "durations", "samples", "weight", "squares"), COUNT),
        **dict.fromkeys(("begin", "last"), ANY),
        "sum": times(5, ANY),
        "recent": times(257 * 5, ANY),
        "products": times(257 * 25, ANY),
    },
    "angle_gate": GATE,
    "rate_gate": GATE,
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
        "window": times(1024 * 5, NOT_MEASURED),
        "authority": {
            "before": times(38, ANY),
            "seconds": [ANY],
            "rows": [(ANY,) * 6],
            **dict.fromkeys(("noise", "freedom", "usual", "speed"), NOT_MEASURED),
        },
        "fin_most": ANY,
        "is_held": flag,
        "jump": maybe((ANY, ANY, ANY)),
        "seen": whole_number,
        "speed_sum": ANY,
        "speeds": whole_number,
        "filter": maybe(FILTER),
    },
    "watch": {
        "looks": [[NOT_MEASURED]],
        "excitation": {"time": NOT_MEASURED, **dict.fromkeys(("weights", "means", "squares"), (ANY, ANY))},
    },
}
