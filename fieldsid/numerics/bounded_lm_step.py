"""One Levenberg-Marquardt step within bounds, from normal equations."""

from __future__ import annotations

import numpy as np
from scipy.linalg.lapack import dposv

from fieldsid.errors import DivergenceError
from fieldsid.numerics.arrays import FloatArray


def bounded_step(
    normal: FloatArray, gradient: FloatArray, damping: float | FloatArray, x: FloatArray, low: FloatArray, high: FloatArray
) -> FloatArray:
    """Return the step (F,) from a normal matrix (F, F) and the gradient (F,) in the direction of improvement.

    damping, one number or (F,), is relative to the diagonal of the normal matrix. A parameter does not move where it is at a
    bound and would leave it, or has no information. One that would cross a bound stops there, and the others are solved for given
    that. Raises DivergenceError where the equations are not finite. Source: Marquardt 1963, SIAM J. 11(2).
    """
    diagonal = normal.diagonal()
    scale = np.sqrt(np.maximum(diagonal, 1e-30))
    free = ~(((x <= low) & (gradient < 0)) | ((x >= high) & (gradient > 0)) | (diagonal < 1e-24))
    scaled = normal / scale / scale[:, None]
    scaled.ravel()[:: x.size + 1] += damping
    step = np.zeros_like(x)
    while free.any():
        if free.all():
            step = _solve(scaled, gradient / scale) / scale
        else:
            target = (gradient[free] - normal[free][:, ~free] @ step[~free]) / scale[free]
            step[free] = _solve(scaled[free][:, free], target) / scale[free]
        end = x + step
        if not np.isfinite(end).all():
            raise DivergenceError(
                "a fit came to a step that is no number",
                found=f"{int((~np.isfinite(end)).sum())} of {end.size} numbers that are fitted have none to go to",
                hint="look at the logs with `sysid inspect LOG`: a sign or a unit that is wrong makes a vehicle that runs away",
            )
        beyond = np.maximum(end - high, low - end) * scale * free
        worst = int(np.argmax(beyond))
        if beyond[worst] <= 0.0:
            break
        step[worst], free[worst] = min(max(end[worst], low[worst]), high[worst]) - x[worst], False
    return step


def _solve(matrix: FloatArray, right: FloatArray) -> FloatArray:
    _, solution, failed = dposv(matrix, right)
    if not failed:
        return np.asarray(solution)
    try:
        return np.asarray(np.linalg.solve(matrix, right))
    except np.linalg.LinAlgError:
        return np.asarray(np.linalg.lstsq(matrix, right, rcond=None)[0])
