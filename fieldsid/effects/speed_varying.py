"""Speed changes within the run: authority goes as f^2, damping and cross state as f, f = (u/u_run)^speed_share.

u is the smoothed surge and u_run its median over the run, at which the run's parameters hold. speed_share = 1 is lift theory (fin
force ~ u^2, linear damping ~ u), 0 no dependence. In its variant the damping has an exponent of its own (damping_share):
potential damping and skin friction do not grow with the speed. Source: Fossen 2011, section 6.4; the paper's b2(u^2) law.
"""

from __future__ import annotations

from fieldsid.effects._speed_powers import speed_powers
from fieldsid.errors import EffectError
from fieldsid.models.axis import Axis
from fieldsid.models.effect import Coefficient, Effect, Stage, Terms, Values, Variant
from fieldsid.models.record import Record


def terms(values: Values, record: Record) -> Terms:
    """Return the factors on damping and authority, each (n,); raises EffectError where the run has no speed."""
    surge = record["surge"]
    if not record.speed > 0.0:
        raise EffectError(
            f"run {record.name!r} has no forward speed to refer to",
            found=f"median surge {record.speed:.3g} m/s",
            hint="leave `speed_varying` out, or check the sign of the surge speed on import",
        )
    return speed_powers(values, surge / record.speed)


EFFECT = Effect(
    name="speed_varying",
    says="the speed changes within the run, and the fin's authority and the damping with it",
    stage=Stage.HYDRODYNAMICS,
    axes=(Axis.YAW, Axis.PITCH),
    equation="b(t) = b * (u/u_run)^(2 * speed_share), a(t) = a * (u/u_run)^speed_share",
    coefficients=(
        Coefficient("speed_share", "1", 0.0, 1.5, 1.0, step=1e-3, says="1 is lift theory, b ~ u^2 and a ~ u; 0 is no change"),
    ),
    telltale="the gain of the response follows the speed: too strong a simulation where the vehicle has slowed down",
    excited_by=("turning_circle", "zigzag", "square_pulses"),
    mistaken_for=("quadratic_damping", "crossflow_drag", "stall", "step_change", "speed_moment", "prop_moment"),
    source="Fossen 2011, section 6.4: lift against u^2",
    needs=("surge",),
    terms=terms,
    variants=(
        Variant(
            "the damping goes with a power of the speed of its own",
            (Coefficient("damping_share", "1", -0.5, 2.0, 1.0, scan=(0.0, 1.5), step=1e-3, says="power of the damping's speed"),),
        ),
    ),
)
