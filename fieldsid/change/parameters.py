"""Tests of which parameters changed significantly, at each common speed and over all speeds, as one family of tests."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import ndtr, ndtri

from fieldsid.change.estimates import Known, known_at, shared_values, weights_of
from fieldsid.change.holm import adjusted
from fieldsid.change.record import (
    CHANGED,
    LEVEL,
    TRIM_ANGLE,
    TRIM_MATTERS_RAD,
    UNCHANGED,
    UNCLEAR,
    AtSpeed,
    ParameterChange,
)
from fieldsid.models.axis import NAMES
from fieldsid.numerics.arrays import FloatArray
from fieldsid.plant.parameter_source import ParameterSource

MATTERS = 0.10
"""Share of a parameter below which a change does not matter: a tenth of the gain moves the damping ratio by a twentieth, and a
step's overshoot at damping 0.7 by less than two hundredths."""
WORDS = {"b2": "authority", "d2": "authority", "a22": "damping", "c22": "damping", "c23": "stiffness", TRIM_ANGLE: "trim"}


@dataclass(frozen=True, slots=True)
class _Quantity:
    """One quantity before the tests: name, unit, relative or not, a row for each speed, correlation of their errors (n, n)."""

    name: str
    unit: str
    is_relative: bool
    rows: tuple[AtSpeed, ...]
    correlation: FloatArray


def parameter_changes(old: ParameterSource, new: ParameterSource, speeds: Sequence[float]) -> tuple[ParameterChange, ...]:
    """Return the change of every base parameter, of the fin's trim, and of the effects' coefficients that both sides have."""
    names, befores = NAMES[old.axis], [known_at(old, s) for s in speeds]
    afters = [known_at(new, s) for s in speeds]
    units = {names.authority: "1/s^2", names.damping: "1/s", names.stiffness: "1/s^2", TRIM_ANGLE: "rad"}
    order = (names.authority, names.damping, *((names.stiffness,) if names.stiffness else ()), TRIM_ANGLE)
    found = [_quantity_over_speeds(n, units[n], speeds, befores, afters) for n in order]
    after = {n: (v, e) for n, v, e in shared_values(new)}
    found += [_coefficient(n, v, e, *after[n], old) for n, v, e in shared_values(old) if n in after]
    return _with_p_values(found)


def _quantity_over_speeds(
    name: str, unit: str, speeds: Sequence[float], befores: Sequence[Known], afters: Sequence[Known]
) -> _Quantity:
    is_relative = name != TRIM_ANGLE and all(abs(b.values[name]) > 3.0 * b.std_errors[name] for b in befores)
    rows = tuple(
        _row(s, b.values[name], b.std_errors[name], a.values[name], a.std_errors[name], is_relative=is_relative)
        for s, b, a in zip(speeds, befores, afters, strict=True)
    )
    places = range(len(speeds))
    correlation = np.array(
        [[0.5 * (_error_correlation(befores, i, j) + _error_correlation(afters, i, j)) for j in places] for i in places]
    )
    return _Quantity(name, unit, is_relative, rows, correlation)


def _error_correlation(side: Sequence[Known], i: int, j: int) -> float:
    """Return the correlation of a side's errors at two speeds, which comes from the models used at both."""
    a, b = side[i].shares, side[j].shares
    size = float(np.sqrt(sum(w * w for w in a.values()) * sum(w * w for w in b.values())))
    return sum(w * b.get(p, 0.0) for p, w in a.items()) / size


def _coefficient(name: str, old: float, old_error: float, new: float, new_error: float, source: ParameterSource) -> _Quantity:
    unit = next(m.units.get(name, "") for m in source.models)
    is_relative = abs(old) > 3.0 * old_error
    row = _row(float("nan"), old, old_error, new, new_error, is_relative=is_relative)
    return _Quantity(name, unit, is_relative, (row,), np.eye(1))


def _row(speed: float, old: float, old_error: float, new: float, new_error: float, *, is_relative: bool) -> AtSpeed:
    change, error = new - old, float(np.hypot(old_error, new_error))
    if is_relative:  # of a ratio, to first order
        change, error = new / old - 1.0, float(np.hypot(new_error / old, new * old_error / old**2))
    return AtSpeed(speed, old, old_error, new, new_error, change, error, float("nan"))


def _with_p_values(found: Sequence[_Quantity]) -> tuple[ParameterChange, ...]:
    means = [_mean_change(q) for q in found]
    tests = [_p(*mean) for mean in means] + [_p(r.change, r.std_error) for q in found if len(q.rows) > 1 for r in q.rows]
    p_values = adjusted(tests)
    of_rows = iter(p_values[len(found) :])
    out = []
    for quantity, (change, error), p in zip(found, means, p_values, strict=False):
        rows = tuple(replace(r, p_adjusted=next(of_rows) if len(quantity.rows) > 1 else p) for r in quantity.rows)
        out.append(_parameter_change(quantity, rows, change, error, p))
    return tuple(out)


def _mean_change(quantity: _Quantity) -> tuple[float, float]:
    """Return the weighted mean change over the speeds, and its standard error with the correlation of the speeds."""
    changes, errors = (np.array([getattr(r, n) for r in quantity.rows]) for n in ("change", "std_error"))
    weights = weights_of(errors)
    spread = weights * errors
    return float(weights @ changes), float(np.sqrt(max(float(spread @ quantity.correlation @ spread), 0.0)))


def _p(change: float, error: float) -> float:
    return float(2.0 * ndtr(-abs(change) / error)) if error > 0 else float("nan")


def _parameter_change(quantity: _Quantity, rows: tuple[AtSpeed, ...], change: float, error: float, p: float) -> ParameterChange:
    reach = -float(ndtri(0.5 * LEVEL)) * error
    low, high = change - reach, change + reach
    least = min([v for v in (p, *(r.p_adjusted for r in rows)) if np.isfinite(v)], default=float("nan"))
    state = CHANGED if least < LEVEL else UNCHANGED if max(abs(low), abs(high)) <= _least_relevant_change(quantity) else UNCLEAR
    return ParameterChange(
        quantity.name, WORDS.get(quantity.name, quantity.name), quantity.unit, quantity.is_relative, change, error, (low, high),
        least, state, rows,
    )  # fmt: skip


def _least_relevant_change(quantity: _Quantity) -> float:
    if quantity.is_relative:
        return MATTERS
    return TRIM_MATTERS_RAD if quantity.unit == "rad" else MATTERS * max(abs(r.old) for r in quantity.rows)
