"""Standard errors of free-run least squares when the residuals are not white.

With normal matrix N = sum J' W J and residual covariance S the estimate's covariance is N^-1 (J' W S W J) N^-1. S is the
covariance of the fitted noise model (AR(1) moment through the base dynamics, AR(1) sensor noise, white noise). The middle factor
is computed exactly by the adjoint of the noise's state recursion, without assuming stationarity.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from fieldsid.models.record import Record
from fieldsid.noise.kalman.transition import transition
from fieldsid.noise.whiten import base_dynamics
from fieldsid.numerics.arrays import FloatArray
from fieldsid.numerics.jit import jit


@jit
def score_covariance_kernel(
    steps: FloatArray,
    ok: npt.NDArray[np.bool_],
    a: float,
    k: float,
    noise: FloatArray,
    weighted: FloatArray,
    out: FloatArray,
) -> None:
    """Add J' W S W J of one run to out (P, P); weighted (P, 2, n) is W J."""
    count, n = weighted.shape[0], weighted.shape[2]
    adjoint = np.zeros((count, 5))
    nxt = np.zeros(5)
    for i in range(n - 1, -1, -1):
        if i < n - 1:
            h = steps[i]
            yy, yp, py, pp, wy, wp = transition(a, k, h)
            rho, col = np.exp(-h / noise[3]), np.exp(-h / noise[6])
            q2 = noise[2] ** 2 * (1.0 - rho * rho)
            q3 = noise[4] ** 2 * (1.0 - col * col)
            q4 = noise[5] ** 2 * (1.0 - col * col)
            for j in range(count):
                for l in range(j + 1):
                    out[j, l] += (
                        q2 * adjoint[j, 2] * adjoint[l, 2]
                        + q3 * adjoint[j, 3] * adjoint[l, 3]
                        + q4 * adjoint[j, 4] * adjoint[l, 4]
                    )
            for j in range(count):
                s = adjoint[j]
                nxt[0] = yy * s[0] + py * s[1]
                nxt[1] = yp * s[0] + pp * s[1]
                nxt[2] = wy * s[0] + wp * s[1] + rho * s[2]
                nxt[3] = col * s[3]
                nxt[4] = col * s[4]
                for l in range(5):
                    adjoint[j, l] = nxt[l]
        for ch in range(2):
            if not ok[ch, i]:
                continue
            for j in range(count):
                g = weighted[j, ch, i]
                adjoint[j, ch] += g
                adjoint[j, ch + 3] += g
                for l in range(j + 1):
                    out[j, l] += noise[ch] ** 2 * g * weighted[l, ch, i]
    for j in range(count):
        for l in range(j + 1):
            out[j, l] += (
                noise[2] ** 2 * adjoint[j, 2] * adjoint[l, 2]
                + noise[4] ** 2 * adjoint[j, 3] * adjoint[l, 3]
                + noise[5] ** 2 * adjoint[j, 4] * adjoint[l, 4]
            )


def score_covariance(record: Record, noise: FloatArray, damping: float, stiffness: float, weighted: FloatArray) -> FloatArray:
    """Return J' W S W J (P, P) of one run for weighted sensitivities W J (P, 2, n) under a noise vector (7,)."""
    out = np.zeros((weighted.shape[0], weighted.shape[0]))
    score_covariance_kernel(
        record.nominal_steps, record.ok, *base_dynamics(damping, stiffness), noise,
        np.ascontiguousarray(weighted), out,
    )  # fmt: skip
    return np.asarray(out + np.tril(out, -1).T)
