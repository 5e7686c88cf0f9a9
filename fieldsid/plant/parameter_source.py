"""Where parameters at a speed come from: identified models, a table of points, or fitted laws; with draws of their errors."""

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
from fieldsid.plant.laws.axis_laws import Laws, carried_models, fit_laws, load_laws, with_own_law
from fieldsid.plant.laws.parameter_law import ParameterLaw
from fieldsid.plant.points import (
    EQUAL_SPEED_SHARE,
    Point,
    check_authority,
    distinct_speeds,
    meant_speeds,
    of_known_sign,
    points_of,
)
from fieldsid.plant.table import read_table
from fieldsid.plant.yaw_plant import EXPONENT
from fieldsid.records.named_inputs import mapping_in, where_now
from fieldsid.records.reading import read_yaml
from fieldsid.rounding import nine_digits

MAX_PROPOSALS = 40
LEAST_SHARE = 0.05
"""A draw keeps the sign of damping and authority, and this share of the estimate: no plant turns the other way."""
TABLE_SUFFIXES = (".csv", ".txt", ".tsv")


@dataclass(frozen=True, slots=True, repr=False)
class ParameterSource(Brief):
    """Points of one axis at rising speeds; the models they came from (none for a table); laws where two speeds allow them.

    A fit file carries its models, and its laws are those of the file. `left_out` are models that have the
    authority with another sign than the rest at a speed where its sign is not known; their `paths` follow the models' own.
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
        """Speeds (m/s) at which something is said where none is asked for: a table's, or those that runs were to be flown at."""
        return meant_speeds(self.speeds) if self.models else list(dict.fromkeys(self.speeds.tolist()))

    @property
    def largest_fin(self) -> float:
        """The largest fin in the models' runs, rad; 0 where there is no model."""
        return max((m.trained.get("fin_max", 0.0) for m in self.models), default=0.0)

    @property
    def notes(self) -> tuple[Note, ...]:
        """What is said of models that are left out."""
        if not self.left_out:
            return ()
        words = f"the sign of its {NAMES[self.axis].authority} is not known at a speed, and another than the fin's: left out"
        return (Note("model_left_out", f"{', '.join(self.left_out)}: {words}", {"models": list(self.left_out)}),)

    def fitted(self, *, weighted: bool = True) -> Laws:
        """Return the laws of the points, with what is said of models that are left out; raises DataError as `fit_laws` does."""
        found = fit_laws(self.axis, self.points, weighted=weighted)
        return replace(found, notes=(*found.notes, *self.notes))

    def supports(self, speed: float) -> bool:
        """Whether a speed lies within those the data were taken at."""
        low, high = float(self.speeds[0]), float(self.speeds[-1])
        for model in self.models:
            low = min(low, model.trained.get("speed_low", low))
            high = max(high, model.trained.get("speed_high", high))
        if self.runs_flown is not None:
            low, high = min(low, self.runs_flown[0]), max(high, self.runs_flown[1])
        return low * (1 - EQUAL_SPEED_SHARE) <= speed <= high * (1 + EQUAL_SPEED_SHARE)

    def models_flown_by(self, runs: Sequence[Run]) -> ParameterSource:
        """Return the source knowing the speeds its runs really had: the entry speed of a turn is above a run's median."""
        surges = [r["surge_m_s"] for r in runs if knows_speed(r)]
        if not surges:
            return self
        spans = np.array([np.nanpercentile(s, [2.0, 98.0]) for s in surges])
        return replace(self, runs_flown=(float(spans[:, 0].min()), float(spans[:, 1].max())))

    def near(self, speed: float) -> list[tuple[int, float]]:
        """Return the models next to a speed with weights that sum to one, linear in log speed, alike for models of one speed."""
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
        """Return the base parameters at a speed: the point's own where one is there and no law of the user's overrides it.

        Else the laws', or the single point's scaled as lift: damping with u, authority and a fin's offset with u^2.
        """
        here = self._point_at(speed)
        if self.laws is None:
            return self._scaled(here or self.points[0], speed)
        laws = self.laws.at(speed)
        own = {} if here is None else self._scaled(here, speed)
        return {**laws, **own, **{n: laws[n] for n in self.own_laws}}

    def require(self, speeds: Sequence[float]) -> None:
        """Raise DataError where damping or authority is not known at one of some speeds (m/s): there is no plant without them."""
        names = NAMES[self.axis]
        for speed in speeds:
            known = self.base_at(speed)
            lacking = [n for n in (names.damping, names.authority) if n not in known]
            if not lacking and known[names.authority] == 0.0:
                raise DataError(
                    f"`{names.authority}` is zero at {speed:.3g} m/s",
                    found="a fin that turns nothing",
                    hint="mend it, or leave it out",
                )
            if lacking:
                raise DataError(
                    f"`{lacking[0]}` is not known at {speed:.3g} m/s",
                    found=", ".join(f"{n} = {v:.4g}" for n, v in known.items()),
                    hint=f"give `{lacking[0]}` at that speed, or at two others to draw a law through",
                )

    def base_std_at(self, speed: float) -> dict[str, float]:
        """Return standard errors of the base parameters at a speed: the point's own, else the law's with the points' scatter."""
        here = self._point_at(speed)
        own = {} if here is None else dict(here.std_errors)
        if self.laws is None:
            return own or dict(self.points[0].std_errors)
        return {**{n: _spread(law, speed) for n, law in self.laws.by_name.items()}, **own}

    def centred_at(self, speed: float) -> dict[str, float]:
        """Return the base parameters at a speed that laws say and models do not: the user's own laws, everywhere.

        Beyond the speeds of the points a fit file's laws say how they go on from the last of them.
        """
        if self.laws is None:
            return {}
        at = self.laws.at(speed)
        own = {n: at[n] for n in self.own_laws}
        edge = float(np.clip(speed, self.speeds[0], self.speeds[-1]))
        if not self.is_fit_file or abs(edge - speed) <= EQUAL_SPEED_SHARE * speed:
            return own
        last, there = self.base_at(edge), self.laws.at(edge)
        return {n: last[n] + at[n] - there[n] for n in at} | own

    def _point_at(self, speed: float) -> Point | None:
        """Return the point whose speed counts as the same, None where there is none."""
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
        """Return draws (count,) of the base parameters at a speed, the first the estimate."""
        return self._base_drawn(speed, count, rng)[0]

    def share_rejected(self, speed: float, count: int, seed: int) -> float:
        """Return the share of the draws at a speed that are rejected as outside what is physical, of the model where most are."""
        if not self.models:
            return self._base_drawn(speed, count, np.random.default_rng(seed))[1]
        near = [(self.models[i], np.random.default_rng(seed + i)) for i, _ in self.near(speed)]
        return max(_drawn_inside(model, count, rng)[1] for model, rng in near)

    def _base_drawn(self, speed: float, count: int, rng: np.random.Generator) -> tuple[dict[str, FloatArray], float]:
        """Return the draws and the share that was rejected for a damping or an authority of the other sign, and drawn anew."""
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
            again = int(outside.sum())
            rejected += again
            if again == 0:
                break
            z[:, outside] = rng.standard_normal((len(names.base), again))
        else:
            z[:, outside] = 0.0
        return {n: centre[i] + width[i] * z[i] for i, n in enumerate(names.base)}, rejected / (count + rejected)


def _spread(law: ParameterLaw, speed: float) -> float:
    """Return the error of a law at a speed: its own, and that of one more point (its stated error, or the others' scatter)."""
    line = law.line
    width = float(np.nan_to_num(line.std(speed)[0]))
    if law.std_errors is not None:
        return float(np.hypot(width, np.interp(speed, law.speeds, law.std_errors)))
    scatter = line.rms * np.sqrt(law.values.size / line.dof) if line.dof > 0 else 0.0
    return float(np.hypot(width, scatter))


def load_parameter_source(paths: Sequence[Path], *, laws: Sequence[str] = ()) -> ParameterSource:
    """Return the source that files give: one table, one fit file, or models; `laws` are the user's own, `NAME=c0[,c1]`.

    Raises UsageError for a mix of kinds, DataError and ArtifactError as the files deserve.
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
    """Return the source of models with a name each, by speed and name, in whatever order they are given.

    Raises UsageError and DataError as `load_parameter_source` does.
    """
    if not models:
        raise UsageError("nothing to work on", found="no model", hint="give models, or the files of models")
    # each model's draws come of its own seed, its place: a shell that lists files otherwise changes no gain
    order = sorted(range(len(models)), key=lambda i: (nine_digits(models[i].law.reference), names[i]))
    models, names = [models[i] for i in order], [names[i] for i in order]
    paths = [paths[i] for i in order] if len(paths) == len(order) else paths
    axis, points = points_of(models, names)
    kept = of_known_sign(axis, models, points)
    dropped = [i for i in range(len(models)) if i not in kept]
    taken = [p for i in kept for p in points[i]]
    ordered = [paths[i] for i in (*kept, *dropped)] if len(paths) == len(models) else paths
    source = _with_laws(axis, taken, tuple(models[i] for i in kept), tuple(names[i] for i in kept), ordered, laws)
    return replace(source, left_out=tuple(names[i] for i in dropped))


def source_of_laws(
    found: Laws, carried: Sequence[tuple[str, Model]] = (), *, laws: Sequence[str] = (), paths: Sequence[Path] = ()
) -> ParameterSource:
    """Return the source of fitted laws and the models they carry, the user's own laws in place of theirs; raises UsageError."""
    for text in laws:
        found = with_own_law(found, text)
    own = tuple(t.partition("=")[0] for t in laws)
    names, models = [n for n, _ in carried], [m for _, m in carried]
    kept = of_known_sign(found.axis, models, points_of(models, names)[1]) if carried else []
    return ParameterSource(
        found.axis, found.points, tuple(models[i] for i in kept), tuple(names[i] for i in kept), found, tuple(paths), own,
        is_fit_file=True, left_out=tuple(n for i, n in enumerate(names) if i not in kept),
    )  # fmt: skip


def draw_values(model: Model, count: int, rng: np.random.Generator) -> tuple[list[dict[str, float]], FloatArray]:
    """Return draws of a model's values from its covariance, the first the estimate, and of its damping exponent (count,).

    A draw outside the bounds that the effects declare, or with a damping or an authority of the other sign, is rejected as a
    whole: no value is moved to its bound. Where `MAX_PROPOSALS` times as many leave fewer than `count`, these come again.
    """
    taken, _ = _drawn_inside(model, count - 1, rng)
    own = dict(model.values)
    draws = [own, *(own | dict(zip(model.free, map(float, row), strict=True)) for row in taken)]
    if EXPONENT in model.free:
        return draws, np.array([d[EXPONENT] for d in draws])
    exponent = np.full(count, model.law.damping_exponent)
    stated = model.info.get("law_parameters", {}).get(EXPONENT, {})
    spread = stated.get("std_error") or 0.0
    exponent[1:] += float(spread) * rng.standard_normal(count - 1)
    return draws, exponent


def _drawn_inside(model: Model, count: int, rng: np.random.Generator) -> tuple[FloatArray, float]:
    """Return draws (count, p) of a model's free values inside the bounds, and the share of the proposals that was rejected."""
    covariance = np.nan_to_num(np.asarray(model.covariance))
    size = len(model.free)
    values, vectors = np.linalg.eigh(0.5 * (covariance + covariance.T)) if size else (np.zeros(0), np.zeros((0, 0)))
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    estimate = np.array([model.values[n] for n in model.free])
    bounds = _bounds(model)
    low, high = np.array([bounds.get(n, (-np.inf, np.inf)) for n in model.free]).reshape(size, 2).T
    kept, proposed = np.empty((0, size)), 0
    for _ in range(MAX_PROPOSALS):
        drawn = estimate + rng.standard_normal((count + 1, size)) @ root.T
        proposed += drawn.shape[0]
        kept = np.concatenate([kept, drawn[np.all((drawn >= low) & (drawn <= high), axis=1)]])
        if kept.shape[0] >= count:
            break
    rejected = 1.0 - kept.shape[0] / proposed
    if kept.shape[0] == 0:
        kept = estimate[None, :]
    return kept[np.arange(count) % kept.shape[0]], rejected


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
    """A log that a model names as what it was made from: its path then, where it is now, and the mapping it was read with."""

    named: str
    now: Path | None
    mapping: Path | None = None


def logs_of(paths: Sequence[Path]) -> tuple[NamedLog, ...]:
    """Return the logs that model files, or a fit file's models, name as what they were made from."""
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
