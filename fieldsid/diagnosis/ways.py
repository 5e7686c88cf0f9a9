"""Ways from a hypothesis to those with one effect more: which are worth going, and where each starts."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from fieldsid.diagnosis.beside import Beside
from fieldsid.diagnosis.hypothesis import Hypothesis
from fieldsid.diagnosis.trial import SETTLED, refine
from fieldsid.fitting.descent import cost_of, descend
from fieldsid.fitting.start import start_vector
from fieldsid.fitting.starts import Ground, Promise, ground_of, grown, promises_of, shared_points, shortened
from fieldsid.logs.run import BoolArray, FloatArray
from fieldsid.models.effect import Effect, Stage
from fieldsid.models.record import Record

PROMISING, PROMISING_LATER = 5, 4
"""Effects that go on from each of the two screens: the free run's own error, and the error whitened by its noise. Of
the base, and of a hypothesis with effects."""
GLIMPSE, GLIMPSE_PLAIN = 5.0, 0.02
"""Fall of the whitened sum of squares, and share of the plain one, below which the screen does not send an effect on."""
MATTERS_PLAIN = 0.05
"""Share of the plain sum of squares that a way must have taken away once it was followed: what pays takes three times that."""
MORE, FOLLOWED = 3, 4
"""Effects beyond the `most` that the free run's screen follows for some rounds: far from an effect first order says little."""
POINTS = 4
"""Scan points of an effect that are followed."""
APART = 0.1
"""Share of a run that two times of an event are apart from which on each is a way of its own."""
SHIFTS, SHIFT_ROUNDS = 3, 12
"""Shifts of time that are followed, and for how many rounds."""


@dataclass(frozen=True, slots=True)
class Way:
    """A promise, the ground it was made on, and whether output error is to follow it before it is judged."""

    promise: Promise
    ground: Ground
    plain: bool


def ways(parent: Hypothesis, left: Sequence[Effect], most: int | None, beside: Beside, *, anew: bool, flown: bool) -> list[Way]:
    """Return the ways worth going, the `most` best of two screens: the free run's error, and that whitened by its noise.

    Every way to every effect where most is None. anew: the base itself may have bent its numbers, see `_shifted`. The
    first screen is left out where its ways have been flown.
    """
    grounds = [(_whitened_ground(parent), False)] if flown else [(_free_ground(parent), True), (_whitened_ground(parent), False)]
    # both screens at once, then all that is to be followed at once: each sharing out costs a copy of the process
    asked = [(ground, effect) for ground, _ in grounds for effect in left]
    points = beside.each(lambda of: _foremost(*of), asked)
    steps: list[_Step] = []
    for i, (ground, plain) in enumerate(grounds):
        promises = sorted(points[i * len(left) : (i + 1) * len(left)], key=lambda points: points[0].cost)
        worth = GLIMPSE_PLAIN * ground.cost if plain else GLIMPSE
        kept = promises if most is None else [p for p in promises[: most + plain * MORE] if ground.cost - p[0].cost > worth]
        follows = plain and most is not None
        steps += [_Step(ground, plain, follows, partial(followed if follows else _first_shortened, ground, p)) for p in kept]
        if plain and anew:
            steps += [_Step(ground, plain, False, partial(_shifted, ground, e)) for e in left if shifts_time(e)]
    taken = list(zip(steps, beside.each(lambda step: step.take(), steps), strict=True))
    best = sorted((Way(p, s.ground, s.plain) for s, p in taken if s.follows), key=lambda way: way.promise.cost)
    found = best[:most] + [Way(p, s.ground, s.plain) for s, p in taken if not s.follows]
    return found if most is None else [w for w in found if not w.plain or w is found[0] or _matters(w)]


def _matters(way: Way) -> bool:
    """Whether a way of the free run, followed as far as it was, has come to what might be worth having."""
    return way.ground.cost - way.promise.cost > MATTERS_PLAIN * way.ground.cost


@dataclass(frozen=True, slots=True)
class _Step:
    """What is still to be done for a way: a promise that is followed for some rounds to be ranked by, or one that is kept."""

    ground: Ground
    plain: bool
    follows: bool
    take: Callable[[], Promise]


def by_effect(found: Sequence[Way]) -> list[list[Way]]:
    """Return the ways to each effect, in their order."""
    groups: dict[str, list[Way]] = {}
    for way in found:
        groups.setdefault(way.promise.effect.name, []).append(way)
    return list(groups.values())


def brought(way: Way, parent: Hypothesis, known: Hypothesis) -> bool:
    """Whether another way to the same hypothesis has brought what this one promises, its events at about the same times."""
    trial, cost = known.judged.trial, way.promise.cost
    if trial.problem.layout.names == way.promise.problem.layout.names and _apart(way.promise, trial.x):
        return False
    if way.plain:
        return cost_of(trial.problem, trial.x, way.ground.noise) < (1.0 + GLIMPSE_PLAIN) * cost
    return known.judged.likelihood - parent.judged.likelihood > 0.5 * (way.ground.cost - cost) - SETTLED


def _apart(promise: Promise, x: FloatArray) -> bool:
    """Whether an event of a run begins so far from where x has it that one does not lead to the other."""
    events = {c.name for c in promise.effect.nuisance if c.unit == "run"}
    slots = promise.problem.layout.slots
    return any(abs(a - b) > APART for s, a, b in zip(slots, promise.start, x, strict=True) if s.name in events)


def _free_ground(parent: Hypothesis) -> Ground:
    trial = parent.judged.trial
    free_run = parent.plain or refine(trial.problem, trial.x, trial.weights)
    return ground_of(free_run.problem, free_run.x, free_run.weights)


def _whitened_ground(parent: Hypothesis) -> Ground:
    trial = parent.judged.trial
    return ground_of(trial.problem, trial.x, parent.judged.noise)


def _foremost(ground: Ground, effect: Effect) -> list[Promise]:
    """Return the scan points of an effect that promise most, the best first."""
    return promises_of(ground, effect)[:POINTS]


def _first_shortened(ground: Ground, points: Sequence[Promise]) -> Promise:
    """Return the first of some scan points, its start drawn back as far as need be."""
    return shortened(ground, points[0])


def followed(ground: Ground, points: Sequence[Promise], rounds: int = FOLLOWED) -> Promise:
    """Return the best of some scan points after a few rounds of descent: only there is a promise worth what it has kept."""
    tried = []
    for point in points:
        promise = shortened(ground, point)
        found = descend(promise.problem, promise.start, ground.noise, rounds=rounds, tolerance=1e-3)
        tried.append(replace(promise, cost=found.cost, start=found.x))
    return min(tried, key=lambda p: p.cost)


def _shifted(ground: Ground, effect: Effect) -> Promise:
    """Return the promise of an effect that shifts time, the best scan points after a few rounds of descent.

    A model that misses a shift has bent all its numbers to make up for it: no first-order step sees past that, so
    the base starts anew from the measurement shifted back.
    """
    base, starts = ground.problem.layout, []
    for values in shared_points(ground, effect):
        moved = [earlier(r, next(iter(values.values()))) for r in ground.problem.records]
        x = ground.x.copy()
        x[: base.shared] = start_vector(moved, base)[: base.shared]
        problem, start = grown(ground.problem, x, effect, values)
        starts.append((cost_of(problem, start, ground.noise), problem, start))
    tried = []
    for _, problem, start in sorted(starts, key=lambda s: s[0])[:SHIFTS]:
        found = descend(problem, start, ground.noise, rounds=SHIFT_ROUNDS, tolerance=1e-3)
        tried.append(Promise(effect, found.cost, start, found.x, problem))
    return min(tried, key=lambda p: p.cost)


def earlier(record: Record, late_s: float) -> Record:
    """Return a record whose measurement is taken late_s seconds later, as if it had not been late."""
    then = record.time + late_s

    def moved(values: FloatArray, ok: BoolArray) -> FloatArray:
        return np.interp(then, record.time[ok], values[ok]) if ok.any() else values

    return replace(record, angle=moved(record.angle, record.angle_ok), rate=moved(record.rate, record.rate_ok))


def shifts_time(effect: Effect) -> bool:
    """Whether an effect moves command against measurement in time: a scanned coefficient in s outside the hull."""
    return effect.stage is not Stage.HYDRODYNAMICS and any(c.unit == "s" and c.scan for c in effect.shared)
