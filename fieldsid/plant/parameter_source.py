"""The source of parameters at a speed: identified models, a table of points, or fitted laws; with draws from their errors."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from fieldsid.display import Brief
from fieldsid.dynamics.free_run import effects_of
from fieldsid.errors import DataError, UsageError
from fieldsid.logs.run import Note, Run
from fieldsid.logs.wrong_file import unless_log
from fieldsid.models.axis import NAMES, Axis
from fieldsid.models.model import Model, load_model
from fieldsid.models.record import knows_speed
from fieldsid.models.speed_law import TRIM_OF_FIN, SpeedLaw
from fieldsid.numerics.arrays import FloatArray
from fieldsid.plant.laws.axis_laws import KIND as FIT_KIND
from fieldsid.plant.laws.axis_laws import Laws, carried_models, fit_laws, load_laws, refuse_single_speed, with_own_law
from fieldsid.plant.laws.parameter_law import ParameterLaw
from fieldsid.plant.points import (
    EQUAL_SPEED_SHARE,
    Point,
    check_authority,
    distinct_speeds,
    intended_speeds,
    places_of_one_sign,
    points_of,
)
from fieldsid.plant.table import read_table
from fieldsid.plant.yaw_plant import EXPONENT
from fieldsid.records.named_inputs import mapping_in, where_now
from fieldsid.records.reading import read_yaml
from fieldsid.rounding import nine_digits

MAX_PROPOSALS = 40
LEAST_SHARE = 0.05
"""Damping and authority of a draw have the sign of the estimate, and at least this share of its size."""
TABLE_SUFFIXES = (".csv", ".txt", ".tsv")


@dataclass(frozen=True, slots=True, repr=False)
class ParameterSource(Brief):
    """Points of one axis in order of speed, the models that they came from (none for a table), and laws if there are two speeds.

    A fit file contains its models, and its laws are those of the file. `own_laws` names the parameters whose law the user gave.
    `runs_flown` is the range of speeds in the runs. `left_out` names models whose authority has another sign than the others' at
    a speed where it is not significant; their `paths` come after those of the models.
    """

    axis: Axis
    points: tuple[Point, ...]
    models: tuple[Model, ...]
    names: tuple[str, ...]
    laws: Laws | None
    paths: tuple[Path, ...]
    own_laws: tuple[str, ...] = ()
    runs_flown: tuple[float, float] | None = None
    is_fit_file: bool = False
    left_out: tuple[str, ...] = ()

    @property
    def speeds(self) -> FloatArray:
        """Speeds of the points, (n,) m/s, rising."""
        return np.sort(np.array([p.speed for p in self.points]))

    @property
    def knots(self) -> list[float]:
        """The speeds (m/s) that results are for by default: those of a table, or the intended speeds of the models' runs."""
        return intended_speeds(self.speeds) if self.models else list(dict.fromkeys(self.speeds.tolist()))

    @property
    def largest_fin(self) -> float:
        """The largest fin in the models' runs, rad; 0 where there is no model."""
        return max((m.trained.get("fin_max", 0.0) for m in self.models), default=0.0)

    @property
    def notes(self) -> tuple[Note, ...]:
        """A note on the models that are left out, if there are any."""
        if not self.left_out:
            return ()
        words = f"the sign of its {NAMES[self.axis].authority} is not known at a speed, and another than the fin's: left out"
        return (Note("model_left_out", f"{', '.join(self.left_out)}: {words}", {"models": list(self.left_out)}),)

    def fitted(self, *, weighted: bool = True) -> Laws:
        """Return the laws of the points, with the note on models that are left out.

        Raises DataError as `fit_laws` does, and where the authority is known at one speed only.
        """
        laws = fit_laws(self.axis, self.points, weighted=weighted)
        refuse_single_speed(self.axis, [p for p in self.points if NAMES[self.axis].authority in p.values])
        return replace(laws, notes=(*laws.notes, *self.notes))

    def supports(self, speed: float) -> bool:
        """Whether a speed (m/s) lies within the range of the data."""
        low, high = float(self.speeds[0]), float(self.speeds[-1])
        for model in self.models:
            low = min(low, model.trained.get("speed_low", low))
            high = max(high, model.trained.get("speed_high", high))
        if self.runs_flown is not None:
            low, high = min(low, self.runs_flown[0]), max(high, self.runs_flown[1])
        return low * (1 - EQUAL_SPEED_SHARE) <= speed <= high * (1 + EQUAL_SPEED_SHARE)

    def with_speeds_of(self, runs: Sequence[Run]) -> ParameterSource:
        """Return the source with the range of speeds of its runs: the entry speed of a turn is above the median of its run."""
        surges = [r["surge_m_s"] for r in runs if knows_speed(r)]
        if not surges:
            return self
        spans = np.array([np.nanpercentile(s, [2.0, 98.0]) for s in surges])
        return replace(self, runs_flown=(float(spans[:, 0].min()), float(spans[:, 1].max())))

    def near(self, speed: float) -> list[tuple[int, float]]:
        """Return the indices of the models next to a speed with their weights, which are linear in log speed and sum to one.

        Models of the same speed have equal weights.
        """
        known = np.array([nine_digits(m.law.reference) for m in self.models])
        if known.size == 1 or not np.isfinite(known).all():
            return [(0, 1.0)]
        speeds, of_model = np.unique(known, return_inverse=True)
        place = float(np.interp(np.log(speed), np.log(speeds), np.arange(speeds.size)))
        below = int(np.floor(place))
        share = place - below
        weights = {below: 1.0} if share < 1e-9 or below + 1 >= speeds.size else {below: 1.0 - share, below + 1: share}
        return [
            (int(i), w / np.count_nonzero(of_model == at)) for at, w in weights.items() for i in np.flatnonzero(of_model == at)
        ]

    def base_at(self, speed: float) -> dict[str, float]:
        """Return the base parameters at a speed: of a law that the user gave, else of a point at that speed, else of the laws.

        Without laws the single point is scaled as lift: damping ~ u, authority and the trim moment of a fin offset ~ u^2.
        """
        point = self._point_at(speed)
        if self.laws is None:
            return self._scaled(point or self.points[0], speed)
        laws = self.laws.at(speed)
        of_point = {} if point is None else self._scaled(point, speed)
        return {**laws, **of_point, **{n: laws[n] for n in self.own_laws}}

    def require(self, speeds: Sequence[float]) -> None:
        """Raise DataError where damping or authority is not known, or the authority is zero, at one of the speeds (m/s)."""
        names = NAMES[self.axis]
        for speed in speeds:
            known = self.base_at(speed)
            missing = [n for n in (names.damping, names.authority) if n not in known]
            if not missing and known[names.authority] == 0.0:
                raise DataError(
                    f"`{names.authority}` is zero at {speed:.3g} m/s",
                    found="a fin that turns nothing",
                    hint="mend it, or leave it out",
                )
            if missing:
                raise DataError(
                    f"`{missing[0]}` is not known at {speed:.3g} m/s",
                    found=", ".join(f"{n} = {v:.4g}" for n, v in known.items()),
                    hint=f"give `{missing[0]}` at that speed, or at two others to draw a law through",
                )

    def base_std_at(self, speed: float) -> dict[str, float]:
        """Return standard errors of the base parameters at a speed: of a point there, else prediction errors of the laws."""
        point = self._point_at(speed)
        of_point = {} if point is None else dict(point.std_errors)
        if self.laws is None:
            return of_point or dict(self.points[0].std_errors)
        return {**{n: _prediction_error(law, speed) for n, law in self.laws.by_name.items()}, **of_point}

    def centred_at(self, speed: float) -> dict[str, float]:
        """Return the base parameters at a speed that come from laws and replace those of the models.

        These are the parameters of the user's laws. Beyond the speeds of the points also those of a fit file: the value at the
        last point plus the change of the law from there.
        """
        if self.laws is None:
            return {}
        at = self.laws.at(speed)
        own = {n: at[n] for n in self.own_laws}
        edge = float(np.clip(speed, self.speeds[0], self.speeds[-1]))
        if not self.is_fit_file or abs(edge - speed) <= EQUAL_SPEED_SHARE * speed:
            return own
        last, law_at_edge = self.base_at(edge), self.laws.at(edge)
        return {n: last[n] + at[n] - law_at_edge[n] for n in at} | own

    def _point_at(self, speed: float) -> Point | None:
        """Return the point at a speed to within EQUAL_SPEED_SHARE, None where there is none."""
        nearest = min(self.points, key=lambda p: abs(nine_digits(p.speed) - nine_digits(speed)))
        return nearest if abs(nearest.speed - speed) <= EQUAL_SPEED_SHARE * speed else None

    def _scaled(self, point: Point, speed: float) -> dict[str, float]:
        law, names = SpeedLaw(point.speed, trim_of_fin=TRIM_OF_FIN[self.axis]), NAMES[self.axis]
        out = dict(point.values)
        if names.authority in out:
            out[names.authority] = law.authority(speed, out[names.authority])
        if names.damping in out:
            out[names.damping] *= law.damping_factor(speed)
        if names.trim in out:
            out[names.trim] *= law.trim_factor(speed)
        return out

    def base_draws(self, speed: float, count: int, rng: np.random.Generator) -> dict[str, FloatArray]:
        """Return draws (count,) of the base parameters at a speed; the first is the estimate."""
        return self._base_drawn(speed, count, rng)[0]

    def share_rejected(self, speed: float, count: int, seed: int) -> float:
        """Return the share of the draws at a speed that are rejected as unphysical, the largest over the models."""
        if not self.models:
            return self._base_drawn(speed, count, np.random.default_rng(seed))[1]
        near = [(self.models[i], np.random.default_rng(seed + i)) for i, _ in self.near(speed)]
        return max(_drawn_inside(model, count, rng)[1] for model, rng in near)

    def _base_drawn(self, speed: float, count: int, rng: np.random.Generator) -> tuple[dict[str, FloatArray], float]:
        """Return the draws, and the share that was rejected for the sign of damping or authority and drawn again."""
        values, spread, names = self.base_at(speed), self.base_std_at(speed), NAMES[self.axis]
        centre = np.array([values.get(n, 0.0) for n in names.base])
        signed = [names.base.index(n) for n in (names.damping, names.authority)]
        width = np.array([spread.get(n, 0.0) for n in names.base])
        z = np.array([rng.standard_normal(count) for _ in names.base])
        z[:, 0] = 0.0
        rejected = 0
        for _ in range(MAX_PROPOSALS):
            drawn = centre[:, None] + width[:, None] * z
            least = LEAST_SHARE * np.abs(centre[signed])
            outside = np.any(drawn[signed] * np.sign(centre[signed])[:, None] < least[:, None], axis=0)
            repeated = int(outside.sum())
            rejected += repeated
            if repeated == 0:
                break
            z[:, outside] = rng.standard_normal((len(names.base), repeated))
        else:
            z[:, outside] = 0.0
        return {n: centre[i] + width[i] * z[i] for i, n in enumerate(names.base)}, rejected / (count + rejected)


def _prediction_error(law: ParameterLaw, speed: float) -> float:
    """Return the prediction error of a law at a speed: its standard error and that of a new point, stated or by scatter."""
    line = law.line
    law_error = float(np.nan_to_num(line.std(speed)[0]))
    if law.std_errors is not None:
        return float(np.hypot(law_error, np.interp(speed, law.speeds, law.std_errors)))
    scatter = line.rms * np.sqrt(law.values.size / line.dof) if line.dof > 0 else 0.0
    return float(np.hypot(law_error, scatter))


def load_parameter_source(paths: Sequence[Path], *, laws: Sequence[str] = ()) -> ParameterSource:
    """Return the source of the parameters in files: one table, one fit file, or models; `laws` are the user's, `NAME=c0[,c1]`.

    Raises UsageError for a mix of kinds, DataError or ArtifactError for a file that cannot be used.
    """
    if not paths:
        raise UsageError("nothing to work on", found="no file", hint="give model files, a fit file, or a table with speed_m_s")
    tables = [p for p in paths if str(p) == "-" or p.suffix.lower() in TABLE_SUFFIXES]
    if tables and len(paths) > 1:
        raise UsageError(
            "a table stands alone", found=", ".join(map(str, paths)), hint=f"give `{tables[0]}` only, or models only"
        )
    if tables:
        axis, points = read_table(paths[0])
        return _with_laws(axis, points, (), (), paths, laws)
    bodies = []
    for path in paths:
        with unless_log(path, "a model or a table of parameters over speed"):
            bodies.append(read_yaml(path))
    if any(_is_fit(b) for b in bodies):
        if len(paths) > 1:
            raise UsageError(
                "a fit file stands alone", found=", ".join(map(str, paths)), hint="give the fit file only, or models only"
            )
        return source_of_laws(load_laws(paths[0]), carried_models(paths[0]), laws=laws, paths=paths)
    return source_of_models([load_model(p) for p in paths], [p.stem for p in paths], laws=laws, paths=paths)


def source_of_models(
    models: Sequence[Model], names: Sequence[str], *, laws: Sequence[str] = (), paths: Sequence[Path] = ()
) -> ParameterSource:
    """Return the source of models with their names; the models are sorted by speed and name.

    Raises UsageError and DataError as `load_parameter_source` does.
    """
    if not models:
        raise UsageError("nothing to work on", found="no model", hint="give models, or the files of models")
    # the place of a model is the seed of its draws: the order in which a shell lists the files must not change a gain
    order = sorted(range(len(models)), key=lambda i: (nine_digits(models[i].law.reference), names[i]))
    models, names = [models[i] for i in order], [names[i] for i in order]
    paths = [paths[i] for i in order] if len(paths) == len(order) else paths
    axis, points = points_of(models, names)
    used = places_of_one_sign(axis, models, points)
    dropped = [i for i in range(len(models)) if i not in used]
    used_points = [p for i in used for p in points[i]]
    ordered = [paths[i] for i in (*used, *dropped)] if len(paths) == len(models) else paths
    source = _with_laws(axis, used_points, tuple(models[i] for i in used), tuple(names[i] for i in used), ordered, laws)
    return replace(source, left_out=tuple(names[i] for i in dropped))


def source_of_laws(
    found: Laws, carried: Sequence[tuple[str, Model]] = (), *, laws: Sequence[str] = (), paths: Sequence[Path] = ()
) -> ParameterSource:
    """Return the source of fitted laws and their models, with the user's `laws` in place of those fitted; raises UsageError."""
    for text in laws:
        found = with_own_law(found, text)
    own = tuple(t.partition("=")[0] for t in laws)
    names, models = [n for n, _ in carried], [m for _, m in carried]
    used = places_of_one_sign(found.axis, models, points_of(models, names)[1]) if carried else []
    return ParameterSource(
        found.axis, found.points, tuple(models[i] for i in used), tuple(names[i] for i in used), found, tuple(paths), own,
        is_fit_file=True, left_out=tuple(n for i, n in enumerate(names) if i not in used),
    )  # fmt: skip


def draw_values(model: Model, count: int, rng: np.random.Generator) -> tuple[list[dict[str, float]], FloatArray]:
    """Return draws of a model's values from its covariance, the first the estimate, and of its damping exponent (count,).

    A draw outside the bounds of the effects, or with another sign of damping or authority, is rejected: no value is moved to a
    bound. Where `MAX_PROPOSALS` times as many proposals give fewer than `count` draws, the draws are repeated.
    """
    rows, _ = _drawn_inside(model, count - 1, rng)
    estimate = dict(model.values)
    draws = [estimate, *(estimate | dict(zip(model.free, map(float, row), strict=True)) for row in rows)]
    if EXPONENT in model.free:
        return draws, np.array([d[EXPONENT] for d in draws])
    exponent = np.full(count, model.law.damping_exponent)
    stated = model.info.get("law_parameters", {}).get(EXPONENT, {})
    spread = stated.get("std_error") or 0.0
    exponent[1:] += float(spread) * rng.standard_normal(count - 1)
    return draws, exponent


def _drawn_inside(model: Model, count: int, rng: np.random.Generator) -> tuple[FloatArray, float]:
    """Return draws (count, p) of a model's free values within their bounds, and the share of proposals that was rejected."""
    covariance = np.nan_to_num(np.asarray(model.covariance))
    size = len(model.free)
    values, vectors = np.linalg.eigh(0.5 * (covariance + covariance.T)) if size else (np.zeros(0), np.zeros((0, 0)))
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    estimate = np.array([model.values[n] for n in model.free])
    bounds = _bounds(model)
    low, high = np.array([bounds.get(n, (-np.inf, np.inf)) for n in model.free]).reshape(size, 2).T
    accepted, proposed = np.empty((0, size)), 0
    for _ in range(MAX_PROPOSALS):
        drawn = estimate + rng.standard_normal((count + 1, size)) @ root.T
        proposed += drawn.shape[0]
        accepted = np.concatenate([accepted, drawn[np.all((drawn >= low) & (drawn <= high), axis=1)]])
        if accepted.shape[0] >= count:
            break
    rejected = 1.0 - accepted.shape[0] / proposed
    if accepted.shape[0] == 0:
        accepted = estimate[None, :]
    return accepted[np.arange(count) % accepted.shape[0]], rejected


def _bounds(model: Model) -> dict[str, tuple[float, float]]:
    names = NAMES[model.axis]
    bounds = {c.name: (c.low, c.high) for e in effects_of(model) for c in e.shared}
    for name in (names.damping, names.authority):
        value = model.values[name]
        bounds[name] = (LEAST_SHARE * value, np.inf) if value > 0 else (-np.inf, LEAST_SHARE * value)
    return bounds


def _is_fit(body: Mapping[str, Any]) -> bool:
    return str(body.get("schema", "")).startswith(f"{FIT_KIND}/")


class NamedLog(NamedTuple):
    """A log that a model was fitted to: its path in the model's file, its present path, and the mapping it was read with."""

    named: str
    now: Path | None
    mapping: Path | None = None


def logs_of(paths: Sequence[Path]) -> tuple[NamedLog, ...]:
    """Return the logs that the models in files, or in a fit file, were fitted to."""
    bodies = [(p, read_yaml(p)) for p in paths]
    records = [(p, r) for p, b in bodies for r in ([m["record"] for m in b["models"]] if _is_fit(b) else [b])]
    named = (NamedLog(str(i["path"]), where_now(i, p), mapping_in(r, p)) for p, r in records for i in r.get("inputs") or ())
    return tuple({log[:2]: log for log in named}.values())


def _with_laws(
    axis: Axis,
    points: Sequence[Point],
    models: tuple[Model, ...],
    names: tuple[str, ...],
    paths: Sequence[Path],
    own: Sequence[str],
) -> ParameterSource:
    check_authority(axis, points)
    ordered = tuple(sorted(points, key=lambda p: nine_digits(p.speed)))
    laws = fit_laws(axis, ordered) if distinct_speeds(np.array([p.speed for p in ordered])) > 1 else None
    if own:
        if laws is None:
            raise UsageError("`--law` needs points at two speeds or more", found=f"{len(points)} point", hint="leave `--law` out")
        for text in own:
            laws = with_own_law(laws, text)
    return ParameterSource(axis, ordered, models, names, laws, tuple(paths), tuple(t.partition("=")[0] for t in own))
