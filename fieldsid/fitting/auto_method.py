"""The "auto" rule: prediction error under a disturbance, output error under white noise or a missing effect.

Prediction error attributes slow residuals to a disturbance and gives them little weight. Where a missing effect causes the slow
residuals, its free run is therefore worse than that of output error.
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
"""p-value of a test below which the residuals are not a disturbance alone: half the level, as there are two tests."""
MAX_FREE_RUN_RATIO = 1.5
"""Largest ratio of prediction error's free-run error to output error's at which prediction error is taken though a test rejects.

Where the model lacks a lag or sway and there is no sea, the ratio is 2.6 to 31 (18 simulated flights). Where the model is nearly
exact, on pulses and zig-zags of a vehicle of six degrees of freedom, it is 1.0 to 1.4; prediction error then predicts the
response to full rudder within 4 %, output error within 12 %.
"""

EDGE = 0.01
"""Relative distance from a bound of its range within which a correlation time counts as on that bound."""


@dataclass(frozen=True, slots=True)
class FreeRun:
    """Error of a free run with fitted initial states: over the error of output error, and over the motion about its mean."""

    over_output_error: float
    over_motion: float


def choose(problem: Problem, output_error: Solution, refine: Callable[[], Solution]) -> Solution:
    """Return the solution of output error, or of prediction error where the residuals show a disturbance, with a note why.

    `refine` computes the prediction-error solution; it is called only where the residuals show a disturbance. That solution is
    taken where its residuals pass both tests for a disturbance. Where they fail one, the model is not exact, and it is taken only
    where its free run is little worse than output error's: prediction error gives little weight to the slow motion, in which the
    effect of a missing term builds up. It is never taken where its free run is no nearer to the motion than the motion's mean is.
    """
    if not output_error.noise.disturbance > 0.0:
        return output_error
    refined = refine()
    free = _free_run(problem, output_error.x, refined.x, white_weights(problem, output_error.x))
    if free is None:
        return _with_reason(output_error, "output error: the free run of prediction error grows without bound", {})
    agreement_p = agreement(problem, refined.x, refined.noise)
    independence_p = independence(problem, refined.x, refined.noise)
    data = {
        "agreement_p": agreement_p,
        "independence_p": independence_p,
        "limit": MIN_P_VALUE,
        "free_run_ratio": free.over_output_error,
    }
    times = f"the free-run error of prediction error is {free.over_output_error:.3g} times that of output error"
    if free.over_motion >= 1.0:
        why = f"the free run of prediction error is {free.over_motion:.3g} times as far off as the motion's own mean"
        return _with_reason(output_error, f"output error: {why}", data | {"mean_ratio": free.over_motion})
    if min(agreement_p, independence_p) >= MIN_P_VALUE:
        why = f"a disturbance explains where it differs from output error ({p_value(min(agreement_p, independence_p))})"
        return _with_reason(refined, f"prediction error: {why}; {times}", data)
    if independence_p < MIN_P_VALUE:
        why = f"what prediction error leaves follows fin and motion ({p_value(independence_p)}), so an effect may be missing"
    else:
        why = f"prediction error differs by more than its disturbance explains ({p_value(agreement_p)})"
    data |= {"ratio_limit": MAX_FREE_RUN_RATIO, "disturbance_time_s": refined.noise.disturbance_time}
    if not _is_time_resolved(refined.noise):
        why += f", and no disturbance of {refined.noise.disturbance_time:.2g} s is resolved"
    elif free.over_output_error <= MAX_FREE_RUN_RATIO:
        return _with_reason(refined, f"prediction error: {why}, but {times}", data)
    return _with_reason(output_error, f"output error: {why}; {times}", data)


def _is_time_resolved(noise: Noise) -> bool:
    """Whether the correlation time of the disturbance lies inside its range and not on a bound."""
    bounds = NOISE_PARAMETERS["disturbance_time"]
    return bounds.low * (1.0 + EDGE) < noise.disturbance_time < bounds.high * (1.0 - EDGE)


def best_start(problem: Problem, x: FloatArray, weights: Noise) -> FloatArray:
    """Return x with every run's nuisance parameters fitted to the free run."""
    for run in range(len(problem.records)):
        x = refit_nuisances(problem, x, run, weights)
    return x


def _free_run(problem: Problem, output_error: FloatArray, refined: FloatArray, weights: Noise) -> FreeRun | None:
    """Return the error of the free run at x `refined`, relative to that at `output_error`; None where it is unbounded."""
    try:
        x = best_start(problem, refined, weights)
        cost = cost_of(problem, x, weights)
    except (ModelError, EffectError):
        return None
    if not np.isfinite(cost):
        return None
    squares, _ = squares_of(problem, x)
    channel = 1 if any(r.rate_ok.any() for r in problem.records) else 0
    measured = [r.both[channel][r.ok[channel]] for r in problem.records if r.ok[channel].any()]
    motion = sum(float(np.sum((y - y.mean()) ** 2)) for y in measured)
    return FreeRun(float(np.sqrt(cost / cost_of(problem, output_error, weights))), float(np.sqrt(squares[channel] / motion)))


def _with_reason(solution: Solution, reason: str, data: dict[str, float]) -> Solution:
    return replace(solution, notes=(*solution.notes, Note(METHOD_CHOSEN, f"`auto` took {reason}", data)))
