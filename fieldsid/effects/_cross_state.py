"""The hidden cross state that sway and heave share: x' = -cross_damping f x - cross_rate f^2 r, f = (speed/reference)^p.

A run starts from x = -(cross_rate / cross_damping) f r0, where a steady rate r0 before it had led to: each run's own
number (`rate_before` in fitting/layout.py). No motion within that rate leaves x further from zero.
"""

from __future__ import annotations

from fieldsid.models.effect import Core, Values


def core(values: Values, scale: float) -> Core:
    """Return the core's coefficients at `scale` times the reference speed, p the exponent of the damping's speed law."""
    lift = scale ** values.get("damping_exponent", 1.0)
    return Core(cross_damping=values["cross_damping"] * lift, cross_rate=values["cross_rate"] * lift**2)
