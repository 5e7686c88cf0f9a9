"""The "auto" rule: prediction error under a disturbance, output error under white noise or a missing effect.

Prediction error takes slow residuals for a disturbance and trusts them little. Where a missing effect causes them it
gives the worse free run.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from fieldsid.errors import EffectError, ModelError
from fieldsid.fitting.checks.warnings import METHOD_CHOSEN
from fieldsid.fitting.optimise.levenberg_marquardt import cost_of
from fieldsid.fitting.optimise.residual_weights import squares_of, white_weights
from fieldsid.fitting.predict.predict import refit_nuisances
from fieldsid.fitting.problem.estimator import Solution
from fieldsid.fitting.problem.problem import Problem
from fieldsid.fitting.specification import agreement, independence
from fieldsid.logs.run import Note
from fieldsid.models.model import Noise
from fieldsid.noise.noise_kinds import NOISE_PARAMETERS
from fieldsid.numerics.arrays import FloatArray
from fieldsid.numerics.ljung_box import MIN_WHITENESS_P
from fieldsid.rounding import p_value

MIN_P_VALUE = MIN_WHITENESS_P / 2.0
"""p-value below which what is left is no disturbance: there are two tests."""
MAX_FREE_RUN_RATIO = 1.5
"""Free-run error of prediction error over that of output error, beyond which it is not taken where a test rejects.

With a lag or a sway hidden and no sea the ratio is 2.6 to 31 (18 simulated flights). With a model that is nearly exact, on
pulses and zig-zags of a vehicle of six degrees of freedom, it is 1.0 to 1.4, and full rudder is then foretold within 4 % by
prediction error, within 12 % by output error.
"""

EDGE = 0.01
"""Relative distance from an end of its range within which a correlation time counts as at that end."""


@dataclass(frozen=True, slots=True)
class FreeRun:
    """How far off a free run is, its start fitted: over output error's, and over the motion about its mean."""

    over_plain: float
    over_motion: float


def choose(problem: Problem, plain: Solution, refine: Callable[[], Solution]) -> Solution:
    """Return output error's solution, or the one it is refined to where residuals show a disturbance, with the reason as a note.

    The other is not even sought where the residuals show none. It is taken where what it leaves is a disturbance, and where a
    model that is not exact makes its free run little worse: it weights the slow motion less, where what is missing has time
    to build up. A right model's free run is nearer to the motion than the motion's own mean, whatever disturbs it.
    """
    if not plain.noise.disturbance > 0.0:
        return plain
    refined = refine()
    free = _free_run(problem, plain.x, refined.x, white_weights(problem, plain.x))
    if free is None:
        return _with_reason(plain, "output error: the free run of prediction error grows without bound", {})
    agreement_p = agreement(problem, refined.x, refined.noise)
    independence_p = independence(problem, refined.x, refined.noise)
    known = {
        "agreement_p": agreement_p,
        "independence_p": independence_p,
        "limit": MIN_P_VALUE,
        "free_run_ratio": free.over_plain,
    }
    times = f"the free-run error of prediction error is {free.over_plain:.3g} times that of output error"
    if free.over_motion >= 1.0:
        why = f"the free run of prediction error is {free.over_motion:.3g} times as far off as the motion's own mean"
        return _with_reason(plain, f"output error: {why}", known | {"mean_ratio": free.over_motion})
    if min(agreement_p, independence_p) >= MIN_P_VALUE:
        why = f"a disturbance explains where it differs from output error ({p_value(min(agreement_p, independence_p))})"
        return _with_reason(refined, f"prediction error: {why}; {times}", known)
    if independence_p < MIN_P_VALUE:
        why = f"what prediction error leaves follows fin and motion ({p_value(independence_p)}), so an effect may be missing"
    else:
        why = f"prediction error differs by more than its disturbance explains ({p_value(agreement_p)})"
    known |= {"ratio_limit": MAX_FREE_RUN_RATIO, "disturbance_time_s": refined.noise.disturbance_time}
    if not _has_own_time(refined.noise):
        why += f", and no disturbance of {refined.noise.disturbance_time:.2g} s is resolved"
    elif free.over_plain <= MAX_FREE_RUN_RATIO:
        return _with_reason(refined, f"prediction error: {why}, but {times}", known)
    return _with_reason(plain, f"output error: {why}; {times}", known)


def _has_own_time(noise: Noise) -> bool:
    """Whether the correlation time of the disturbance is inside the range looked through, not at its end."""
    bounds = NOISE_PARAMETERS["disturbance_time"]
    return bounds.low * (1.0 + EDGE) < noise.disturbance_time < bounds.high * (1.0 - EDGE)


def best_start(problem: Problem, x: FloatArray, weights: Noise) -> FloatArray:
    """Return x with every run's nuisances at their best for the free run."""
    for run in range(len(problem.records)):
        x = refit_nuisances(problem, x, run, weights)
    return x


def _free_run(problem: Problem, plain: FloatArray, refined: FloatArray, weights: Noise) -> FreeRun | None:
    """Return how far off the free run at a refined x is, None where it has no bound."""
    try:
        x = best_start(problem, refined, weights)
        cost = cost_of(problem, x, weights)
    except (ModelError, EffectError):
        return None
    if not np.isfinite(cost):
        return None
    squares, _ = squares_of(problem, x)
    channel = 1 if any(r.rate_ok.any() for r in problem.records) else 0
    about = [r.both[channel][r.ok[channel]] for r in problem.records if r.ok[channel].any()]
    motion = sum(float(np.sum((y - y.mean()) ** 2)) for y in about)
    return FreeRun(float(np.sqrt(cost / cost_of(problem, plain, weights))), float(np.sqrt(squares[channel] / motion)))


def _with_reason(solution: Solution, words: str, data: dict[str, float]) -> Solution:
    return replace(solution, notes=(*solution.notes, Note(METHOD_CHOSEN, f"`auto` took {words}", data)))
