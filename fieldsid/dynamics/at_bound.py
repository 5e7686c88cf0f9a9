"""The bounds of coefficients, and which lie on one: such an estimate is no stationary point and has no standard error."""

from __future__ import annotations

from fieldsid.dynamics.free_run import effects_of
from fieldsid.errors import EffectError, ModelError
from fieldsid.models.effect import is_on_bound
from fieldsid.models.model import Model


def at_bound(model: Model) -> frozenset[str]:
    """Return the names of the coefficients that lie on one of their bounds; none if an effect of the model is not known here."""
    return frozenset(name for name, bounds in bounds_of(model).items() if is_on_bound(model.values[name], *bounds))


def bounds_of(model: Model) -> dict[str, tuple[float, float]]:
    """Return the bounds of each coefficient; of none if an effect of the model is not known here."""
    try:
        return {c.name: (c.low, c.high) for effect in effects_of(model) for c in effect.shared}
    except (EffectError, ModelError):
        return {}
