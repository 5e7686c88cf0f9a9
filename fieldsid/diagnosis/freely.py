"""The search by the free run alone, for what is left where no likelihood of a disturbance can be trusted.

A likelihood compares hypotheses by how much disturbance each still needs. Where what is left moves with the fin or the
motion it is no disturbance, on a real vehicle in a basin least of all, and the most likely hypothesis may not be the one
that predicts. Then effects are added as long as each lets output error predict unseen runs by a tenth better.
"""

from __future__ import annotations

from dataclasses import replace

from fieldsid.diagnosis.hypothesis import Hypothesis, bare_model, errors_under, hypothesis_of
from fieldsid.diagnosis.records import Errors, Pair
from fieldsid.diagnosis.search import Search
from fieldsid.diagnosis.trial import Trial, judge, refine
from fieldsid.fitting.layout import layout_of
from fieldsid.fitting.problem import Problem
from fieldsid.fitting.start import start_vector
from fieldsid.fitting.starts import Promise, ground_of, promise_of, shortened

TRIED = 5
LARGEST = 3
ROUNDS, FINE = 60, 1e-6
"""Rounds of each free run, and the share of its sum of squares a round must gain: the valleys are long."""
BETTER = 0.9
"""Share that the error on unseen and on training runs must fall to with every effect."""


def freely(search: Search) -> Hypothesis | None:
    """Return the hypothesis that the free run on unseen runs leads to, None where no effect makes it better."""
    base, unseen = search.base(), bool(search.validation)
    current, errors = base.shown, base.errors
    while len(current.effects) < LARGEST + len(search.known):
        best = min(_tried(search, current), key=lambda found: _judged_by(found[1], unseen=unseen).mean, default=None)
        if best is None or not _better(best[1], errors, unseen=unseen):
            break
        current, errors = best
    if current is base.shown:
        return None
    judged = judge(current.problem, current.x, base.judged.noise, search.told, search.family)
    return replace(hypothesis_of(judged, search.validation), plain=current)


def _judged_by(pair: Pair, *, unseen: bool) -> Errors:
    return pair.validation if unseen else pair.train


def _tried(search: Search, current: Trial) -> list[tuple[Trial, Pair]]:
    """Return the most promising effects' free runs, each from the screen's start and from its declared one."""
    ground = ground_of(current.problem, current.x, current.weights)
    left = [e for e in search.catalogue if e.name not in current.names]
    promises = sorted((promise_of(ground, e) for e in left), key=lambda p: p.cost)
    found = []
    for promise in promises[:TRIED]:
        search.report("+".join((*current.names, promise.effect.name)))
        ways = [_refined(shortened(ground, promise), current), _declared(search, promise, current)]
        trial = min(ways, key=lambda t: t.weights.angle * t.weights.rate)
        noise = search.base().judged.noise
        found.append((trial, errors_under(trial, bare_model(trial.problem, trial.x, noise), search.validation)))
    return found


def _refined(promise: Promise, current: Trial) -> Trial:
    return refine(promise.problem, promise.start, current.weights, ROUNDS, FINE)


def _declared(search: Search, promise: Promise, current: Trial) -> Trial:
    """Return the free run from the textbook's model and the effects' declared values: the base may have bent its numbers."""
    layout = layout_of(search.records, search.axis, promise.problem.layout.effects, promise.problem.layout.groups)
    return refine(Problem(search.records, layout), start_vector(search.records, layout), current.weights, ROUNDS, FINE)


def _better(new: Pair, old: Pair, *, unseen: bool) -> bool:
    sides = [(new.train, old.train), *([(new.validation, old.validation)] if unseen else [])]
    return all(a.mean < BETTER * b.mean for a, b in sides)
