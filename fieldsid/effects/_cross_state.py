"""The hidden cross state that sway and heave share: x' = -cross_damping f x - cross_rate f^2 r, f = (speed/reference)^p.

A run starts from x = -(cross_rate / cross_damping) f r0, the equilibrium at a steady rate r0 before the run; r0 is estimated for
each run (`rate_before` in fitting/problem/parameters.py). A rate that never exceeded |r0| cannot have brought x further from
zero. In one variant p is a coefficient (cross_exponent) and not the exponent of the damping. In another the drag is quadratic in
the cross speed as well,
    x' = -cross_damping f x - (cross_quadratic / f) x|x| - cross_rate f^2 r + cross_fin f^3 delta
With x = -a21 v, a21 ~ f, the drag D v|v| becomes D/|a21| x|x|, and the side force of the fin no longer drops out of the transfer
function. In a third the drag is that of the cross flow v + l r at every place l along the hull of length L: x/f is v/L in rad/s
(times 1 1/s), and with F and G of models/hull.py, for uniform strips,
    p' += strip_munk x - strip_drag F(v/L, p),   (v/L)' = ... - 32 strip_drag strip_inertia G(v/L, p)
    strip_drag = rho Cd T L^4 / (64 I),   strip_inertia = I/(m L^2),   I and m including added inertia and mass.
Changing the signs of x, cross_rate, cross_fin and strip_munk together leaves the motion as it is.
For a slender hull strip_drag is about 0.3 Cd L/T and strip_inertia 0.03 to 0.06. Where v is measured, its drift law gives start
values; the measured v is an output and never an input of the motion.
Source: Prestero 2001, table of coefficients (the cross flow Yvv is most of a torpedo's sway drag); Fossen 2011, sections 6.4.3
and 7.1.
"""

from __future__ import annotations

from collections.abc import Sequence

from fieldsid.models.effect import Coefficient, Values, Variant
from fieldsid.models.helpers.drift_law import drift_law, reference_speed
from fieldsid.models.hull import Core
from fieldsid.models.record import Record
from fieldsid.numerics.arrays import FloatArray


def coefficients(cross: str, builds_up: str) -> tuple[Coefficient, ...]:
    """Return the coefficients cross_damping and cross_rate; `cross` names the speed, builds_up says in words what drives it.

    The lower bound of cross_damping is 0.1 1/s: a slower state cannot be distinguished from a drift in runs of a minute.
    """
    return (
        Coefficient(
            "cross_damping",
            "1/s",
            0.1,
            10.0,
            0.8,
            scan=(0.25, 0.7, 2.0),
            step=1e-3,
            rate_exponent=1,
            says=f"damping of the {cross} speed",
        ),
        Coefficient(
            "cross_rate",
            "1/s^2",
            -20.0,
            20.0,
            0.1,
            scan=(-0.2, 0.2),
            rate_exponent=2,
            says=f"Munk moment {builds_up}",
        ),
    )


OWN_POWER = Coefficient("cross_exponent", "1", -1.0, 3.0, 1.0, step=1e-3, says="power of the speed its damping goes with")
SQUARE = Coefficient(
    "cross_quadratic", "s", 0.0, 1e5, 3.0, scan=(1.0, 10.0, 100.0), step=1e-3, says="drag with the square of the cross speed"
)
OF_FIN = Coefficient("cross_fin", "1/s^3", -50.0, 50.0, 0.0, says="what the fin's own lift does to it")
STRIP_DRAG = Coefficient("strip_drag", "1/rad", 0.0, 100.0, 3.0, step=1e-3, says="drag of the cross flow, per rad/s of rate")
STRIP_INERTIA = Coefficient("strip_inertia", "1", 0.0, 1.0 / 12.0, 0.04, step=1e-4, says="inertia over mass and length squared")
STRIP_MUNK = Coefficient("strip_munk", "1/s", -50.0, 50.0, 0.0, step=1e-3, says="moment per drift speed over length")
MUNK_POWER = Coefficient("munk_exponent", "1", -1.0, 6.0, 2.0, step=1e-3, says="power of the speed its moment goes with")
RATE_OVER_DAMPING = 0.2
"""Start value of cross_rate over the square of a measured cross_damping, as large as the scan's over the hull's rate squared."""


def measured_starts(records: Sequence[Record], _residuals: Sequence[FloatArray]) -> list[dict[str, float]]:
    """Return start values: the damping of the measured drift law, with a moment of either sign; none if v is not measured."""
    law = drift_law(records, reference_speed(records))
    if law is None:
        return []
    damping = 1.0 / law.time_constant
    return [{"cross_damping": damping, "cross_rate": side * RATE_OVER_DAMPING * damping**2} for side in (-1.0, 1.0)]


def _strip_starts(records: Sequence[Record], residuals: Sequence[FloatArray]) -> list[dict[str, float]]:
    """Return start values for a hull with cross-flow drag; cross_rate is of the order of half the speed over the length."""
    common = {"strip_inertia": STRIP_INERTIA.start, "strip_munk": 0.0, "cross_fin": 0.0, "cross_damping": 0.2}
    return [common | {"cross_rate": rate, "strip_drag": drag} for rate in (0.2, 0.6, 1.5) for drag in (2.0, 6.0)]


FORMS = (
    Variant(
        "its drag is that of the cross flow, summed along the hull",
        (STRIP_DRAG, STRIP_INERTIA, STRIP_MUNK, OF_FIN),
        initial_guesses=_strip_starts,
    ),
    Variant("its moment has a power of the speed of its own", (MUNK_POWER,)),
    Variant("it has a power of the speed of its own", (OWN_POWER,)),
    Variant("its drag grows with the square of its speed", (SQUARE, OF_FIN)),
    Variant(
        "its drag grows with the square of its speed, and it has a power of the speed of its own", (SQUARE, OF_FIN, OWN_POWER)
    ),
)


def core(values: Values, scale: float) -> Core:
    """Return the core's constants at `scale` times the reference speed; without cross_exponent p is the damping's exponent."""
    lift = scale ** values.get("cross_exponent", values.get("damping_exponent", 1.0))
    coupling = scale ** values["munk_exponent"] if "munk_exponent" in values else lift**2
    state = Core(
        cross_damping=values["cross_damping"] * lift,
        cross_rate=values["cross_rate"] * coupling,
        cross_fin=values.get("cross_fin", 0.0) * lift**3,
        cross_quadratic=values.get("cross_quadratic", 0.0) / lift,
    )
    if "strip_drag" not in values:
        return state
    force = 32.0 * values["strip_drag"] * values["strip_inertia"] * lift
    return state._replace(
        cross_share=values["strip_munk"],
        strip_moment=values["strip_drag"],
        strip_force=force,
        strip_flow=1.0 / lift,
    )
