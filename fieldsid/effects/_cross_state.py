"""The hidden cross state that sway and heave share: x' = -cross_damping f x - cross_rate f^2 r, f = (speed/reference)^p.

A run starts from x = -(cross_rate / cross_damping) f r0, where a steady rate r0 before it had led to: each run's own
number (`rate_before` in fitting/problem/parameters.py). No motion within that rate leaves x further from zero.
In its other forms it has a power of the speed of its own, and drag that grows with the square of the cross speed,
    x' = -cross_damping f x - (cross_quadratic / f) x|x| - cross_rate f^2 r + cross_fin f^3 delta
With x = -a21 v, a21 ~ f: the drag D v|v| becomes D/|a21| x|x|. Then the fin's own lift no longer drops out of the
transfer function. Source: Prestero 2001, table of coefficients (the cross flow Yvv is most of a torpedo's sway drag).
"""

from __future__ import annotations

from fieldsid.models.effect import Coefficient, Core, Values, Variant


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
MUNK_POWER = Coefficient("munk_exponent", "1", -1.0, 6.0, 2.0, step=1e-3, says="power of the speed its moment goes with")
FORMS = (
    Variant("its moment has a power of the speed of its own", (MUNK_POWER,)),
    Variant("it has a power of the speed of its own", (OWN_POWER,)),
    Variant("its drag grows with the square of its speed", (SQUARE, OF_FIN)),
    Variant(
        "its drag grows with the square of its speed, and it has a power of the speed of its own", (SQUARE, OF_FIN, OWN_POWER)
    ),
)


def core(values: Values, scale: float) -> Core:
    """Return the core's coefficients at `scale` times the reference speed; p is the damping's where it has none of its own."""
    lift = scale ** values.get("cross_exponent", values.get("damping_exponent", 1.0))
    coupling = scale ** values["munk_exponent"] if "munk_exponent" in values else lift**2
    return Core(
        cross_damping=values["cross_damping"] * lift,
        cross_rate=values["cross_rate"] * coupling,
        cross_fin=values.get("cross_fin", 0.0) * lift**3,
        cross_quadratic=values.get("cross_quadratic", 0.0) / lift,
    )
