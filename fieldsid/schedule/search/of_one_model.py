"""Gains of one model at one speed by the design of a schedule's row, with standard errors, compared with loaded gains.

The errors of the gains are propagated from those of the model: the design is repeated one standard error to either side on each
principal axis of its covariance. Source: Julier and Uhlmann 2004, Proc. IEEE 92(3), the sigma points.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from math import sqrt
from typing import Literal

import numpy as np

from fieldsid.models.axis import NAMES
from fieldsid.models.model import Model
from fieldsid.numerics.arrays import FloatArray
from fieldsid.plant.parameter_source import source_of_models
from fieldsid.rounding import TWO_SIDED_95, number, with_error
from fieldsid.schedule.controller import Gains, margins
from fieldsid.schedule.linear_plant import FinLimits
from fieldsid.schedule.plants import Plants, models_plants
from fieldsid.schedule.record import Row, Schedule
from fieldsid.schedule.rows import DESIGN_DRAWS, SEED, place_of
from fieldsid.schedule.search.design import Sought, design_gains, row_of
from fieldsid.schedule.wish import QUICKEST, Wish, check_wish

GAINS = ("kp", "ki", "kd")


@dataclass(frozen=True, slots=True)
class Wanted:
    """The requirements of a loaded schedule: the wish, the fin limit (rad) and the stated limits of the fin.

    `answer` (s) is the common settling time of that schedule, QUICKEST without one.
    """

    wish: Wish
    fin_limit: float
    limits: FinLimits
    depth: bool = False
    answer: float = QUICKEST
    loaded: Schedule | None = None


def usual(fin_limit: float, *, by_rate: bool, limits: FinLimits | None = None, depth: bool = False) -> Wanted:
    """Return the default requirements: as quick as the fin limit (rad) allows, PD if the rate is measured (`by_rate`), else P."""
    return Wanted(Wish("pd" if by_rate else "p"), fin_limit, limits or FinLimits(), depth)


def wanted_of(loaded: Schedule) -> Wanted:
    """Return the requirements that a schedule was designed for, with the least fin limit of its rows."""
    least = min(row.fin_limit for row in loaded.rows)
    return Wanted(loaded.wish, least, loaded.stated_limits, loaded.depth, loaded.answer.settling, loaded)


@dataclass(frozen=True, slots=True)
class GainsOfOne:
    """A row for one speed, standard errors of its gains and feed-forward, and the loaded row.

    The verdict is to change the loaded gains where they lie outside the 95 % band of the new ones and their outcome by the
    objective of the design is worse (`is_worse`).
    """

    row: Row
    std_errors: Mapping[str, float]
    loaded: Row | None
    loaded_phase_margin_deg: float
    is_worse: bool

    @property
    def is_outside(self) -> bool:
        """Whether a loaded gain lies outside the band of the one designed."""
        if self.loaded is None:
            return False
        off = {n: abs(getattr(self.row.gains, n) - getattr(self.loaded.gains, n)) for n in GAINS}
        return any(off[n] > TWO_SIDED_95 * self.std_errors[n] for n in GAINS)

    @property
    def verdict(self) -> Literal["use", "keep", "change"]:
        """`use` where nothing is loaded, else `change` or `keep`."""
        return "use" if self.loaded is None else "change" if self.is_outside and self.is_worse else "keep"

    @property
    def says(self) -> str:
        """The gains with their errors, the loaded gains and the verdict, in words."""
        used = [n for n in GAINS if getattr(self.row.gains, n) != 0.0 or (self.loaded and getattr(self.loaded.gains, n) != 0.0)]
        if self.loaded is None:
            return ", ".join(f"{n} {with_error(getattr(self.row.gains, n), self.std_errors[n])}" for n in used)
        pairs = [
            f"{n} {with_error(getattr(self.row.gains, n), self.std_errors[n])} for {number(getattr(self.loaded.gains, n), 3)}"
            for n in used
        ]
        return f"{', '.join(pairs)} loaded: {self.verdict}"


def gains_of_one(model: Model, speed: float, wanted: Wanted) -> GainsOfOne:
    """Return the gains of a model at a speed in m/s; raises ModelError if none stabilise the loop, UsageError for a bad wish."""
    check_wish(wanted.wish)
    plants, sought = _designed(model, speed, wanted)
    row = row_of(sought, depth=wanted.depth, supported=plants.source.supports(speed))
    gains = np.array([[getattr(g, n) for n in GAINS] for g in _gains_at_sigma_points(model, speed, wanted)])
    gains = gains.reshape(-1, 2, len(GAINS))
    spread = np.sqrt((0.25 * (gains[:, 0] - gains[:, 1]) ** 2).sum(axis=0))
    errors = dict(zip(GAINS, spread.tolist(), strict=True)) | {"feed_forward": _forward_error(model)}
    if wanted.loaded is None:
        return GainsOfOne(row, errors, None, float("nan"), is_worse=False)
    loaded = wanted.loaded.at(speed)
    place = place_of(sought.plant, wanted.wish, wanted.fin_limit, wanted.answer)
    worse = place.outcome(loaded.gains).worse_than(place.outcome(row.gains), place.demand)
    return GainsOfOne(row, errors, loaded, margins(sought.plant, loaded.gains).worst()[0], is_worse=worse)


def _designed(model: Model, speed: float, wanted: Wanted) -> tuple[Plants, Sought]:
    source = source_of_models([model], [model.method])
    plants = models_plants(source, wanted.limits, ())
    plant = plants.at(speed, wanted.fin_limit, DESIGN_DRAWS, SEED)
    return plants, design_gains(plant, wanted.wish, wanted.fin_limit, wanted.answer)


def _gains_at_sigma_points(model: Model, speed: float, wanted: Wanted) -> Iterator[Gains]:
    """Yield the gains at both ends of each principal axis of the covariance without the trim, which no gain depends on."""
    names = [n for n in model.free if n != NAMES[model.axis].trim]
    at = [model.free.index(n) for n in names]
    sizes, axes = np.linalg.eigh(model.covariance[np.ix_(at, at)])
    for size, axis in zip(sizes, axes.T, strict=True):
        for sign in (1.0, -1.0):
            step = sign * sqrt(max(float(size), 0.0)) * axis
            shifted = {n: model.values[n] + float(d) for n, d in zip(names, step, strict=True)}
            yield _designed(replace(model, values={**model.values, **shifted}), speed, wanted)[1].found.gains


def _forward_error(model: Model) -> float:
    """Return the standard error (rad) of the feed-forward -C/b."""
    names = NAMES[model.axis]
    b, trim = model.values[names.authority], model.values[names.trim]
    gradient: FloatArray = np.zeros(len(model.free))
    gradient[model.free.index(names.authority)], gradient[model.free.index(names.trim)] = trim / b**2, -1.0 / b
    return sqrt(max(float(gradient @ model.covariance @ gradient), 0.0))
