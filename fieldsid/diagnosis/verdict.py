"""The verdict on the ranked models: effect, sufficient, disturbed, undecided or unexplained."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from fieldsid.diagnosis.data.noise_floor import reported_noise_floor
from fieldsid.diagnosis.evidence.acceptance import (
    compared_error,
    compared_errors,
    compared_share,
    excess_share,
    validation_error_ratio,
    worst_error,
)
from fieldsid.diagnosis.evidence.likelihood_fit import LikelihoodFit
from fieldsid.diagnosis.evidence.scored_model import ScoredModel
from fieldsid.diagnosis.records import Left
from fieldsid.diagnosis.residual_tests.residual_tests import ResidualTests
from fieldsid.diagnosis.search.search import Search
from fieldsid.diagnosis.search.whole_hull import HULLS_OWN
from fieldsid.diagnosis.thresholds import (
    EQUAL_ERROR_RATIO,
    EVIDENCE_TEMPERATURE,
    GUSTY_ERROR_RATIO,
    MAIN_EXPLAINED_SHARE,
    MAX_VALIDATION_ERROR_RATIO,
    MIN_P_VALUE,
    MISFIT_SHARE,
    MISSING_ERROR_RATIO,
    RIVAL_LOG_ODDS,
    SUFFICIENT_ERROR_RATIO,
    UNTRIED_LEAST,
    UNTRIED_MOST,
    UNTRIED_POWER,
)
from fieldsid.models.model import Noise


@dataclass(frozen=True, slots=True)
class Verdict:
    """The verdict in one word, the effects named, and the rival models where it is `undecided`."""

    word: str
    effects: tuple[str, ...]
    rivals: tuple[ScoredModel, ...] = ()


def verdict_of(search: Search, found: ScoredModel, left: ResidualTests, ml_fit: LikelihoodFit) -> Verdict:
    """Return the verdict on the model a search ended at, from its errors and the tests of its innovations.

    Errors are relative to the reported noise floor, which includes the sensors' coloured noise. Where no effect was found, the
    verdict is `sufficient` if training and validation errors are within SUFFICIENT_ERROR_RATIO; else `disturbed` if the
    innovations pass the tests of a disturbance, and `unexplained` if not. The same two verdicts are given where the effects found
    leave a visible error on the validation runs that is larger than without them, or explain less than half of a large error:
    such an effect may exist without being the missing one. No effect is named either where those found do not stand.
    """
    floor = reported_noise_floor(search.floor, ml_fit.noise)
    was, now = compared_errors(search.base(), found)
    error, share = compared_error(search.base(), found, floor), compared_share(search.base(), found, floor)
    if frozenset(found.names) == search.root:
        if worst_error(found, floor) <= SUFFICIENT_ERROR_RATIO:
            return Verdict("sufficient", ())
        return _unnamed(found, left, floor)
    large = error > MISSING_ERROR_RATIO and not search.is_noiseless
    raises = not now.mean < EQUAL_ERROR_RATIO * was.mean
    if error > SUFFICIENT_ERROR_RATIO and ((large and share < MAIN_EXPLAINED_SHARE) or raises):
        return _unnamed(found, left, floor)
    if not stands(search, found, left, floor):
        return Verdict("unexplained", ())
    rivals = rivals_of(search, found)
    if rivals:
        return Verdict("undecided", added_effects(search, found), rivals)
    return Verdict("effect", added_effects(search, found))


def stands(search: Search, found: ScoredModel, tests: ResidualTests, floor: Noise) -> bool:
    """Whether the effects found may be named, given the error that they leave over a noise floor.

    Those that every hull has always may. Unusual ones may unless the error is so large that the missing effect is more probably
    in no set tried, see `untried_probability`.
    """
    if HULLS_OWN.issuperset(names_added(search, found)):
        return True
    return untried_probability(error_left(search, found, tests, floor)) <= 0.5


def error_left(search: Search, found: ScoredModel, tests: ResidualTests, floor: Noise) -> float:
    """Return the error that a model leaves over the one that the right effects leave: the noise floor and MISFIT_SHARE.

    Where the tests accept it as a disturbance, it counts as GUSTY_ERROR_RATIO at most, because a larger one would fail them if it
    were a missing effect.
    """
    left = float(_least_error(search, found, floor) / np.hypot(1.0, MISFIT_SHARE * worst_error(search.base(), floor)))
    return left if _is_no_disturbance(found, tests, floor) else min(left, GUSTY_ERROR_RATIO)


def _least_error(search: Search, h: ScoredModel, floor: Noise) -> float:
    """Return the larger error of a model over a noise floor, of fitted and of unseen runs, at its better parameters.

    They are those of the fitted runs or of all runs: what the fitted runs leave open is nothing that the model lacks.
    """
    return min(worst_error(h, floor), compared_error(search.base(), h, floor))


def left_of(search: Search, named: ScoredModel, found: ScoredModel, tests: ResidualTests, floor: Noise) -> Left:
    """Return the error that remains with a named model; `tests` are those of the model found, which may have more effects.

    An error that the tests accept as a disturbance is not unexplained, unless it is far larger on the unseen runs. Where effects
    are named, an error above MISSING_ERROR_RATIO is unexplained whatever the tests say.
    """
    ratio = _least_error(search, named, floor)
    if ratio <= SUFFICIENT_ERROR_RATIO:
        return Left(ratio, unexplained=False)
    is_large_with_effects = ratio > MISSING_ERROR_RATIO and frozenset(named.names) != search.root
    is_unexplained = named is not found or is_large_with_effects or _is_no_disturbance(named, tests, floor)
    moves_with = tests.moves_with if 3.0 * tests.dependence < MIN_P_VALUE else ""
    return Left(ratio, is_unexplained, tests.worst_run, tests.worst_start_s, tests.worst_end_s, tests.worst_ratio, moves_with)


def _unnamed(found: ScoredModel, left: ResidualTests, floor: Noise) -> Verdict:
    """Return the verdict where no effect lowers the error that models are selected by: `disturbed`, or `unexplained`."""
    return Verdict("unexplained" if _is_no_disturbance(found, left, floor) else "disturbed", ())


def _is_no_disturbance(h: ScoredModel, tests: ResidualTests, floor: Noise) -> bool:
    """Whether a model's remaining error fails the tests of a disturbance, or is far larger on unseen runs."""
    p = 3.0 * tests.dependence if worst_error(h, floor) < GUSTY_ERROR_RATIO else tests.p
    return p < MIN_P_VALUE or validation_error_ratio(h, floor) > MAX_VALIDATION_ERROR_RATIO


def names_added(search: Search, h: ScoredModel) -> list[str]:
    """Return the names of the effects that a model adds to the base, in the model's order."""
    return [n for n in h.names if n not in search.known]


def added_effects(search: Search, h: ScoredModel) -> tuple[str, ...]:
    """Return the effects that a model adds to the base, in order of the error of all runs without each of them, largest first.

    An effect whose removal was not tried comes first.
    """

    def error_without(name: str) -> float:
        without = search.tried.get(frozenset(h.names) - {name})
        return without.error_of_all_runs(search.floor) if without is not None else float("inf")

    return tuple(sorted(names_added(search, h), key=lambda n: -error_without(n)))


def rivals_of(search: Search, found: ScoredModel) -> tuple[ScoredModel, ...]:
    """Return the rivals of the final model by evidence: models of its size.

    Their free runs may differ where the training runs leave a parameter undetermined, which the evidence takes into account.
    """
    margin, sums = RIVAL_LOG_ODDS if len(search.records) > 1 else 2.0 * RIVAL_LOG_ODDS, search.evidences()
    best = sums[frozenset(found.names)]
    near = (h for h in search.ranked() if best - sums.get(frozenset(h.names), -np.inf) < margin)
    return tuple(h for h in near if h is not found and len(h.names) == len(found.names))


def excess_explained(search: Search, h: ScoredModel, floor: Noise | None = None) -> float:
    """Return the share (0..1) that a model removes of the base's excess squared error over a noise floor."""
    return excess_share([search.base().selection_errors], [h.selection_errors], floor or search.floor)


def worsens(search: Search, h: ScoredModel, floor: Noise) -> bool:
    """Whether a model raises the error over a noise floor by more than EQUAL_ERROR_RATIO."""
    return bool(h.selection_errors.over(floor) > EQUAL_ERROR_RATIO * search.base().selection_errors.over(floor))


def probabilities(evidences: Mapping[frozenset[str], float], left: float = 1.0) -> dict[frozenset[str], float]:
    """Return the posterior probability of each set of effects: proportional to exp(log evidence / EVIDENCE_TEMPERATURE).

    They sum to one less the probability that the hidden effect is in none of the sets tried. The evidence of one set over another
    says nothing about that probability; it is estimated from `left`, the `error_left` of the named set.
    """
    scores = np.array(list(evidences.values())) / EVIDENCE_TEMPERATURE
    weights = np.exp(scores - scores.max())
    tried = 1.0 - untried_probability(left)
    return dict(zip(evidences, (tried * weights / weights.sum()).tolist(), strict=True))


def untried_probability(left: float) -> float:
    """Return the probability that the missing effect is in no set tried, from the `error_left` of the named set."""
    share = 1.0 - 1.0 / max(left, 1.0) ** 2
    return float(max(UNTRIED_MOST * share**UNTRIED_POWER, UNTRIED_LEAST))
