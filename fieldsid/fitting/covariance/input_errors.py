"""The covariance that the errors of smoothed inputs add: a surge, a depth or a thrust is measured, and has noise as well.

The smoothed input differs from the true one by d, of the smoother's covariance, and the measured motion y from that of the model
by S d, which is in the residual in addition to the noise. To the first order the estimate moves by
    N^-1 J' W S d,    N = J' W J,
with the Jacobian J and the weights W of the estimate. As d is independent of the smoothed input it does not attenuate (Berkson's
case). The covariance of output error takes that of the residual, and has S d with it; that of prediction error holds for the
noise of its filter, which knows nothing of the motion that S d goes with. Random errors are drawn for each run. Source: Carroll,
Ruppert, Stefanski and Crainiceanu 2006, Measurement Error in Nonlinear Models, section 1.4.
"""

from __future__ import annotations

from dataclasses import replace
from types import MappingProxyType

import numpy as np

from fieldsid.fitting.optimise.levenberg_marquardt import normal_equations, sandwich
from fieldsid.fitting.problem.estimator import Solution
from fieldsid.fitting.problem.problem import Problem, RunResult
from fieldsid.models.model import Noise
from fieldsid.noise.whiten import whiten
from fieldsid.numerics.arrays import FloatArray

DRAWS = 32
"""Random errors of an input: a standard error is then known to an eighth."""


def with_input_errors(problem: Problem, solution: Solution) -> Solution:
    """Return a solution whose covariance is widened by the errors of its effects' inputs; that of output error is as it was."""
    count, weights = problem.layout.shared, solution.weights
    wanted = {role for e in problem.layout.effects for role in e.needs}
    if weights is None or not any(wanted & set(r.smoothers) for r in problem.records):
        return solution
    known = np.flatnonzero(np.diag(solution.covariance) > 0.0)
    free = (*known.tolist(), *range(count, len(solution.x)))
    _, normal, _, results = normal_equations(problem, solution.x, weights, free)
    centre, place = np.zeros_like(normal), {slot: i for i, slot in enumerate(free)}
    for run, result in enumerate(results):
        for role in sorted(wanted & set(problem.records[run].smoothers)):
            index = np.array([place[s] for s in result.columns], dtype=np.intp)
            centre[np.ix_(index, index)] += _score_covariance(problem, solution.x, run, role, result, weights)
    added, total = sandwich(normal, centre)[: known.size, : known.size], solution.covariance.copy()
    total[np.ix_(known, known)] += added
    return replace(solution, covariance=total)


def _score_covariance(problem: Problem, x: FloatArray, run: int, role: str, result: RunResult, weights: Noise) -> FloatArray:
    """Return the covariance (P, P) of J' W S d of one run for the errors d of one input."""
    record = problem.records[run]
    changes = []
    for error in record.smoothers[role].errors(len(record), DRAWS):
        signals = MappingProxyType({**record.signals, role: record.signals[role] + error})
        records = tuple(replace(r, signals=signals) if i == run else r for i, r in enumerate(problem.records))
        residual, _ = replace(problem, records=records).residual(x, run)
        changes.append(result.residual - residual)
    size = result.sensitivity.shape[0]
    stack = np.concatenate([result.sensitivity, changes])
    white, _ = whiten(record, weights, result.base.damping, result.base.stiffness, stack)
    flat = white.reshape(white.shape[0], -1)
    score = flat[:size] @ flat[size:].T
    return np.asarray(score @ score.T / DRAWS)
