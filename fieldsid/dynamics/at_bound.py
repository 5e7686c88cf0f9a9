"""Which coefficients of a model stand on a bound: what is estimated there is no minimum, and has no standard error."""

from __future__ import annotations

from fieldsid.dynamics.free_run import effects_of
from fieldsid.errors import EffectError, ModelError
from fieldsid.models.effect import is_on_bound
from fieldsid.models.model import Model


def at_bound(model: Model) -> frozenset[str]:
    """Return the names of the coefficients that a model has on a bound of theirs; of an effect not known here none are."""
    try:
        every = [c for effect in effects_of(model) for c in effect.shared]
    except (EffectError, ModelError):
        return frozenset()
    return frozenset(c.name for c in every if is_on_bound(model.values[c.name], c.low, c.high))
