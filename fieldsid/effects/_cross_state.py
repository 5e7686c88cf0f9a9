"""The hidden cross state that sway and heave share: x' = -cross_damping f x - cross_rate f^2 r, f = (speed/reference)^p.

A run starts from x = -(cross_rate / cross_damping) f r0, where a steady rate r0 before it had led to: each run's own
number (`rate_before` in fitting/problem/parameters.py). No motion within that rate leaves x further from zero.
In its other forms it has a power of the speed of its own, and drag that grows with the square of the cross speed,
    x' = -cross_damping f x - (cross_quadratic / f) x|x| - cross_rate f^2 r + cross_fin f^3 delta
With x = -a21 v, a21 ~ f: the drag D v|v| becomes D/|a21| x|x|. Then the fin's own lift no longer drops out of the
transfer function. Or the drag is that of the cross flow v + l r at every place l along the hull of length L: x/f is v/L itself
in rad/s (times 1 1/s), and with F and G of dynamics/nonlinear_kernel.py, uniform strips,
    p' += strip_munk x - strip_drag F(v/L, p),   (v/L)' = ... - 32 strip_drag strip_inertia G(v/L, p)
    strip_drag = rho Cd T L^4 / (64 I),   strip_inertia = I/(m L^2),   I and m with their added parts.
The drift to the other side, with cross_rate, cross_fin and strip_munk the other way, is the same motion.
Of a slender hull the drag is about 0.3 Cd L/T and the share of inertia 0.03 to 0.06. Where the cross speed v is measured, its
moment follows from that instead of a state,
    p' += cross_moment v     or     p' += munk_moment u v
and the model keeps the drift law of its runs, by which it is flown where v is not measured.
Source: Prestero 2001, table of coefficients (the cross flow Yvv is most of a torpedo's sway drag); Fossen 2011, sections 6.4.3
and 7.1.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from types import MappingProxyType

import numpy as np

from fieldsid.models.effect import Coefficient, Core, StandIn, Terms, Values, Variant
from fieldsid.models.helpers.drift_law import drift_law
from fieldsid.models.record import Record
from fieldsid.numerics.arrays import FloatArray


def coefficients(cross: str, builds_up: str) -> tuple[Coefficient, ...]:
    """Return the two numbers of a cross state, `cross` its name and builds_up what drives it and where to, in words.

    A state slower than ten seconds cannot be distinguished from a drift in runs of a minute.
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
OF_MEASURED = Coefficient("cross_moment", "rad/(m s)", -1e3, 1e3, 0.0, says="moment per m/s of the measured cross speed")
OF_LIFT = Coefficient(
    "munk_moment", "rad/m^2", -1e3, 1e3, 0.0, says="moment per m/s of speed and m/s of the measured cross speed"
)
STATE = ("cross_damping", "cross_rate")


def _strip_starts(records: Sequence[Record], residuals: Sequence[FloatArray]) -> list[dict[str, float]]:
    """Return starts of a hull that the cross flow holds: half of speed over length is what turns its path into drift."""
    rest = {"strip_inertia": STRIP_INERTIA.start, "strip_munk": 0.0, "cross_fin": 0.0, "cross_damping": 0.2}
    return [rest | {"cross_rate": rate, "strip_drag": drag} for rate in (0.2, 0.6, 1.5) for drag in (2.0, 6.0)]


def drift_numbers(records: Sequence[Record], reference: float) -> dict[str, float]:
    """Return the drift law of some runs, as the numbers that a model keeps of it."""
    law = drift_law(records, reference)
    return {
        "drift_damping": 1.0 / law.time_constant,
        "drift_per_rate": law.per_rate,
        "drift_per_fin": law.per_fin,
        "drift_speed": reference if np.isfinite(reference) else 1.0,
    }


STAND_IN = StandIn(
    MappingProxyType({"drift_damping": "1/s", "drift_per_rate": "m", "drift_per_fin": "m/(s rad)", "drift_speed": "m/s"}),
    drift_numbers,
)
FORMS = (
    Variant(
        "its moment is that of the measured cross speed",
        (OF_MEASURED,),
        needs=("cross",),
        without=STATE,
        extra_states=(),
        stand_in=STAND_IN,
    ),
    Variant(
        "its moment is that of the measured cross speed times the speed",
        (OF_LIFT,),
        needs=("cross", "surge"),
        without=STATE,
        extra_states=(),
        stand_in=STAND_IN,
    ),
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


def terms(values: Values, record: Record) -> Terms:
    """Return the moment (n,) rad/s^2 of the measured cross speed, in a form that takes it and has no stand-in for it."""
    if "drift_damping" in values:
        return Terms()
    if "cross_moment" in values:
        return Terms(moment=values["cross_moment"] * record["cross"])
    if "munk_moment" in values:
        return Terms(moment=values["munk_moment"] * record["surge"] * record["cross"])
    return Terms()


def core(values: Values, scale: float) -> Core:
    """Return the core's coefficients at `scale` times the reference speed; p is the damping's where it has none of its own."""
    if "cross_damping" not in values:
        return _drift_core(values, scale)
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
    return replace(
        state,
        cross_share=values["strip_munk"],
        strip_moment=values["strip_drag"],
        strip_force=force,
        strip_flow=1.0 / lift,
    )


def _drift_core(values: Values, scale: float) -> Core:
    """Return the cross state that stands in for a measured cross speed, x = k v; none where that is measured."""
    if "drift_damping" not in values:
        return Core()
    k = values.get("cross_moment", 0.0) + values.get("munk_moment", 0.0) * values["drift_speed"] * scale
    damping = values["drift_damping"] * scale
    return Core(
        cross_damping=damping,
        cross_rate=-k * damping * values["drift_per_rate"],
        cross_fin=k * damping * values["drift_per_fin"] * scale,
    )
