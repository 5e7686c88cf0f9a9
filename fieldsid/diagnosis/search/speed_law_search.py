"""How speed enters a model: one speed for a group of runs or one each, one authority for all or one each, which trim law."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any, TypeVar

import numpy as np

from fieldsid.diagnosis.evidence.acceptance import keeps_error, leaves_error
from fieldsid.diagnosis.evidence.likelihood_fit import FittedProblem, fit_maximum_likelihood, fit_output_error
from fieldsid.diagnosis.evidence.scored_model import ScoredModel, score_model
from fieldsid.diagnosis.parallel_map import ParallelMap
from fieldsid.diagnosis.thresholds import ALTERNATIVE_LOG_ODDS, MISSING_ERROR_RATIO
from fieldsid.fitting.initial.effect_screen import (
    backtrack,
    linearise_at,
    screen_effect,
    under_other_speed_law,
    under_speed_groups,
)
from fieldsid.fitting.initial.equation_error import equation_error_start
from fieldsid.fitting.initial.trim_speed_law import (
    MIN_TRIM_LAW_ERROR_GAIN,
    SPEED_SCATTER_SHARE,
    possible_trims,
    speeds_differ_in_group,
)
from fieldsid.fitting.problem.parameters import GROUP_WIDTH_TRAINED, SpeedGroups, layout_of, speed_groups
from fieldsid.fitting.problem.problem import Problem
from fieldsid.models.axis import Axis
from fieldsid.models.effect import Effect
from fieldsid.models.model import Noise
from fieldsid.models.record import Record
from fieldsid.models.speed_law import TRIM_OF_FIN
from fieldsid.numerics.arrays import FloatArray
from fieldsid.runtime.evaluation_counter import EvaluationCounter

T = TypeVar("T")

FINE_GROUP_WIDTH = 0.0085
"""Log ratio of speeds up to which runs form one group while models are compared: what two measured speeds differ by at most, 2
standard deviations of their difference (`speed_correction.MEASURED_SPEED_STD_ERROR`). The line |b2| = 0.33 u^2 + 0.23 of the
method's paper goes with powers from 1.2 to 1.7 between 1 and 2 m/s: across 3 % of speed u^2 is off by 1 to 2 %, which a turn of
90 deg shows and which passes for effects that are not there. Of 42 effects of the second bank in runs of speeds 0.1 to 3 % apart
35 were named right with groups of 3 %, 40 with groups of 0.6 %."""
MAX_TRIM_SWITCHES = 2
"""Times a search starts again under the other trim law: a first effect may favour the law that a second one does not."""
MIN_ONE_SPEED_ERROR_GAIN = 1.1
"""Factor by which the product of both channels' errors must fall for the runs of a group to count as flown at one speed."""


def speed_laws(records: Sequence[Record], *, trim_of_fin: bool | None) -> tuple[SpeedGroups, ...]:
    """Return the speed groups to try: runs of a group at one speed or each at its own, under either trim law or the one given."""
    groups = speed_groups(records, width=FINE_GROUP_WIDTH)
    snapped = (False, True) if len(groups.speeds) < len(records) else (False,)
    trims = possible_trims(groups) if trim_of_fin is None else (trim_of_fin,)
    return tuple(speed_groups(records, width=FINE_GROUP_WIDTH, snapped=s, trim_of_fin=t) for t in trims for s in snapped)


def fit_base_output_error(
    records: tuple[Record, ...], axis: Axis, known: Sequence[Effect], groups: SpeedGroups, floor: Noise,
    evaluations: EvaluationCounter,
) -> FittedProblem:  # fmt: skip
    """Return the output-error fit of the base model with its known effects, under a speed law."""
    layout = layout_of(records, axis, (), groups)
    fitted = fit_output_error(Problem(records, layout, evaluations), equation_error_start(records, layout), floor)
    for effect in known:
        linearisation = linearise_at(fitted.problem, fitted.x, fitted.weights)
        screened = backtrack(linearisation, screen_effect(linearisation, effect))
        fitted = fit_output_error(screened.problem, screened.start, fitted.weights)
    return fitted


def error_product(fitted: FittedProblem, axis: Axis) -> float:
    """Return the product of both channels' errors, larger by a factor for an unusual trim law or grouped speeds."""
    groups = fitted.problem.layout.groups
    usual = (1.0 if groups.trim_of_fin == TRIM_OF_FIN[axis] else MIN_TRIM_LAW_ERROR_GAIN) * (
        MIN_ONE_SPEED_ERROR_GAIN if groups.snapped else 1.0
    )
    return fitted.weights.angle * fitted.weights.rate * usual


def other_speed_law(h: ScoredModel, resolution_floor: Noise, noise_kind: str, *, asks_for_more: bool) -> ScoredModel | None:
    """Return a model under another speed law (see `under_other_speed_law`) where that has more evidence, None elsewhere.

    An authority shared by all speeds is determined far better. A group that does not follow the law, or runs that were flown at
    one speed though the turn slowed some down, show only once the missing effect is found.
    """
    fitted = h.likelihood_fit.fitted
    groups = fitted.problem.layout.groups
    if groups.snapped and asks_for_more:
        return _better(h, _snapped(h, snapped=False), resolution_floor, noise_kind, 0.0)
    other = None
    if asks_for_more and _speeds_scatter(h):
        other = _better(h, _snapped(h, snapped=True), resolution_floor, noise_kind, ALTERNATIVE_LOG_ODDS)
    one_speed = len(groups.speeds) == 1
    if (one_speed or groups.by_law) and not (asks_for_more and speeds_differ_in_group(groups)):
        return other
    law = under_other_speed_law(fitted.problem, fitted.x)
    lawful = _better(h if other is None else other, law, resolution_floor, noise_kind, ALTERNATIVE_LOG_ODDS if one_speed else 0.0)
    return other if lawful is None else lawful


def _snapped(h: ScoredModel, *, snapped: bool) -> tuple[Problem, FloatArray]:
    """Return the problem of a model with its runs at their groups' speeds, or each at its own, and x carried over."""
    fitted = h.likelihood_fit.fitted
    groups = fitted.problem.layout.groups
    taken = speed_groups(fitted.problem.records, width=FINE_GROUP_WIDTH, snapped=snapped, trim_of_fin=groups.trim_of_fin)
    return under_speed_groups(fitted.problem, fitted.x, replace(groups, snapped=snapped, run_speeds=taken.run_speeds))


def _speeds_scatter(h: ScoredModel) -> bool:
    """Whether a run, of the validation too, has another speed than the group it would count with, by more than is measured."""
    problem = h.likelihood_fit.fitted.problem
    speeds = np.array([r.speed for r in (*problem.records, *h.validation)])
    off = np.abs(np.log(speeds[:, None] / np.array(problem.layout.groups.speeds))).min(axis=1)
    return bool(((off > SPEED_SCATTER_SHARE) & (off <= GROUP_WIDTH_TRAINED)).any())


@dataclass(slots=True)
class TrimLawSearch:
    """Models under the other trim law, each fitted once, and the number of switches to it."""

    known: dict[tuple[tuple[str, ...], float], ScoredModel | None] = field(default_factory=dict)
    switches: int = 0

    def best_alternative(
        self,
        found: ScoredModel,
        tried: Mapping[frozenset[str], ScoredModel],
        floor: Noise,
        resolution_floor: Noise,
        parallel: ParallelMap,
        first: Callable[[], T],
    ) -> tuple[T, ScoredModel | None]:
        """Return the answer of `first`, and a model with more evidence under the other trim law than the one found, or None.

        One of the effects found may stand in for that law. Where an error above the floor remains, the law itself may cause it:
        the model found is tried, and of the others those with most evidence over all runs and over the training runs.
        """
        key, asked = frozenset(found.names), list[ScoredModel]()
        if self.switches < MAX_TRIM_SWITCHES:
            asked = [tried[k] for k in tried if k < key and len(k) == len(key) - 1]
            asked += [found, *_most_evident([h for h in tried.values() if h is not found])] if leaves_error(found, floor) else []
        keys = {(h.names, h.log_evidence): h for h in asked}
        new = {k: partial(other_trim_law, h, resolution_floor) for k, h in keys.items() if k not in self.known}
        parts: tuple[Callable[[], Any], ...] = (first, *new.values())
        answer, *again = parallel.map(lambda part: part(), parts)
        self.known |= dict(zip(new, again, strict=True))
        better = [
            other
            for k, h in keys.items()
            if (other := self.known[k]) is not None
            and other.log_evidence > max(found.log_evidence, h.log_evidence + _prior_log_odds(other))
            and _predicts(other, found)
        ]
        return answer, max(better, key=lambda h: h.log_evidence, default=None)

    def without_an_effect(self, found: ScoredModel, tried: Mapping[frozenset[str], ScoredModel]) -> list[ScoredModel]:
        """Return the models that lack one of a model's effects and have more evidence under the other trim law, under that."""
        key = frozenset(found.names)
        less = [h for k, h in tried.items() if k < key and len(k) == len(key) - 1]
        others = [(h, self.known.get((h.names, h.log_evidence))) for h in less]
        return [other for h, other in others if other is not None and _predicts(other, h)]


def _prior_log_odds(h: ScoredModel) -> float:
    """Return the prior log odds against a model's trim law, which a search turns to: those of any other law of the speed."""
    layout = h.likelihood_fit.fitted.problem.layout
    return 0.0 if layout.groups.trim_of_fin == TRIM_OF_FIN[layout.axis] else ALTERNATIVE_LOG_ODDS


def _most_evident(tried: Collection[ScoredModel]) -> list[ScoredModel]:
    """Return the models with most evidence, over all runs and over the training runs; none where none was tried."""
    if not tried:
        return []
    over_training = max(tried, key=lambda h: h.training_evidence)
    return [max(tried, key=lambda h: h.log_evidence), over_training]


def _predicts(h: ScoredModel, found: ScoredModel) -> bool:
    """Whether the validation error of a model under the other law is not far above that of the model found.

    Where speeds are slightly wrong, a disturbance absorbs what either law leaves of the heading, and evidence alone decides by
    chance.
    """
    return h.selection_errors.mean < MISSING_ERROR_RATIO * found.selection_errors.mean


def other_trim_law(h: ScoredModel, resolution_floor: Noise) -> ScoredModel | None:
    """Return a model under the other trim law where that has more evidence, None elsewhere."""
    fitted, layout, noise_kind = h.likelihood_fit.fitted, h.likelihood_fit.fitted.problem.layout, h.likelihood_fit.noise_kind
    records, varying = fitted.problem.records, any(e.terms is not None for e in h.effects)
    for trim in possible_trims(speed_groups(records, width=FINE_GROUP_WIDTH), varying=varying):
        if trim != layout.groups.trim_of_fin:
            other = replace(fitted.problem, layout=replace(layout, groups=replace(layout.groups, trim_of_fin=trim)))
            fit = score_model(
                fit_maximum_likelihood(other, fitted.x, h.likelihood_fit.noise, resolution_floor, noise_kind), h.validation
            )
            if fit.log_evidence > h.log_evidence:
                return fit
    return None


def _better(
    h: ScoredModel, law: tuple[Problem, FloatArray], resolution_floor: Noise, noise_kind: str, worth: float
) -> ScoredModel | None:
    """Return the scored model of a problem with the same effects, from x, where it gains that much evidence, None elsewhere.

    As another variant of an effect it may not raise the error on unseen runs: in a log without noise evidence tells little.
    """
    other = score_model(fit_maximum_likelihood(*law, h.likelihood_fit.noise, resolution_floor, noise_kind), h.validation)
    return other if other.log_evidence > h.log_evidence + worth and keeps_error(h, other) else None
