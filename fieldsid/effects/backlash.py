"""Play in the linkage: the fin stays until the command has crossed the gap, then follows half a gap behind (play operator).

    delta <- min(max(delta, command - gap/2), command + gap/2),   gap >= 0 in rad
Before the run the fin may rest anywhere in the play: its start, in half gaps from the middle of the play, is a coefficient that
is estimated for each run. Source: Nordin and Gutman 2002, Controlling mechanical systems with backlash.
"""

from __future__ import annotations

from fieldsid.effects._fin_reach import shares_of_reach
from fieldsid.effects._paths import line_of_two_pieces, through
from fieldsid.models.axis import Axis
from fieldsid.models.effect import Coefficient, Effect, Stage, Values
from fieldsid.models.fin_path import FinPath
from fieldsid.models.record import Record
from fieldsid.numerics.arrays import FloatArray
from fieldsid.numerics.jit import jit


@jit
def played(start: FloatArray, end: FloatArray, gap: float, begins: float, out: FloatArray) -> None:
    """Fill out (n-1, 4) with lines and ends of the path behind a play of width `gap`, from `begins` (-1..1) in the play on."""
    half = 0.5 * gap
    fin = start[0] + begins * half
    for i in range(start.shape[0]):
        first = min(max(fin, start[i] - half), start[i] + half)
        last = min(max(first, end[i] - half), end[i] + half)
        bend = 0.0
        if last != first:
            # The share of the interval after which the command has crossed the gap and moves the fin.
            touches = first + half if end[i] > start[i] else first - half
            bend = min(max((touches - start[i]) / (end[i] - start[i]), 0.0), 1.0)
        out[i, 0], out[i, 1] = line_of_two_pieces(bend, first, first, last)
        out[i, 2], out[i, 3] = first, last
        fin = last


def fin(path: FinPath, values: Values, record: Record) -> FinPath:
    """Return the path of a fin behind a play of `gap`, (n-1,) rad."""
    if values["gap"] <= 0.0:
        return path
    gap, begins = float(values["gap"]), float(values.get("gap_start", 0.0))
    return through(path, record.steps, lambda _steps, start, end, out: played(start, end, gap, begins, out))


GAP = Coefficient("gap", "rad", 0.0, 0.3, 0.05, step=5e-4, says="full width of the play")
START = Coefficient(
    "gap_start", "1", -1.0, 1.0, 0.0, step=1e-2, per_run=True, of_start=True, says="where in the play the fin starts, -1 to 1"
)

EFFECT = Effect(
    name="backlash",
    says="play in the linkage: the fin hangs half a gap behind the command, on the side it came from",
    stage=Stage.ACTUATOR,
    axes=(Axis.YAW, Axis.PITCH),
    equation="delta = play(command, gap): |delta - command| <= gap/2, and delta rests inside",
    coefficients=(GAP, START),
    telltale="the same command gives two different rates, by whether it was reached from port or from starboard",
    excited_by=("stairs", "multisine", "chirp", "three_two_one_one", "square_pulses"),
    mistaken_for=("deadband", "servo_lag", "asymmetric_fin", "stall"),
    source="Nordin and Gutman 2002, Automatica 38, Controlling mechanical systems with backlash",
    order=40,
    fin=fin,
    initial_guesses=shares_of_reach(GAP, (0.015, 0.06, 0.2, 0.5)),
)
