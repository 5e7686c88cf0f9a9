"""The hidden cross state that sway and heave share: x' = -cross_damping f x - cross_rate f^2 p, f = (speed/reference)^p."""

from __future__ import annotations

from fieldsid.models.effect import Core, Values


def core(values: Values, scale: float) -> Core:
    """Return the core's coefficients at `scale` times the reference speed, p the exponent of the damping's speed law."""
    lift = scale ** values.get("damping_exponent", 1.0)
    return Core(cross_damping=values["cross_damping"] * lift, cross_rate=values["cross_rate"] * lift**2)
