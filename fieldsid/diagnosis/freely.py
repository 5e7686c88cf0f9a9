"""The search by the free run alone, for logs that show next to no noise: of a towing tank, or filtered before logging.

A likelihood compares hypotheses by how much disturbance each still needs. Where what is left moves with the fin or the
motion it is no disturbance, and without noise to drown it the smallest inconsistency of the sensors weighs more than all
that the hull does: the most likely hypothesis is not the one that predicts. Then effects are added as long as each lets
output error predict unseen runs by a twentieth better.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from fieldsid.diagnosis.hypothesis import Hypothesis, bare_model, flown_by, hypothesis_of, training_errors, unseen_errors
from fieldsid.diagnosis.records import Pair
from fieldsid.diagnosis.search import Search
from fieldsid.diagnosis.trial import Trial, judge, refine
from fieldsid.fitting.start import start_vector
from fieldsid.fitting.starts import Promise, carried, ground_of, promise_of, shortened
from fieldsid.models.effect import Effect

TRIED, FRONT, LARGEST = 5, 2, 3
ROUNDS, FINE = 200, 1e-7
"""Rounds of each free run, and the share of its sum of squares a round must gain: the valleys are long."""
BETTER = 0.95
"""Share that the error must fall to with every effect."""


@dataclass(frozen=True, slots=True)
class FreeRun:
    """A free run of output error, its errors, and the share of the base's error it falls to."""

    trial: Trial
    errors: Pair
    fall: float


def freely(search: Search) -> Hypothesis | None:
    """Return the hypothesis that the free run on unseen runs leads to, None where no effect makes it better.

    The best two of every size are grown: the first step down need not be the one the valley is reached by. What is found
    without one of its effects is left among what the search has tried.
    """
    base = search.base()
    best = start = FreeRun(base.shown, base.errors, 1.0)
    front, seen = [start], dict[frozenset[str], FreeRun]()
    for _ in range(LARGEST):
        grown: dict[frozenset[str], FreeRun] = {}
        for current in front:
            for new in _tried(search, current.trial):
                _keep(seen, new)
                if _fall(new.errors, current.errors) <= BETTER:
                    _keep(grown, new)
        front = sorted(grown.values(), key=lambda f: f.fall)[:FRONT]
        if not front or front[0].fall > BETTER * best.fall:
            break
        best = front[0]
    if best is start:
        return None
    best, without = _thinned(search, best, seen)
    found, *less = search.beside.each(partial(_hypothesis, search), [best.trial, *(w.trial for w in without)])
    search.tried |= {frozenset(h.names): h for h in (found, *less)}
    return found


def _keep(known: dict[frozenset[str], FreeRun], new: FreeRun) -> None:
    """Keep a free run where none of the same effects is better."""
    key = frozenset(new.trial.names)
    if key not in known or new.fall < known[key].fall:
        known[key] = new


def _thinned(search: Search, best: FreeRun, seen: dict[frozenset[str], FreeRun]) -> tuple[FreeRun, list[FreeRun]]:
    """Return a free run less the effects that the others have made idle, and what it is without each that is left."""
    while True:
        effects = [e for e in best.trial.effects if e.name not in search.known]
        if len(effects) < 2:
            return best, []
        for new in search.beside.each(partial(_without, search, best.trial), effects):
            _keep(seen, new)
        less = [seen[frozenset(best.trial.names) - {e.name}] for e in effects]
        idle = min(less, key=lambda f: f.fall)
        if best.fall <= BETTER * idle.fall:
            return best, less
        best = idle


def _without(search: Search, trial: Trial, gone: Effect) -> FreeRun:
    problem = trial.problem.with_effects([e for e in trial.effects if e is not gone])
    x = carried(trial.problem.layout, trial.x, problem.layout)
    return _flown(search, refine(problem, x, trial.weights, ROUNDS, FINE))


def _hypothesis(search: Search, trial: Trial) -> Hypothesis:
    judged = judge(trial.problem, trial.x, search.base().judged.noise, search.told, search.family)
    return replace(hypothesis_of(judged, search.validation), plain=trial)


def _flown(search: Search, trial: Trial) -> FreeRun:
    base = search.base()
    flown = flown_by(bare_model(trial.problem, trial.x, base.judged.noise), trial, search.validation)
    errors = Pair(training_errors(trial), unseen_errors(flown, search.validation))
    return FreeRun(trial, errors, _fall(errors, base.errors))


def _tried(search: Search, current: Trial) -> list[FreeRun]:
    """Return the most promising effects' free runs, each from the screen's start and from its declared one."""
    ground = ground_of(current.problem, current.x, current.weights)
    left = [e for e in search.catalogue if e.name not in current.names]
    promises = sorted(search.beside.each(partial(promise_of, ground), left), key=lambda p: p.cost)

    def followed(promise: Promise) -> FreeRun:
        search.report("+".join((*current.names, promise.effect.name)))
        screened = refine(promise.problem, shortened(ground, promise).start, current.weights, ROUNDS, FINE)
        return _flown(search, min((screened, _declared(promise, current)), key=lambda t: t.weights.angle * t.weights.rate))

    return search.beside.each(followed, promises[:TRIED])


def _declared(promise: Promise, current: Trial) -> Trial:
    """Return the free run from the textbook's model and the effects' declared values: the base may have bent its numbers."""
    problem = promise.problem
    return refine(problem, start_vector(problem.records, problem.layout), current.weights, ROUNDS, FINE)


def _fall(new: Pair, old: Pair) -> float:
    """Return the share the error falls to, the mean of fitted and unseen runs; one where it does not fall on both."""
    unseen = np.isfinite(old.validation.mean)
    sides = [new.train.mean / old.train.mean, *([new.validation.mean / old.validation.mean] if unseen else [])]
    return float(np.exp(np.mean(np.log(sides)))) if max(sides) < 1.0 else 1.0
