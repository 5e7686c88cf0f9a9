"""A search by output error alone, where logs with almost no noise are left unexplained: of a towing tank, or filtered.

The likelihood compares models by the disturbance that each still needs. Residuals that depend on the fin or the motion are not a
disturbance, and without noise the smallest inconsistency of the sensors outweighs the hydrodynamics: the likeliest model need not
predict best. So sets of effects are compared by the error of their output-error fits, and an effect is added as long as it lowers
that error on training and validation runs by a twentieth. An effect of the set found is removed again where the log evidence is
higher without it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from fieldsid.diagnosis.evidence.likelihood_fit import FittedProblem, fit_output_error
from fieldsid.diagnosis.evidence.scored_model import (
    ScoredModel,
    bare_model,
    errors_of,
    score_model,
    training_runs,
    validation_fits,
    validation_runs,
)
from fieldsid.diagnosis.moves.archive import Names
from fieldsid.diagnosis.records import Pair
from fieldsid.diagnosis.search.given_model import output_error_of
from fieldsid.diagnosis.search.search import Search
from fieldsid.diagnosis.thresholds import MAX_FREE_RUN_ERROR_RATIO, MIN_BASE_ERROR_SHARE
from fieldsid.fitting.initial.effect_screen import ScreenResult, backtrack, carry_parameters, linearise_at, screen_effect
from fieldsid.fitting.initial.equation_error import equation_error_starts
from fieldsid.models.effect import Effect

MAX_EFFECTS_TRIED, BEAM_WIDTH, MAX_EFFECTS = 8, 2, 3
"""Number of effects fitted from each model, in the order of their screen (which is unreliable for a slow cross state), number of
models of each size that are extended, and largest number of effects."""
FIRST_ITERATIONS, MAX_FREE_RUN_ITERATIONS, COST_TOLERANCE = 25, 60, 1e-7
"""Iterations from each start, iterations of the better one, and the relative decrease of the sum of squares below which
iterations end: convergence is slow, and the order of the sets is settled long before its end. With 200 in place of 60 a tanker's
towing-tank runs took half as long again, and of four choices of judged runs two named the same and two a stall or an event for
the damping."""


@dataclass(frozen=True, slots=True)
class FreeRunFit:
    """An output-error fit, its errors, and their ratio to the base model's times a charge for the nuisances of each run.

    A nuisance, such as the time of an event, is fitted on the validation runs too, so each must lower the error as an effect
    must.
    """

    output_error_fit: FittedProblem
    errors: Pair
    error_ratio: float
    charge: float


@dataclass(slots=True)
class Explored:
    """The best output-error fit of each set of effects, and the sets that were extended by one effect."""

    fits: dict[frozenset[str], FreeRunFit] = field(default_factory=dict)
    extended: set[frozenset[str]] = field(default_factory=set)


def noiseless_search(search: Search, explains: Callable[[ScoredModel], bool]) -> ScoredModel | None:
    """Return the model that a beam search by the error ends at, None where no effect lowers it enough.

    The best two models of every size are extended, because the best single effect need not be part of the best set. Effects that
    lower the log evidence are removed at the end, as long as the rest still `explains` enough; the rest is then extended by
    effects that gain log evidence. That set, and those without one of its effects, are stored in the archive of the search.
    """
    start, explored = _start(search), Explored()
    grown = _grow(search, start, explored)
    if grown is start:
        return None
    best, without = _backward_eliminate(search, grown, explored)
    found = _thin(search, _scored(search, best.output_error_fit), without, explored, explains)
    if len(found.names) < len(grown.output_error_fit.names):
        found = _grow_likelier(search, found, explored)
        found = _thin(search, found, _without_each(search, explored.fits[frozenset(found.names)], explored), explored, explains)
    return found


def noiseless_line(search: Search, line: Sequence[Names]) -> list[ScoredModel]:
    """Return the models of a line of sets, from the base to that with all its effects, by output error as in the search.

    The sets are reached as in the search, from the best two of each size, and from the line's own.
    """
    start, explored = _start(search), Explored()
    fits, front = [start], [start]
    for ends in line[1:]:
        for current in front:
            for new in _forward_candidates(search, current.output_error_fit):
                _keep(explored.fits, new)
        grown = sorted((f for n, f in explored.fits.items() if len(n) == len(ends)), key=lambda f: f.error_ratio)
        fits.append(explored.fits[ends])
        front = [*grown[:BEAM_WIDTH], *(fits[-1:] if fits[-1] not in grown[:BEAM_WIDTH] else [])]
    return search.parallel.map(partial(_scored, search), [f.output_error_fit for f in fits])


def _start(search: Search) -> FreeRunFit:
    """Return the base's output-error fit, from its own values or the given model's, and store it in the archive."""
    base = search.base()
    given = None if search.given is None else output_error_of(search.given, base)
    fits = (base.reported_fit, base.likelihood_fit.fitted.by_output_error(), *([] if given is None else [given]))
    best = min((replace(base, output_error_fit=f) for f in fits), key=lambda h: h.train_under(0.0).mean)
    search.tried[search.root] = best.evaluate_errors()
    return FreeRunFit(best.reported_fit, _as_modelled(best), 1.0, _charge(search, best.reported_fit))


def _grow(search: Search, start: FreeRunFit, explored: Explored) -> FreeRunFit:
    """Return the best extension of a model by a beam search; the model itself where no effect lowers the error enough."""
    best, front = start, [start]
    for _ in range(MAX_EFFECTS):
        grown: dict[frozenset[str], FreeRunFit] = {}
        for current in front:
            for new in _lower(search, current, explored):
                _keep(grown, new)
        front = sorted(grown.values(), key=lambda f: f.error_ratio)[:BEAM_WIDTH]
        if not front or front[0].error_ratio > MAX_FREE_RUN_ERROR_RATIO * best.error_ratio:
            break
        best = front[0]
    return best


def _grow_likelier(search: Search, found: ScoredModel, explored: Explored) -> ScoredModel:
    """Return the extension of a model by those effects that gain log evidence, the largest fall of the error first."""
    while len(found.names) < len(search.known) + MAX_EFFECTS:
        lower = sorted(_lower(search, explored.fits[frozenset(found.names)], explored), key=lambda f: f.error_ratio)
        scored = (_scored(search, new.output_error_fit) for new in lower)
        likelier = next((h for h in scored if h.log_evidence > found.log_evidence), None)
        if likelier is None:
            break
        found = likelier
    return found


def _lower(search: Search, current: FreeRunFit, explored: Explored) -> list[FreeRunFit]:
    """Return the fits with one effect more that lower the error enough."""
    key, lower = frozenset(current.output_error_fit.names), []
    if key not in explored.extended:
        explored.extended.add(key)
        for new in _forward_candidates(search, current.output_error_fit):
            _keep(explored.fits, new)
    for new in [fit for names, fit in explored.fits.items() if key < names and len(names) == len(key) + 1]:
        charged = _error_ratio(search, new.errors, current.errors) * new.charge / current.charge
        if charged <= MAX_FREE_RUN_ERROR_RATIO:
            lower.append(new)
    return lower


def _thin(
    search: Search, found: ScoredModel, without: Sequence[FreeRunFit], explored: Explored, explains: Callable[[ScoredModel], bool]
) -> ScoredModel:  # fmt: skip
    """Return a model without the effects that lower the log evidence; store it, and it without each effect, in the archive."""
    while True:
        less = search.parallel.map(partial(_scored, search), [w.output_error_fit for w in without])
        search.tried.update({frozenset(h.names): h for h in (found, *less)})
        likelier = max((found, *filter(explains, less)), key=lambda h: h.log_evidence)
        if likelier is found:
            return found
        found, without = likelier, _without_each(search, without[less.index(likelier)], explored)


def _keep(known: dict[frozenset[str], FreeRunFit], new: FreeRunFit) -> None:
    """Store a fit unless one of the same effects has a lower error."""
    key = frozenset(new.output_error_fit.names)
    if key not in known or new.error_ratio < known[key].error_ratio:
        known[key] = new


def _backward_eliminate(search: Search, best: FreeRunFit, explored: Explored) -> tuple[FreeRunFit, list[FreeRunFit]]:
    """Return a fit without the effects that are no longer needed, and the fits without each of those that remain."""
    while True:
        less = _without_each(search, best, explored)
        if not less:
            return best, []
        superfluous = min(less, key=lambda f: f.error_ratio)
        if best.error_ratio <= MAX_FREE_RUN_ERROR_RATIO * superfluous.error_ratio:
            return best, less
        best = superfluous


def _without_each(search: Search, best: FreeRunFit, explored: Explored) -> list[FreeRunFit]:
    """Return the fits without each of a set's effects; none where the set has only one."""
    effects = [e for e in best.output_error_fit.effects if e.name not in search.known]
    if len(effects) < 2:
        return []
    for new in search.parallel.map(partial(_drop_effect, search, best.output_error_fit), effects):
        _keep(explored.fits, new)
    return [explored.fits[frozenset(best.output_error_fit.names) - {e.name}] for e in effects]


def _drop_effect(search: Search, fitted: FittedProblem, removed: Effect) -> FreeRunFit:
    problem = fitted.problem.with_effects([e for e in fitted.effects if e is not removed])
    x = carry_parameters(problem.layout, fitted.vector)
    return _evaluate(search, fit_output_error(problem, x, fitted.weights, MAX_FREE_RUN_ITERATIONS, COST_TOLERANCE))


def _scored(search: Search, fitted: FittedProblem) -> ScoredModel:
    """Return a model with its maximum-likelihood fit, the better of one from its free run and one from the base's likelihood."""
    of_base, problem = search.base().likelihood_fit, fitted.problem
    starts = (fitted.x, carry_parameters(problem.layout, of_base.fitted.vector))
    fits = (search.grounds.fit(problem, x, of_base.noise) for x in starts)
    return replace(score_model(max(fits, key=lambda f: f.log_likelihood), search.validation), output_error_fit=fitted)


def _evaluate(search: Search, fitted: FittedProblem) -> FreeRunFit:
    base = search.base()
    flown = validation_fits(bare_model(fitted.problem, fitted.x, base.likelihood_fit.noise), fitted, search.validation)
    errors = Pair(errors_of(training_runs(fitted), 0.0), errors_of(validation_runs(flown, search.validation), 0.0))
    charge = _charge(search, fitted)
    return FreeRunFit(
        fitted, errors, _error_ratio(search, errors, _as_modelled(base)) * charge / _charge(search, base.reported_fit), charge
    )


def _as_modelled(h: ScoredModel) -> Pair:
    """Return the errors of a model without a constant moment for each run: without noise the complete error is the model's."""
    return Pair(h.train_under(0.0), h.unseen_under(0.0)[0])


def _charge(search: Search, fitted: FittedProblem) -> float:
    """Return the factor on the error for the nuisances of each run."""
    nuisances = sum(len(e.nuisance) for e in fitted.effects)
    return float(MAX_FREE_RUN_ERROR_RATIO ** -(nuisances * (len(search.records) + len(search.validation))))


def _forward_candidates(search: Search, current: FittedProblem) -> list[FreeRunFit]:
    """Return the fits with one effect more, for the effects of lowest predicted cost, each from all available starts."""
    linearisation = linearise_at(current.problem, current.x, current.weights)
    left = [e for e in search.catalogue if e.name not in current.names]
    screened_points = sorted(search.parallel.map(partial(screen_effect, linearisation), left), key=lambda p: p.predicted_cost)

    def fit_from_all_starts(screened: ScreenResult) -> FreeRunFit:
        search.report("+".join((*current.names, screened.effect.name)))
        problem = screened.problem
        # the base may be biased; the equation-error start and declared start values do not depend on it
        starts = (backtrack(linearisation, screened).start, *equation_error_starts(problem.records, problem.layout))
        begun = (fit_output_error(problem, x, current.weights, FIRST_ITERATIONS, COST_TOLERANCE) for x in starts)
        better = min(begun, key=lambda t: t.weights.angle * t.weights.rate)
        return _evaluate(search, fit_output_error(problem, better.x, better.weights, MAX_FREE_RUN_ITERATIONS, COST_TOLERANCE))

    return search.parallel.map(fit_from_all_starts, screened_points[:MAX_EFFECTS_TRIED])


def _error_ratio(search: Search, new: Pair, old: Pair) -> float:
    """Return the ratio of two errors, on validation runs where there are any; 1 where it does not fall on training runs too.

    An effect pays no price for its flexibility on the training runs here: its prediction decides. Errors are compared down to a
    share of the base model's.
    """
    base = _as_modelled(search.base())
    sides = [
        np.hypot(now.mean, least) / np.hypot(before.mean, least)
        for now, before, of_base in ((new.train, old.train, base.train), (new.validation, old.validation, base.validation))
        if np.isfinite(least := MIN_BASE_ERROR_SHARE * of_base.mean)
    ]
    return float(sides[-1]) if max(sides) < 1.0 else 1.0
