"""Which coefficients of a model stand on a bound: what is estimated there is no minimum, and has no standard error."""

from __future__ import annotations

from fieldsid.dynamics.free_run import effects_of
from fieldsid.errors import EffectError, ModelError
from fieldsid.models.model import Model

BOUND_SHARE = 1e-6
"""Share of the range of a coefficient from a bound within which it stands on it."""


def at_bound(model: Model) -> frozenset[str]:
    """Return the names of the coefficients that a model has on a bound of theirs; of an effect not known here none are."""
    try:
        every = [c for effect in effects_of(model) for c in effect.shared]
    except (EffectError, ModelError):
        return frozenset()
    apart = {c.name: min(model.values[c.name] - c.low, c.high - model.values[c.name]) / (c.high - c.low) for c in every}
    return frozenset(name for name, share in apart.items() if share <= BOUND_SHARE)
