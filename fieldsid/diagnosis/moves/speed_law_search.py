"""The search over speed laws: one speed per group of runs or per run, one authority for all groups or each, and the trim law."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fieldsid.diagnosis.evidence.acceptance import keeps_error, leaves_error
from fieldsid.diagnosis.evidence.likelihood_fit import FittedProblem, fit_output_error
from fieldsid.diagnosis.evidence.scored_model import ScoredModel, score_model
from fieldsid.diagnosis.moves.archive import Archive
from fieldsid.diagnosis.moves.grounds import Grounds
from fieldsid.diagnosis.thresholds import ALTERNATIVE_LOG_ODDS
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

FINE_GROUP_WIDTH = 0.0085
"""Log ratio of speeds up to which runs form one group while models are compared: two standard deviations of the difference of two
measured speeds (`speed_correction.MEASURED_SPEED_STD_ERROR`). The line |b2| = 0.33 u^2 + 0.23 of the
method's paper goes with powers from 1.2 to 1.7 between 1 and 2 m/s: across 3 % of speed u^2 is off by 1 to 2 %, which a turn of
90 deg shows and which passes for effects that are not there. Of 42 effects of the second bank in runs of speeds 0.1 to 3 % apart
35 were named right with groups of 3 %, 40 with groups of 0.6 %."""
MIN_ONE_SPEED_ERROR_GAIN = 1.1
"""Factor by which the product of both channels' errors must fall for the runs of a group to count as flown at one speed."""


def speed_laws(records: Sequence[Record]) -> tuple[SpeedGroups, ...]:
    """Return the speed groups to try: one speed for the runs of a group or the measured speed of each, under either trim law."""
    groups = speed_groups(records, width=FINE_GROUP_WIDTH)
    snapped = (False, True) if len(groups.speeds) < len(records) else (False,)
    trims = possible_trims(groups)
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
    """Return the product of both channels' errors, times a factor for an unusual trim law or for grouped speeds."""
    groups = fitted.problem.layout.groups
    usual = (1.0 if groups.trim_of_fin == TRIM_OF_FIN[axis] else MIN_TRIM_LAW_ERROR_GAIN) * (
        MIN_ONE_SPEED_ERROR_GAIN if groups.snapped else 1.0
    )
    return fitted.weights.angle * fitted.weights.rate * usual


def under_other_law(h: ScoredModel, tried: Archive, grounds: Grounds) -> None:
    """Store a model under another law of speed or trim, or both, where that has more evidence."""
    found = other_speed_law(h, grounds) or h
    tried[frozenset(h.names)] = _other_trim_law(found, grounds) or found


def _other_trim_law(h: ScoredModel, grounds: Grounds) -> ScoredModel | None:
    """Return a model under the other trim law where that has more evidence, else None.

    The base or the first effect may favour a wrong law because another effect is missing.
    """
    problem, varying = h.likelihood_fit.fitted.problem, any(e.terms is not None for e in h.effects)
    layout, usual = problem.layout, TRIM_OF_FIN[problem.layout.axis]
    possible = possible_trims(speed_groups(problem.records, width=FINE_GROUP_WIDTH), varying=varying)
    for trim in (trim for trim in possible if trim != layout.groups.trim_of_fin):
        other = replace(problem, layout=replace(layout, groups=replace(layout.groups, trim_of_fin=trim)))
        required_gain = 0.0 if trim == usual else ALTERNATIVE_LOG_ODDS
        return _better(h, (other, h.likelihood_fit.fitted.x), grounds, required_gain)
    return None


def other_speed_law(h: ScoredModel, grounds: Grounds) -> ScoredModel | None:
    """Return a model under another speed law (see `under_other_speed_law`) where that has more evidence, else None.

    An authority shared by all speeds is determined far better. A group that does not follow the law, or runs that were flown at
    one speed though the turn slowed some down, show only once the missing effect is found.
    """
    fitted, has_error = h.likelihood_fit.fitted, leaves_error(h, grounds.floor)
    groups = fitted.problem.layout.groups
    if groups.snapped and has_error:
        return _better(h, _snapped(h, snapped=False), grounds, 0.0)
    other = None
    if has_error and _speeds_scatter(h):
        other = _better(h, _snapped(h, snapped=True), grounds, ALTERNATIVE_LOG_ODDS)
    one_speed = len(groups.speeds) == 1
    if (one_speed or groups.by_law) and not (has_error and speeds_differ_in_group(groups)):
        return other
    law = under_other_speed_law(fitted.problem, fitted.x)
    under_law = _better(h if other is None else other, law, grounds, ALTERNATIVE_LOG_ODDS if one_speed else 0.0)
    return other if under_law is None else under_law


def _snapped(h: ScoredModel, *, snapped: bool) -> tuple[Problem, FloatArray]:
    """Return the problem and x of a model with its runs at the speeds of their groups, or each at its measured speed."""
    fitted = h.likelihood_fit.fitted
    groups = fitted.problem.layout.groups
    taken = speed_groups(fitted.problem.records, width=FINE_GROUP_WIDTH, snapped=snapped, trim_of_fin=groups.trim_of_fin)
    return under_speed_groups(fitted.problem, fitted.x, replace(groups, snapped=snapped, run_speeds=taken.run_speeds))


def _speeds_scatter(h: ScoredModel) -> bool:
    """Return whether the speed of any run differs from that of its group by more than the measurement error."""
    problem = h.likelihood_fit.fitted.problem
    speeds = np.array([r.speed for r in (*problem.records, *h.validation)])
    off = np.abs(np.log(speeds[:, None] / np.array(problem.layout.groups.speeds))).min(axis=1)
    return bool(((off > SPEED_SCATTER_SHARE) & (off <= GROUP_WIDTH_TRAINED)).any())


def _better(h: ScoredModel, law: tuple[Problem, FloatArray], grounds: Grounds, required_gain: float) -> ScoredModel | None:
    """Return the scored model of a problem with the same effects, from x, where its evidence gains `required_gain`, else None.

    It must not raise the error on unseen runs, as for a variant of an effect: in a log without noise the evidence is unreliable.
    """
    other = score_model(grounds.fit(*law, h.likelihood_fit.noise), h.validation)
    return other if other.log_evidence > h.log_evidence + required_gain and keeps_error(h, other) else None
