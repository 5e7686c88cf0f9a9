"""Which way the fin turns the vehicle, where the authority of a fit cannot be told from zero.

The equation of motion integrated over short windows has the fin's coefficient between few others: it tells the sign where a
model with many effects leaves the authority open. Its errors are correlated from window to window, and counted as the fewer
that they are. A fin that a controller moves follows the motion, and tells nothing here.
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
    """Return `fin_t`, how many standard errors the fin's coefficient is from nil; nothing where an authority is clear itself.

    `fin_t` is that of the regression over all runs in which no controller moves the fin, with the sign of the authority.
    """
    layout, name = problem.layout, NAMES[problem.layout.axis].authority
    own = [i for i, n in enumerate(layout.names[: layout.shared]) if n == name or n.startswith(f"{name}@")]
    errors = np.sqrt(np.maximum(np.diag(solution.covariance)[own], 0.0))
    if bool(np.all(np.abs(solution.x[own]) >= MIN_STD_ERRORS * errors)):
        return {}
    found = [_t_value(r, stiff=NAMES[layout.axis].stiffness is not None) for r in problem.records]
    told = [t for t in found if np.isfinite(t)]
    return {"fin_t": float(np.sum(told) / np.sqrt(len(told)))} if told else {}


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
    left = target - scaled @ solution
    power = float(left @ left)
    if rank < used.shape[1] or not power > 0.0:
        return float("nan")
    rho = min(max(float(left[1:] @ left[:-1]) / power, 0.0), MAX_RHO)
    variance = np.linalg.inv(scaled.T @ scaled)[-2, -2] * power / target.size * (1.0 + rho) / (1.0 - rho)
    return float(solution[-2] / np.sqrt(variance))
