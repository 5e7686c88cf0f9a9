"""The search by the free run alone, for logs that show next to no noise: of a towing tank, or filtered before logging.

A likelihood compares hypotheses by how much disturbance each still needs. Where what is left moves with the fin or the
motion it is no disturbance, and without noise to drown it the smallest inconsistency of the sensors weighs more than all
that the hull does: the most likely hypothesis is not the one that predicts. Then effects are added as long as each lets
output error predict unseen runs by a twentieth better.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np

from fieldsid.diagnosis.hypothesis import Hypothesis, bare_model, flown_by, hypothesis_of, training_errors, unseen_errors
from fieldsid.diagnosis.records import Pair
from fieldsid.diagnosis.search import Search
from fieldsid.diagnosis.trial import Trial, judge, refine
from fieldsid.fitting.start import start_vector
from fieldsid.fitting.starts import Promise, ground_of, promise_of, shortened

TRIED, FRONT, LARGEST = 5, 2, 3
ROUNDS, FINE = 200, 1e-7
"""Rounds of each free run, and the share of its sum of squares a round must gain: the valleys are long."""
BETTER = 0.95
"""Share that the error must fall to with every effect."""


def freely(search: Search) -> Hypothesis | None:
    """Return the hypothesis that the free run on unseen runs leads to, None where no effect makes it better.

    The best two of every size are grown: the first step down need not be the one the valley is reached by.
    """
    base, unseen = search.base(), bool(search.validation)
    lowest, best, front = 1.0, base.shown, [(base.shown, base.errors)]
    for _ in range(LARGEST):
        grown: dict[frozenset[str], tuple[float, Trial, Pair]] = {}
        for current, errors in front:
            for trial, new in _tried(search, current):
                way, fall = frozenset(trial.names), _fall(new, base.errors, unseen=unseen)
                if _fall(new, errors, unseen=unseen) <= BETTER and fall < grown.get(way, (1.0,))[0]:
                    grown[way] = (fall, trial, new)
        kept = sorted(grown.values(), key=lambda g: g[0])[:FRONT]
        if not kept or kept[0][0] > BETTER * lowest:
            break
        lowest, best = kept[0][:2]
        front = [(trial, errors) for _, trial, errors in kept]
    if best is base.shown:
        return None
    judged = judge(best.problem, best.x, base.judged.noise, search.told, search.family)
    return replace(hypothesis_of(judged, search.validation), plain=best)


def _tried(search: Search, current: Trial) -> list[tuple[Trial, Pair]]:
    """Return the most promising effects' free runs, each from the screen's start and from its declared one."""
    ground = ground_of(current.problem, current.x, current.weights)
    left = [e for e in search.catalogue if e.name not in current.names]
    promises = sorted(search.beside.each(partial(promise_of, ground), left), key=lambda p: p.cost)
    noise = search.base().judged.noise

    def flown_with(promise: Promise) -> tuple[Trial, Pair]:
        search.report("+".join((*current.names, promise.effect.name)))
        screened = refine(promise.problem, shortened(ground, promise).start, current.weights, ROUNDS, FINE)
        trial = min((screened, _declared(promise, current)), key=lambda t: t.weights.angle * t.weights.rate)
        flown = flown_by(bare_model(trial.problem, trial.x, noise), trial, search.validation)
        return trial, Pair(training_errors(trial), unseen_errors(flown, search.validation))

    return search.beside.each(flown_with, promises[:TRIED])


def _declared(promise: Promise, current: Trial) -> Trial:
    """Return the free run from the textbook's model and the effects' declared values: the base may have bent its numbers."""
    problem = promise.problem
    return refine(problem, start_vector(problem.records, problem.layout), current.weights, ROUNDS, FINE)


def _fall(new: Pair, old: Pair, *, unseen: bool) -> float:
    """Return the share the error falls to, the mean of fitted and unseen runs; one where it does not fall on both."""
    sides = [new.train.mean / old.train.mean, *([new.validation.mean / old.validation.mean] if unseen else [])]
    return float(np.exp(np.mean(np.log(sides)))) if max(sides) < 1.0 else 1.0
