"""The coefficients of a model that lie on a bound: such an estimate is no stationary point and has no standard error."""

from __future__ import annotations

from fieldsid.dynamics.free_run import effects_of
from fieldsid.errors import EffectError, ModelError
from fieldsid.models.effect import is_on_bound
from fieldsid.models.model import Model


def at_bound(model: Model) -> frozenset[str]:
    """Return the names of the coefficients that lie on one of their bounds; none if an effect of the model is not known here."""
    try:
        coefficients = [c for effect in effects_of(model) for c in effect.shared]
    except (EffectError, ModelError):
        return frozenset()
    return frozenset(c.name for c in coefficients if is_on_bound(model.values[c.name], c.low, c.high))
