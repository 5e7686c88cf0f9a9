"""Small fin angles do nothing: delta = 0 inside +/-width, command - width sign(command) outside (width >= 0, rad).

The width is subtracted, so that the fin angle is continuous at the edge. Variants: the edge is rounded over deadband_blend; the
fin jumps at the edge by deadband_jump * width, and may stay deflected until |command| < release * width; the middle of the zone
is at off_middle * width.
Source: Tao and Kokotovic 1996, Adaptive Control of Systems
with Actuator and Sensor Nonlinearities.
"""

from __future__ import annotations

from fieldsid.effects._fin_reach import shares_of_reach
from fieldsid.effects._paths import through
from fieldsid.effects._static_map import StaticMap
from fieldsid.models.axis import Axis
from fieldsid.models.effect import Coefficient, Effect, Stage, Values, Variant
from fieldsid.models.fin_path import FinPath
from fieldsid.models.record import Record
from fieldsid.numerics.arrays import FloatArray
from fieldsid.numerics.jit import jit


@jit
def _share(here: float, there: float, edge: float) -> float:
    """Return the share, 0..1, of a linear change from `here` to `there` at which it reaches an edge."""
    return min(max((edge - here) / (there - here), 0.0), 1.0) if there != here else 0.0


@jit
def with_release(start: FloatArray, end: FloatArray, width: float, deficit: float, let_go: float, out: FloatArray) -> None:
    """Fill out (n-1, 4) with lines and ends of the path of a fin that leaves zero at `width` and returns to it at `let_go`.

    Away from zero the fin is smaller by `deficit` than the command. Angles in rad, let_go <= width.
    """
    moves = abs(start[0]) > width
    for i in range(start.shape[0]):
        a, b = start[i], end[i]
        here, there, from_side, to_side = abs(a), abs(b), 1.0 if a > 0.0 else -1.0, 1.0 if b > 0.0 else -1.0
        moves = here > width or (moves and here >= let_go)
        before, after, mean = max(here - deficit, 0.0) if moves else 0.0, 0.0, 0.0
        across = a * b < 0.0
        goes_on = there > width or (moves and there >= let_go and not across)
        if across:
            zero = here / (here + there)
            stops = zero * _share(here, 0.0, let_go) if moves else 0.0
            mean += 0.5 * stops * (before + max(let_go - deficit, 0.0)) * from_side
        elif moves and not goes_on:
            stops = _share(here, there, let_go)
            mean += 0.5 * stops * (before + max(let_go - deficit, 0.0)) * from_side
        if goes_on:
            after = there - deficit
            if across or not moves:
                takes_off = zero + (1.0 - zero) * _share(0.0, there, width) if across else _share(here, there, width)
                mean += 0.5 * (1.0 - takes_off) * (width - deficit + after) * to_side
            else:
                mean += 0.5 * (before + after) * to_side
        first, last = before * from_side, after * to_side
        half = 0.5 * (last - first)
        out[i, 0], out[i, 1], out[i, 2], out[i, 3] = mean - half, mean + half, first, last
        moves = goes_on


def fin(path: FinPath, values: Values, record: Record) -> FinPath:
    """Return the path with the dead zone of half width `width` taken out, (n-1,) rad."""
    width, jump_share = values["width"], values.get("deadband_jump", 0.0)
    if width <= 0.0:
        return path
    if "release" in values:
        deficit, let_go = (1.0 - jump_share) * width, values["release"] * width
        return through(path, record.steps, lambda _steps, start, end, out: with_release(start, end, width, deficit, let_go, out))
    if "off_middle" in values:
        path = path.shifted(-values["off_middle"] * width)
    zone = StaticMap(beyond=1.0, edge=width, blend=values.get("deadband_blend", 0.0), jump=jump_share * width)
    return zone.through(path, record.steps)


WIDTH = Coefficient("width", "rad", 0.0, 0.2, 0.03, step=5e-4, says="half width of the dead zone")

EFFECT = Effect(
    name="deadband",
    says="small fin angles do nothing",
    stage=Stage.ACTUATOR,
    axes=(Axis.YAW, Axis.PITCH),
    equation="delta = 0 for |command| <= width, else command - width * sign(command)",
    coefficients=(WIDTH,),
    telltale="small commands give too little turn and large ones too much: the gain read from small steps is low",
    excited_by=("stairs", "multisine", "chirp", "square_pulses"),
    mistaken_for=("backlash", "stall", "quadratic_damping", "asymmetric_fin"),
    source="Tao and Kokotovic 1996, Adaptive Control of Systems with Actuator and Sensor Nonlinearities",
    order=50,
    variants=(
        Variant(
            "the edge is smooth",
            (
                Coefficient(
                    "deadband_blend",
                    "rad",
                    0.0,
                    0.2,
                    0.03,
                    scan=(0.02, 0.06),
                    step=5e-4,
                    says="angle over which the edge is rounded",
                ),
            ),
        ),
        Variant(
            "the fin jumps at the edge",
            (
                Coefficient(
                    "deadband_jump", "1", 0.0, 1.0, 0.8, scan=(0.5, 1.0), step=1e-3, says="share of the width it jumps by"
                ),
            ),
        ),
        Variant(
            "the fin jumps at the edge, and stays out until the command is well inside it",
            (
                Coefficient("deadband_jump", "1", 0.0, 1.0, 1.0, step=1e-3, says="share of the width it jumps by"),
                Coefficient(
                    "release",
                    "1",
                    0.0,
                    1.0,
                    0.5,
                    scan=(0.2, 0.4, 0.6, 0.8),
                    step=1e-2,
                    says="share of the width inside which the fin goes back",
                ),
            ),
        ),
        Variant(
            "its middle is off zero",
            (
                Coefficient(
                    "off_middle",
                    "1",
                    -1.0,
                    1.0,
                    0.0,
                    scan=(-0.5, 0.5),
                    step=1e-3,
                    says="where its middle lies, in half widths",
                ),
            ),
        ),
    ),
    fin=fin,
    initial_guesses=shares_of_reach(WIDTH, (0.015, 0.05, 0.1, 0.2, 0.32, 0.5)),
)
