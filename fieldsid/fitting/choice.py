"""The "auto" rule: prediction error under a disturbance, output error under white noise or a missing effect.

Prediction error takes slow residuals for a disturbance and trusts them little. Where a missing effect causes them it
gives the worse free run.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from fieldsid.errors import EffectError, ModelError
from fieldsid.fitting.descent import cost_of
from fieldsid.fitting.method import Solution
from fieldsid.fitting.notes import METHOD_CHOSEN
from fieldsid.fitting.predict import refit_own
from fieldsid.fitting.problem import Problem
from fieldsid.fitting.specification import agreement, foreseen, independence
from fieldsid.fitting.weights import squares_of, white_weights
from fieldsid.fitting.whiteness import WHITE_ENOUGH
from fieldsid.logs.run import FloatArray, Note
from fieldsid.models.model import Noise

LEAST = WHITE_ENOUGH / 2.0
"""p-value below which what is left is no disturbance: there are two tests."""
CLEAR = LEAST**2
"""The same of a test to first order only: its chance of being so low by itself is that of two such tests failing together."""


@dataclass(frozen=True, slots=True)
class FreeRun:
    """How far off a free run is, its start fitted: over output error's, and over the motion about its mean."""

    over_plain: float
    over_motion: float


def chosen(problem: Problem, plain: Solution, refine: Callable[[], Solution]) -> Solution:
    """Return output error's solution, or the one it is refined to where residuals show a disturbance, with the reason as a note.

    The other is not even sought where the residuals show none, or where what it would leave is so related to fin and motion
    that taking the equations as linear cannot have made it so.
    """
    if not plain.noise.disturbance > 0.0:
        return plain
    early = foreseen(problem, plain.x, plain.noise)
    if early < CLEAR:
        why = f"what prediction error would leave follows fin and motion (p = {early:.2g}), so an effect may be missing"
        return _told(plain, f"output error: {why}", {"independence_p": early, "limit": CLEAR})
    return _judged(problem, plain, refine())


def _judged(problem: Problem, plain: Solution, refined: Solution) -> Solution:
    """Return the refined solution where what it leaves is a disturbance, else the plain one.

    A right model's free run is nearer to the motion than the motion's own mean, whatever disturbs it: the disturbance is
    none of the fin's.
    """
    weights = white_weights(problem, plain.x)
    free = _free_run(problem, plain.x, refined.x, weights)
    if free is None:
        return _told(plain, "output error: the free run of prediction error grows without bound", {})
    alike = agreement(problem, refined.x, refined.noise)
    apart = independence(problem, refined.x, refined.noise)
    known = {"agreement_p": alike, "independence_p": apart, "limit": LEAST} | {"free_run_ratio": free.over_plain}
    times = f"the free-run error of prediction error is {free.over_plain:.3g} times that of output error"
    if apart < LEAST:
        why = f"what prediction error leaves follows fin and motion (p = {apart:.2g}), so an effect may be missing; {times}"
        return _told(plain, f"output error: {why}", known)
    if alike < LEAST:
        why = f"prediction error differs by more than its disturbance explains (p = {alike:.2g}); {times}"
        return _told(plain, f"output error: {why}", known)
    if free.over_motion >= 1.0:
        why = f"the free run of prediction error is {free.over_motion:.3g} times as far off as the motion's own mean"
        return _told(plain, f"output error: {why}", known | {"mean_ratio": free.over_motion})
    why = f"a disturbance explains where it differs from output error (p = {min(alike, apart):.2g}); {times}"
    return _told(refined, f"prediction error: {why}", known)


def best_start(problem: Problem, x: FloatArray, weights: Noise) -> FloatArray:
    """Return x with every run's own slots at their best for the free run."""
    for run in range(len(problem.records)):
        x = refit_own(problem, x, run, weights)
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


def _told(solution: Solution, words: str, data: dict[str, float]) -> Solution:
    return replace(solution, notes=(*solution.notes, Note(METHOD_CHOSEN, f"`auto` took {words}", data)))
