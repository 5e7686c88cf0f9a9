"""The fin turns no faster than its motor: |d delta/dt| <= max_rate (rad/s).

The fin moves toward the command at max_rate until it reaches it, and then follows it as fast as the limit allows; it starts at
the command. In its variant the limit to the negative side is falling_share max_rate.
Source: Van Amerongen 1982 (the steering machine).
"""

from __future__ import annotations

from fieldsid.effects._paths import line_of_two_pieces, through
from fieldsid.models.axis import Axis
from fieldsid.models.effect import Coefficient, Effect, Stage, Values, Variant
from fieldsid.models.fin_path import FinPath
from fieldsid.models.record import Record
from fieldsid.numerics.arrays import FloatArray
from fieldsid.numerics.jit import jit


@jit
def rate_limited(steps: FloatArray, start: FloatArray, end: FloatArray, up: float, down: float, out: FloatArray) -> None:
    """Fill out (n-1, 4) with lines and ends of the path of a fin that rises at `up` and falls at `down` rad/s at most."""
    fin = start[0]
    for i in range(start.shape[0]):
        h = steps[i]
        slope = (end[i] - start[i]) / h
        behind = start[i] - fin
        toward = up if behind > 0.0 else -down
        closing = up - slope if behind > 0.0 else down + slope
        meets = h
        if behind == 0.0:
            meets = 0.0
        elif closing > 0.0:
            meets = min(abs(behind) / closing, h)
        at_meeting = fin + toward * meets if meets > 0.0 else fin
        if meets < h:
            at_meeting = start[i] + slope * meets
        after = min(max(slope, -down), up)
        last = at_meeting + after * (h - meets)
        out[i, 0], out[i, 1] = line_of_two_pieces(meets / h, fin, at_meeting, last)
        out[i, 2], out[i, 3] = fin, last
        fin = last


def fin(path: FinPath, values: Values, record: Record) -> FinPath:
    """Return the path of a fin that turns at `max_rate` at most, (n-1,) rad."""
    up = float(values["max_rate"])
    down = up * float(values.get("falling_share", 1.0))
    return through(path, record.steps, lambda steps, start, end, out: rate_limited(steps, start, end, up, down, out))


FALLING = Coefficient(
    "falling_share", "1", 0.1, 10.0, 1.0, scan=(0.6, 1.6), step=1e-3, says="fastest rate to the negative side over the other"
)

EFFECT = Effect(
    name="rate_limit",
    says="the fin turns no faster than its motor allows",
    stage=Stage.ACTUATOR,
    axes=(Axis.YAW, Axis.PITCH),
    equation="d(delta)/dt = clip(toward command, -max_rate, max_rate)",
    coefficients=(
        Coefficient(
            "max_rate", "rad/s", 0.02, 20.0, 0.5, scan=(0.1, 0.2, 0.4, 0.8, 1.6, 5.0), step=1e-3, says="fastest fin rate"
        ),
    ),
    telltale="the response starts late after large commands and in time after small ones: the lag grows with the step",
    excited_by=("square_pulses", "doublet", "three_two_one_one", "zigzag"),
    mistaken_for=("servo_lag", "delay", "stall", "sway_coupling", "heave_coupling"),
    source="Van Amerongen 1982, Adaptive Steering of Ships (steering machine)",
    order=20,
    fin=fin,
    variants=(Variant("it turns faster to one side than to the other", (FALLING,)),),
)
