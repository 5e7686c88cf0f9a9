"""The rules by which an effect added to a model is accepted: by the log evidence, and by the free-run errors.

The log evidence includes the prior odds against the added effect. The errors are those on training and on validation runs.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fieldsid.diagnosis.evidence.scored_model import ScoredModel
from fieldsid.diagnosis.records import Errors
from fieldsid.diagnosis.thresholds import (
    BELIEVED_SHARE_OF_MISFIT,
    EQUAL_ERROR_RATIO,
    EXPLAINED_ERROR_RATIO,
    LEAST_EXPLAINED_SHARE,
    MAIN_EXPLAINED_SHARE,
    MAX_ERROR_RATIO,
    MIN_TRAINING_GAIN,
    SUFFICIENT_ERROR_RATIO,
)
from fieldsid.models.model import Noise
from fieldsid.numerics.arrays import FloatArray


def is_accepted(
    without: ScoredModel, with_: ScoredModel, floor: Noise | None = None, least: float = SUFFICIENT_ERROR_RATIO
) -> bool:  # fmt: skip
    """Whether an addition gains log evidence and lowers the error, see `lowers_error`."""
    return gains_evidence(without, with_) and lowers_error(without, with_, floor, least)


def lowers_error(
    without: ScoredModel, with_: ScoredModel, floor: Noise | None = None, least: float = SUFFICIENT_ERROR_RATIO
) -> bool:  # fmt: skip
    """Whether an addition clearly lowers the training or the validation error, and their product, and does not raise the latter.

    One of the two errors is enough. A mild validation run may not excite the effect, and the training error without the effect
    may be low because the other parameters are biased towards the training runs. Near the noise floor no effect can lower the
    whole error much; there the effect may instead explain most of the squared error above the floor, provided that some run
    without it has more than `least` times the floor. A validation error at which a model is sufficient is no argument against the
    effect: the run is too mild to show it. The validation error is that of `compared_errors`.
    """
    before, now = compared_errors(without, with_)
    was, left = fitted_errors(without, with_)
    unseen, fitted = now.mean / before.mean, left.mean / was.mean
    lowers = min(unseen, fitted) < MAX_ERROR_RATIO and unseen * fitted < 1.0
    explains = floor is not None and _explains_most((before, was), (now, left), floor, least)
    mild = floor is not None and now.over(floor) <= SUFFICIENT_ERROR_RATIO
    believed = floor is None or _explains_beyond_misfit((before, was), (now, left), floor)
    return believed and (mild or _does_not_raise(before, now)) and (lowers or explains)


def compared_errors(without: ScoredModel, with_: ScoredModel) -> tuple[Errors, Errors]:
    """Return the validation errors by which two models are compared.

    Each model is compared by the lower of its errors at the training runs' parameters and at those estimated from all runs.
    Training runs may leave a parameter undetermined that one validation run determines, such as the deviation of a compass on
    headings that were not flown. The constant moments that differ from run to run have in both models the standard deviation
    that the model with more evidence estimates, because an effect that one model lacks is not a trim that differs from run to
    run.
    """
    std = common_own_moment(without, with_)
    before, now = (min(h.unseen_under(std), key=lambda errors: errors.mean) for h in (without, with_))
    return before, now


def fitted_errors(without: ScoredModel, with_: ScoredModel) -> tuple[Errors, Errors]:
    """Return the errors of two models on the training runs, with the moment of each run as in `compared_errors`."""
    std = common_own_moment(without, with_)
    return without.train_under(std), with_.train_under(std)


def common_own_moment(without: ScoredModel, with_: ScoredModel) -> float:
    """Return the standard deviation (rad/s^2) of the moments of the runs that the model with more evidence of two estimates."""
    return max((without, with_), key=lambda h: h.log_evidence).own_moment


def _explains_most(before: Sequence[Errors], now: Sequence[Errors], floor: Noise, least: float) -> bool:
    """Whether an addition removes most of the squared error above a noise floor on training and validation runs together.

    It must also remove LEAST_EXPLAINED_SHARE of that on the validation runs, since an effect of the vehicle acts in all runs.
    Some run without it must have an error above `least` times the floor.
    """
    was, left = (_excess(side, floor) for side in (before, now))
    leaves = max(run.over(floor) for errors in before for run in errors.runs) > least
    shown = before[0].over(floor) <= EXPLAINED_ERROR_RATIO or was[0] - left[0] > LEAST_EXPLAINED_SHARE * was[0]
    return bool(leaves and shown and was.sum() - left.sum() > MAIN_EXPLAINED_SHARE * was.sum())


def _excess(side: Sequence[Errors], floor: Noise) -> FloatArray:
    """Return the excess (m,) of m squared errors over a squared noise floor, in units of it; zero below it."""
    return np.array([max(errors.over(floor) ** 2 - 1.0, 0.0) for errors in side])


def _explains_beyond_misfit(before: Sequence[Errors], now: Sequence[Errors], floor: Noise) -> bool:
    """Whether an addition explains enough compared with the misfit that the model still has with it, where that is visible.

    Any effect that varies in time can fit a part of the misfit of a wrong hull. So an effect is believed only for what it
    explains beyond the misfit that remains. On the fitted runs the smaller of the two errors counts as the misfit: for a vehicle
    that is hardly stable, the likelihood weighs one-step predictions, so that an addition may raise the free-run error there.
    """
    least = now[0], min(before[1], now[1], key=lambda errors: errors.over(floor))
    was, left = (float(_excess(side, floor).mean()) for side in (before, least))
    visible = any(errors.over(floor) > SUFFICIENT_ERROR_RATIO for errors in now)
    return not visible or was - left > BELIEVED_SHARE_OF_MISFIT * left


def excess_share(before: Sequence[Errors], now: Sequence[Errors], floor: Noise) -> float:
    """Return the share (0..1) by which the excess squared error over a noise floor falls, over all runs together."""
    runs = [len(errors.runs) for errors in before]
    base, left = (float(np.average([errors.over(floor) ** 2 for errors in side], weights=runs)) for side in (before, now))
    excess = base - 1.0
    return float(np.clip((base - left) / excess, 0.0, 1.0)) if excess > 1e-6 else 0.0


def keeps_error(without: ScoredModel, with_: ScoredModel) -> bool:
    """Whether an addition does not raise the validation error, at the training runs' parameters or at those of all runs."""
    return _does_not_raise(*compared_errors(without, with_))


def _does_not_raise(before: Errors, now: Errors) -> bool:
    return bool(now.mean < EQUAL_ERROR_RATIO * before.mean)


def errs_less(h: ScoredModel, other: ScoredModel, ratio: float) -> bool:
    """Whether a model's errors on training and on validation runs are below `ratio` times those of another."""
    pairs = ((h.train, other.train), (h.selection_errors, other.selection_errors))
    return all(mine.mean < ratio * others.mean for mine, others in pairs)


def gains_training_evidence(without: ScoredModel, with_: ScoredModel) -> bool:
    """Whether an addition gains log evidence on the training runs alone, enough to be tried further."""
    return with_.log_likelihood - without.log_likelihood > with_.trial_penalty - without.trial_penalty


def worst_error(h: ScoredModel, floor: Noise) -> float:
    """Return the error over a noise floor on the validation or on the training runs, whichever is larger."""
    return max(h.selection_errors.over(floor), h.train.over(floor))


def compared_error(base: ScoredModel, h: ScoredModel, floor: Noise) -> float:
    """Return the larger error over a noise floor on unseen and on fitted runs, as in the comparison of a model with the base."""
    return max(compared_errors(base, h)[1].over(floor), fitted_errors(base, h)[1].over(floor))


def compared_share(base: ScoredModel, h: ScoredModel, floor: Noise) -> float:
    """Return the share (0..1) of the base's excess squared error that a model explains, with the errors of `compared_error`."""
    pairs = compared_errors(base, h), fitted_errors(base, h)
    return excess_share([was for was, _ in pairs], [left for _, left in pairs], floor)


def leaves_error(h: ScoredModel, floor: Noise) -> bool:
    """Whether the error of a model exceeds the noise floor, from whatever cause."""
    return worst_error(h, floor) > EXPLAINED_ERROR_RATIO


def gains_evidence(without: ScoredModel, with_: ScoredModel) -> bool:
    """Whether an addition gains log evidence over all runs, whatever happens to the free-run error."""
    if _adds_run_parameters(without, with_) and not with_.log_likelihood - without.log_likelihood > MIN_TRAINING_GAIN:
        return False
    return with_.log_evidence > without.log_evidence


def _adds_run_parameters(without: ScoredModel, with_: ScoredModel) -> bool:
    """Whether an addition has parameters for each run: a nuisance coefficient or the start of a hidden state."""
    known = {e.name for e in without.effects}
    return any(e.nuisance or e.extra_states for e in with_.effects if e.name not in known)


def gains_any_evidence(without: ScoredModel, with_: ScoredModel) -> bool:
    """Whether an addition gains log evidence on the training runs alone or over all runs."""
    return gains_training_evidence(without, with_) or gains_evidence(without, with_)


def validation_error_ratio(h: ScoredModel, floor: Noise) -> float:
    """Return validation error over training error; 1 where there are no validation runs."""
    return h.validation_errors.over(floor) / max(h.train.over(floor), 1.0) if h.validation else 1.0
