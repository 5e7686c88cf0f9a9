"""Moves that add one effect to a model: the choice of the effects to fit, and of their starts."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import TypeVar

import numpy as np

from fieldsid.diagnosis.evidence.likelihood_fit import MIN_LIKELIHOOD_GAIN, LikelihoodFit
from fieldsid.diagnosis.evidence.scored_model import ScoredModel, price_of_runs
from fieldsid.diagnosis.parallel_map import ParallelMap
from fieldsid.diagnosis.thresholds import ALTERNATIVE_LOG_ODDS
from fieldsid.fitting.initial.effect_screen import (
    Linearisation,
    ScreenResult,
    backtrack,
    linearise_at,
    screen_points,
)
from fieldsid.fitting.optimise.levenberg_marquardt import cost_of, levenberg_marquardt
from fieldsid.models.effect import Effect, with_variant
from fieldsid.rounding import nine_digits

T = TypeVar("T")

MAX_EFFECTS_AT_BASE, MAX_EFFECTS_LATER = 5, 3
"""Numbers of effects that pass each of the two screens, by the error of the free run and by the whitened error: for the base, and
for a model with effects. Of the 33 effects, together with others, in the results of 36 hard cases of the second bank, 24 came
first in a screen, 6 second and 3 third."""
FOREMOST_EFFECTS = 2
"""Number of effects, the first on each screen, that are fitted before the others. Where these leave no visible error, only those
of the others are fitted with which they may be confused. Of 257 single effects, 177 of five seeds of the second bank and 80 of
the own one, 245 came first on one of the base's two screens, 10 second and 2 third."""
MIN_WHITENED_COST_FALL, MIN_OUTPUT_ERROR_COST_SHARE = 5.0, 0.02
"""Fall of the whitened sum of squares, and share of the output-error sum of squares, below which an effect does not pass the
screen."""
MAX_FIRST_ORDER_SHORTFALL = 2.0
"""Largest assumed ratio of the gain in log likelihood of a fit to the first-order prediction of the screen by the whitened cost.
Of 204 moves on a dozen cases of the second bank 24 gained more, 21 of them many times what was required. Of the small ones three
did, by up to 2.7 times, and none was the best."""
MIN_ITERATED_COST_SHARE = 0.05
"""Share of the output-error sum of squares that a move must have removed after its iterations; an accepted effect removes at
least three times that."""
EXTRA_ITERATED_EFFECTS, SCREEN_ITERATIONS = 3, 4
"""Number of effects beyond `most` that the output-error screen iterates, because a first-order prediction is unreliable far from
the solution; and the number of iterations."""
MAX_ITERATED_POINTS = 4
"""Largest number of scan points of an effect that are iterated."""
MIN_EVENT_SEPARATION_SHARE = 0.1
"""Share of a run by which two times of an event must differ to be two separate starts."""


@dataclass(frozen=True, slots=True)
class Addition:
    """A request to add one of some effects to a model: the `most` best of each screen, or all with all starts where that is None.

    `flown`: the error of the free run is screened too, for a parent that may be far from the measurements. The noise fitted to it
    explains in part what the effect does, so that the whitened error hardly shows that.
    """

    parent: ScoredModel
    effects: Sequence[Effect]
    most: int | None = None
    flown: bool = False

    def screens(self) -> list[_Screen]:
        """Return the screens of its effects; none for a parent that diverges, which cannot be linearised."""
        if not np.isfinite(self.parent.likelihood_fit.log_likelihood):
            return []
        flown = [_Screen(self, _output_error_linearisation(self.parent), by_output_error=True)] if self.flown else []
        return [*flown, _Screen(self, likelihood_linearisation(self.parent), by_output_error=False)]


@dataclass(frozen=True, slots=True)
class SearchMove:
    """A screened effect, the linearisation of its screen, whether output error is fitted first, and its parent model."""

    screened: ScreenResult
    linearisation: Linearisation
    by_output_error: bool
    parent: ScoredModel

    @property
    def names(self) -> frozenset[str]:
        """The names of the effects of the model that results."""
        return frozenset((*self.parent.names, self.screened.effect.name))

    @property
    def priced_cost(self) -> float:
        """The predicted cost plus the price of the effect, by which moves are ranked."""
        return _priced_cost(self.parent, self.screened)


def screen_addition(addition: Addition, parallel: ParallelMap) -> list[SearchMove]:
    """Return the moves worth evaluating of an addition: the best of two screens, by output-error and by whitened cost."""
    screens = addition.screens()
    # all screens in one parallel map, then all further computations: at the end of each map one process waits for the other
    pairs = [(i, effect) for i in range(len(screens)) for effect in mechanisms(addition.effects)]
    points = parallel.map(lambda pair: _best_points(screens[pair[0]].linearisation, pair[1]), pairs)
    steps = list[_PendingMove]()
    for i, screen in enumerate(screens):
        steps += screen.steps([p for (at, _), p in zip(pairs, points, strict=True) if at == i])
    return _worth_evaluating(addition, list(zip(steps, parallel.map(lambda step: step.evaluate(), steps), strict=True)))


@dataclass(frozen=True, slots=True)
class _Screen:
    """A screen of an addition's effects: the parent's linearisation, by output error or under its noise."""

    addition: Addition
    linearisation: Linearisation
    by_output_error: bool

    def steps(self, points: Sequence[list[ScreenResult]]) -> list[_PendingMove]:
        """Return the moves to compute from the scan points of every effect."""
        parent, most = self.addition.parent, self.addition.most
        ranked = sorted(points, key=lambda points: _priced_cost(parent, points[0]))
        follows = self.by_output_error and most is not None
        if most is not None:
            first = first_few(ranked, most + follows * EXTRA_ITERATED_EFFECTS, lambda points: points[0].effect)
            ranked = [p for p in first if self.linearisation.cost - p[0].predicted_cost > self._least_fall(p[0].effect)]
        refine = _iterated if follows else _backtracked
        return [_PendingMove(self, follows, partial(refine, self.linearisation, p)) for p in ranked]

    def _least_fall(self, effect: Effect) -> float:
        """Return the smallest predicted fall of the cost for an effect."""
        if self.by_output_error:
            return MIN_OUTPUT_ERROR_COST_SHARE * self.linearisation.cost
        return _least_cost_fall(self.addition.parent, effect)


def _worth_evaluating(addition: Addition, taken: Sequence[tuple[_PendingMove, ScreenResult]]) -> list[SearchMove]:
    """Return the moves of an addition: the best iterated ones that lowered the cost enough, and all others."""
    moves = [(s.is_iterated, SearchMove(p, s.screen.linearisation, s.screen.by_output_error, addition.parent)) for s, p in taken]
    best = sorted((move for iterated, move in moves if iterated), key=lambda move: move.priced_cost)
    found = [
        *first_few(best, addition.most, lambda move: move.screened.effect),
        *(move for iterated, move in moves if not iterated),
    ]
    return found if addition.most is None else [w for w in found if not w.by_output_error or w is found[0] or _matters(w)]


def mechanisms(effects: Sequence[Effect]) -> list[Effect]:
    """Return effects, each followed by its variants that have none of the textbook's coefficients."""
    found: list[Effect] = []
    for effect in effects:
        textbook_names = {c.name for c in effect.coefficients}
        found += [effect, *(with_variant(effect, form) for form in effect.variants if textbook_names <= set(form.without))]
    return found


def first_few(ranked: Sequence[T], most: int | None, effect: Callable[[T], Effect]) -> list[T]:
    """Return the first `most` textbook effects of a ranking, and all variants that are ranked before the last of them.

    A variant does not displace an effect: all effects that are tried without variants are tried with them.
    """
    places = [i for i, one in enumerate(ranked) if not effect(one).is_formed]
    end = len(ranked) if most is None or len(places) <= most else places[most]
    return list(ranked[:end])


def _least_cost_fall(parent: ScoredModel, effect: Effect) -> float:
    """Return the fall of the training runs' whitened cost below which an effect cannot gain log evidence enough.

    It consists of the prior odds and the price of the effect's nuisances; the gain of validation runs is taken as proportional.
    """
    odds = 2.0 * ALTERNATIVE_LOG_ODDS * parent.training_share
    return max(MIN_WHITENED_COST_FALL, (odds + _price(parent, effect)) / MAX_FIRST_ORDER_SHORTFALL)


def _priced_cost(parent: ScoredModel, screened: ScreenResult) -> float:
    """Return the predicted cost with a screened effect plus the price of the effect."""
    return screened.predicted_cost + _price(parent, screened.effect)


def _price(parent: ScoredModel, effect: Effect) -> float:
    """Return the fall of the training runs' whitened cost that pays for the nuisances of an effect in each run.

    Without this price an event in each run would always be ranked before the drift that it imitates.
    """
    records = parent.likelihood_fit.fitted.problem.records
    return 2.0 * price_of_runs(effect, (*records, *parent.validation)) * parent.training_share


def _matters(move: SearchMove) -> bool:
    """Return whether a move of the output-error screen removed a relevant share of the sum of squares by its iterations."""
    return move.linearisation.cost - move.screened.predicted_cost > MIN_ITERATED_COST_SHARE * move.linearisation.cost


@dataclass(frozen=True, slots=True)
class _PendingMove:
    """The remaining computation of a move: some iterations, to be ranked by their cost, or a backtracked start."""

    screen: _Screen
    is_iterated: bool
    evaluate: Callable[[], ScreenResult]


def by_effects(found: Iterable[SearchMove]) -> list[list[SearchMove]]:
    """Return the moves grouped by the effects of the resulting model, in their order."""
    groups: dict[frozenset[str], list[SearchMove]] = {}
    for move in found:
        groups.setdefault(move.names, []).append(move)
    return list(groups.values())


def foremost(groups: Sequence[Sequence[SearchMove]], most: int) -> list[Sequence[SearchMove]]:
    """Return the groups of moves of the `most` effects that are ranked first on each screen by the priced cost."""
    leading = set[str]()
    for plain in (True, False):
        ranked = sorted(
            (nine_digits(move.priced_cost / move.linearisation.cost), move.screened.effect.name)
            for group in groups
            for move in group
            if move.by_output_error is plain
        )
        leading.update(list(dict.fromkeys(name for _, name in ranked))[:most])
    return [group for group in groups if group[0].screened.effect.name in leading]


def is_redundant_start(move: SearchMove, known: LikelihoodFit) -> bool:
    """Return whether a fit of the same model has reached the predicted cost of a move, with its events at similar times."""
    fitted, cost = known.fitted, move.screened.predicted_cost
    layout, events = fitted.problem.layout, zip(fitted.problem.layout.parameters, move.screened.start, fitted.x, strict=True)
    if layout.names == move.screened.problem.layout.names and any(s.is_event and starts_apart(a, b) for s, a, b in events):
        return False
    if move.by_output_error:
        return cost_of(fitted.problem, fitted.x, move.linearisation.noise) < (1.0 + MIN_OUTPUT_ERROR_COST_SHARE) * cost
    gained = known.log_likelihood - move.parent.likelihood_fit.log_likelihood
    return gained > 0.5 * (move.linearisation.cost - cost) - MIN_LIKELIHOOD_GAIN


def starts_apart(start: float, x: float) -> bool:
    """Return whether an event of a run starts so far from its time x that the two would not converge to one."""
    return abs(start - x) > MIN_EVENT_SEPARATION_SHARE


def _output_error_linearisation(parent: ScoredModel) -> Linearisation:
    free_run = parent.output_error_fit or parent.likelihood_fit.fitted.by_output_error()
    return linearise_at(free_run.problem, free_run.x, free_run.weights)


def likelihood_linearisation(parent: ScoredModel) -> Linearisation:
    """Return the linearisation of a model at its maximum-likelihood fit, under the noise of that fit."""
    fitted = parent.likelihood_fit.fitted
    return linearise_at(fitted.problem, fitted.x, parent.likelihood_fit.noise)


def _best_points(linearisation: Linearisation, effect: Effect) -> list[ScreenResult]:
    """Return the scan points of an effect with the lowest predicted cost, the best first."""
    return screen_points(linearisation, effect)[:MAX_ITERATED_POINTS]


def _backtracked(linearisation: Linearisation, points: Sequence[ScreenResult]) -> ScreenResult:
    """Return the first of some scan points with its start backtracked."""
    return backtrack(linearisation, points[0])


def _iterated(linearisation: Linearisation, points: Sequence[ScreenResult]) -> ScreenResult:
    """Return the best of some scan points after a few Levenberg-Marquardt iterations, with the cost that was reached."""
    tried = []
    for point in points:
        screened = backtrack(linearisation, point)
        found = levenberg_marquardt(
            screened.problem, screened.start, linearisation.noise, max_iterations=SCREEN_ITERATIONS, tolerance=1e-3
        )
        tried.append(replace(screened, predicted_cost=found.cost, start=found.x))
    return min(tried, key=lambda p: p.predicted_cost)
