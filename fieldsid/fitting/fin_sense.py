"""The sign of the fin's authority by regression, where the estimate of a fit does not differ significantly from zero.

The equation of motion, integrated over short windows, is a regression with few columns besides the fin. It determines the sign
of the authority where a model with many effects does not. Its residuals are correlated from window to window; the variance is
enlarged for that. A run whose fin a controller moves is left out: there the fin follows the motion.
"""

from __future__ import annotations

import numpy as np

from fieldsid.fitting.checks.authority_checks import MIN_STD_ERRORS
from fieldsid.fitting.checks.closed_loop import closed_loop_note
from fieldsid.fitting.initial.equation_error import integrated_windows
from fieldsid.fitting.problem.estimator import Solution
from fieldsid.fitting.problem.problem import Problem
from fieldsid.models.axis import NAMES
from fieldsid.models.record import Record

MAX_RHO = 0.999


def fin_sense(problem: Problem, solution: Solution) -> dict[str, float]:
    """Return `fin_t`, the t-value of the fin's coefficient in the regression; empty where the fit's own authority is significant.

    It pools the runs in which no controller moves the fin, and has the sign of the authority.
    """
    layout, name = problem.layout, NAMES[problem.layout.axis].authority
    authorities = [i for i, n in enumerate(layout.names[: layout.shared]) if n == name or n.startswith(f"{name}@")]
    errors = np.sqrt(np.maximum(np.diag(solution.covariance)[authorities], 0.0))
    if bool(np.all(np.abs(solution.x[authorities]) >= MIN_STD_ERRORS * errors)):
        return {}
    found = [_t_value(r, stiff=NAMES[layout.axis].stiffness is not None) for r in problem.records]
    finite = [t for t in found if np.isfinite(t)]
    return {"fin_t": float(np.sum(finite) / np.sqrt(len(finite)))} if finite else {}


def _t_value(record: Record, *, stiff: bool) -> float:
    if any(closed_loop_note(record)):
        return float("nan")
    block, target = integrated_windows(record, record.commanded, stiff=stiff)
    used = block if stiff else np.delete(block, 1, axis=1)
    size = np.linalg.norm(used, axis=0)
    if target.size <= used.shape[1] + 1 or not np.all(np.isfinite(size)) or not np.all(size > 0.0):
        return float("nan")
    scaled = used / size
    solution, _, rank, _ = np.linalg.lstsq(scaled, target, rcond=1e-10)
    residual = target - scaled @ solution
    power = float(residual @ residual)
    if rank < used.shape[1] or not power > 0.0:
        return float("nan")
    rho = min(max(float(residual[1:] @ residual[:-1]) / power, 0.0), MAX_RHO)
    variance = np.linalg.inv(scaled.T @ scaled)[-2, -2] * power / target.size * (1.0 + rho) / (1.0 - rho)
    return float(solution[-2] / np.sqrt(variance))
