"""The points that laws are fitted to: parameters at speeds, from identified models of one axis (from a table: `table.py`)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Annotated

import numpy as np

from fieldsid.display import Brief
from fieldsid.errors import DataError
from fieldsid.models.axis import NAMES, Axis
from fieldsid.models.model import Model
from fieldsid.numerics.arrays import FloatArray
from fieldsid.records.keys import Key, Number

EQUAL_SPEED_SHARE = 0.03
"""Speeds that differ by less than this share count as one: the spread from log to log at one thrust setting."""
SIGN_STD_ERRORS = 3.0
"""Standard errors from zero below which the sign of an authority is not known; `identify` calls it unclear."""


@dataclass(frozen=True, slots=True, repr=False)
class Point(Brief):
    """Parameters identified at one speed (m/s), by name, with standard errors where they are known."""

    name: Annotated[str, Key("The model, or the row of a table.")]
    speed: Annotated[float, Key("Its speed.", "speed_m_s")]
    values: Annotated[Mapping[str, float], Key("By parameter.")]
    std_errors: Annotated[Mapping[str, Number], Key("Their standard errors, where they are known.")]


def points_of(models: Sequence[Model], names: Sequence[str]) -> tuple[Axis, tuple[tuple[Point, ...], ...]]:
    """Return the points of each identified model; a joint model gives one point per speed group.

    Raises DataError when the models are of two axes, or the speed of one of them is not known.
    """
    axes = {m.axis for m in models}
    if len(axes) != 1:
        found = ", ".join(f"{n}: {m.axis.value}" for n, m in zip(names, models, strict=True))
        raise DataError("the models are not of one axis", found=found, hint="give the yaw models and the pitch models apart")
    return models[0].axis, tuple(tuple(_model_points(m, n)) for m, n in zip(models, names, strict=True))


def places_of_one_sign(axis: Axis, models: Sequence[Model], points: Sequence[Sequence[Point]]) -> list[int]:
    """Return the places of the models, given with their points, whose authority has the sign of the significant ones.

    Where no authority is significant, the t-values `fin_t` of all models' runs decide together. Where the significant ones
    disagree, or the sign remains unknown, all models are returned, and `check_authority` refuses them if they disagree.
    """
    name = NAMES[axis].authority
    all_points = [p for of_model in points for p in of_model if name in p.values]
    known = {
        float(np.sign(p.values[name])) for p in all_points if abs(p.values[name]) >= SIGN_STD_ERRORS * p.std_errors.get(name, 0.0)
    } or _sign_of_runs(models)
    if len(known) != 1:
        return list(range(len(points)))
    (sign,) = known
    agreeing = [i for i, of_model in enumerate(points) if all(sign * p.values.get(name, sign) > 0.0 for p in of_model)]
    return agreeing or list(range(len(points)))


def _sign_of_runs(models: Sequence[Model]) -> set[float]:
    """Return the sign of the authority by the combined t-value of all models' runs, empty where it is not significant."""
    t_values = [t for m in models if np.isfinite(t := m.trained.get("fin_t", float("nan")))]
    combined = float(np.sum(t_values) / np.sqrt(len(t_values))) if t_values else 0.0
    return {float(np.sign(combined))} if abs(combined) >= SIGN_STD_ERRORS else set()


def distinct_speeds(speeds: FloatArray) -> int:
    """Return the number of speeds that differ by more than EQUAL_SPEED_SHARE."""
    ordered = np.sort(speeds)
    return int(1 + np.sum(np.diff(ordered) > EQUAL_SPEED_SHARE * ordered[:-1])) if ordered.size else 0


def intended_speeds(speeds: FloatArray) -> list[float]:
    """Return the intended speeds of runs with mean speeds (n,) m/s, rising: one for each thrust setting.

    Each is the mean over the runs of one setting, rounded to the fewest digits within half of EQUAL_SPEED_SHARE.
    """
    groups = list[list[float]]()
    for speed in np.sort(speeds).tolist():
        if groups and speed <= groups[-1][0] * (1.0 + 2.0 * EQUAL_SPEED_SHARE):
            groups[-1].append(speed)
        else:
            groups.append([speed])
    return [_rounded(float(np.mean(group))) for group in groups]


def _rounded(speed: float) -> float:
    shown = (float(f"{speed:.{digits}g}") for digits in range(1, 17))
    return next(s for s in shown if abs(s - speed) <= 0.5 * EQUAL_SPEED_SHARE * speed)


def check_authority(axis: Axis, points: Sequence[Point]) -> float:
    """Return the common sign of the authority; raises DataError when the points disagree or have none."""
    name = NAMES[axis].authority
    known = [(p.name, p.values[name]) for p in points if name in p.values]
    signs = {float(np.sign(v)) for _, v in known}
    if signs in ({1.0}, {-1.0}):
        return signs.pop()
    if not known:
        raise DataError(
            f"no point gives `{name}`",
            found=", ".join(sorted({k for p in points for k in p.values})),
            hint=f"add a column `{name}`",
        )
    raise DataError(
        f"the sign of {name} is not the same at every speed",
        found=", ".join(f"{n}: {name} = {v:.4g}" for n, v in known),
        hint="give the fin one sign on import (`sign: -1` in mapping.yaml), or leave the odd run out",
    )


def _model_points(model: Model, name: str) -> list[Point]:
    names = NAMES[model.axis]
    if not np.isfinite(model.law.reference):
        raise DataError(
            f"model `{name}` does not know its speed",
            found="no surge in its runs",
            hint="identify from runs with `surge_m_s`, or give a table with a speed_m_s column",
        )
    speeds = [s for s, _ in model.law.points] or [model.law.reference]
    points = []
    for speed in speeds:
        values = model.at_speed(speed)
        errors = {n: _error_at(model, n, values[n], speed) for n in names.base}
        errors = {n: e for n, e in errors.items() if np.isfinite(e) and e > 0}
        label = name if len(speeds) == 1 else f"{name} at {speed:.2f} m/s"
        points.append(Point(label, float(speed), MappingProxyType(values), MappingProxyType(errors)))
    return points


def _error_at(model: Model, name: str, value: float, speed: float) -> float:
    """Return the standard error of a base parameter at a speed: that of the speed group, else the one at u0, scaled."""
    group = model.info.get("law_parameters", {}).get(f"{name}@{speed:.3g}", {})
    if group.get("std_error") is not None:
        return float(group["std_error"])
    reference = model.values[name]
    return abs(model.std_error(name) * (value / reference if reference != 0 else 1.0))
