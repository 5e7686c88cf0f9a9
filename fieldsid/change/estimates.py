"""The pooled estimate of a parameter at one speed from all models of one side, with a standard error.

Values of one model at several speeds come from one fit: their errors are taken as fully correlated, those of two models as
independent. Where models of one side disagree at a speed by more than their errors, the error of their mean is widened
by the Birge ratio (Birge 1932, Physical Review 40, 207).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from fieldsid.change.record import TRIM_ANGLE
from fieldsid.display import Brief
from fieldsid.models.axis import NAMES
from fieldsid.models.model import Model
from fieldsid.models.speed_law import GROUP_WIDTH
from fieldsid.numerics.arrays import FloatArray
from fieldsid.plant.parameter_source import ParameterSource
from fieldsid.plant.points import points_of


@dataclass(frozen=True, slots=True, repr=False)
class Known(Brief):
    """Values and standard errors by name at one speed, and the weight of each model in them, by its index."""

    values: Mapping[str, float]
    std_errors: Mapping[str, float]
    shares: Mapping[int, float]


def common_speeds(old: ParameterSource, new: ParameterSource) -> list[float]:
    """Return the speeds in m/s, ascending, at which both sides have a model; points within 8 % of each other count once."""
    found: list[float] = []
    for speed in sorted(float(s) for s in {*old.speeds, *new.speeds}):
        if not (_models_at(old, speed) and _models_at(new, speed)):
            continue
        if found and speed <= found[-1] * (1 + GROUP_WIDTH):
            continue
        found.append(speed)
    return found


def known_at(source: ParameterSource, speed: float) -> Known:
    """Return the pooled estimates of a side at a speed in m/s."""
    names = (*NAMES[source.axis].base, TRIM_ANGLE)
    each = {place: _estimates_of_model(source.models[place], speed) for place in _models_at(source, speed)}
    values, errors, shares = {}, {}, {}
    for name in names:
        values[name], errors[name], weights = _weighted_mean({p: (v[name], e[name]) for p, (v, e) in each.items()})
        if name == NAMES[source.axis].authority:
            shares = weights
    return Known(MappingProxyType(values), MappingProxyType(errors), MappingProxyType(shares))


def _models_at(source: ParameterSource, speed: float) -> list[int]:
    """Return the indices of the models whose range of flown speeds includes a speed."""
    return [i for i, model in enumerate(source.models) if _covers(model, speed)]


def _covers(model: Model, speed: float) -> bool:
    speeds = [s for s, _ in model.law.points] or [model.law.reference]
    reach = 1 + 0.5 * GROUP_WIDTH
    return min(speeds) / reach <= speed <= max(speeds) * reach


def _estimates_of_model(model: Model, speed: float) -> tuple[dict[str, float], dict[str, float]]:
    """Return a model's base parameters and trim angle at a speed, with the relative standard errors of its nearest point."""
    names = NAMES[model.axis]
    _, (points,) = points_of([model], ["model"])
    near = min(points, key=lambda p: abs(p.speed - speed))
    values = dict(model.at_speed(speed))
    scaled = {n: abs(values[n] / near.values[n]) if near.values[n] else 1.0 for n in values}
    errors = {n: near.std_errors.get(n, 0.0) * scaled[n] for n in values}
    b, c = values[names.authority], values[names.trim]
    values[TRIM_ANGLE] = c / b
    errors[TRIM_ANGLE] = float(np.hypot(errors[names.trim] / b, c * errors[names.authority] / b**2))
    return values, errors


def _weighted_mean(each: Mapping[int, tuple[float, float]]) -> tuple[float, float, dict[int, float]]:
    """Return the weighted mean of independent values, its standard error, and the weights."""
    places = list(each)
    values = np.array([each[p][0] for p in places])
    errors = np.array([each[p][1] for p in places])
    weights = weights_of(errors)
    mean = float(weights @ values)
    error = float(np.sqrt(weights**2 @ errors**2))
    if values.size > 1 and np.all(errors > 0):
        error *= max(1.0, float(np.sqrt(np.sum(((values - mean) / errors) ** 2) / (values.size - 1))))
    return mean, error, dict(zip(places, weights.tolist(), strict=True))


def weights_of(errors: FloatArray) -> FloatArray:
    """Return the inverse-variance weights (n,) for standard errors (n,); equal weights where one is not positive."""
    weights = 1.0 / errors**2 if np.all(errors > 0) else np.ones(errors.size)
    return np.asarray(weights / weights.sum())


def shared_values(source: ParameterSource) -> Iterator[tuple[str, float, float]]:
    """Yield the effects' coefficients that all models of a side have, pooled, with standard errors where they are known."""
    base = {*NAMES[source.axis].base, "damping_exponent"}
    for name in dict.fromkeys(n for m in source.models for n in m.free if n not in base and "@" not in n):
        if all(name in m.free for m in source.models):
            value, error, _ = _weighted_mean({i: (m.values[name], m.std_error(name)) for i, m in enumerate(source.models)})
            if np.isfinite(error) and error > 0:
                yield name, value, error
