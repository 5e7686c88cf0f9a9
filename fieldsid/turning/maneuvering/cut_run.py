"""A run cut into segments (multiple shooting, Bock 1983), and how far a vector of coefficients is from it.

Every run has its straight speed and the biases of its rate and sway, every segment the state that it begins with, so that a
hull without stability of course is fitted as well.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fieldsid.numerics.arrays import FloatArray
from fieldsid.numerics.jit import jit
from fieldsid.turning.maneuvering.equations import longest_step, simulate
from fieldsid.turning.maneuvering.flown import HEADING, RATE, STATE_SD, SURGE, SWAY, FlownRun
from fieldsid.turning.steady.transient import LEAST_SURGE_M_S

OWN = 3
"""Nuisances of a run before its segments': straight speed, bias of the rate, bias of the sway."""
SWAY_BIAS_SD = 0.02
"""m/s: what a Doppler log may be off by across the hull."""
LARGEST_RESIDUAL = 1e6
"""Weighted residuals are clipped here where a simulation has left the water."""


@dataclass(frozen=True, slots=True)
class CutRun:
    """A run whose segments begin at samples `begins` (m,), the nuisances (3 + 3 m,) measured there, one over their spread.

    `longest` is the longest time step, s.
    """

    run: FlownRun
    begins: npt.NDArray[np.int64]
    first: FloatArray
    weight: FloatArray
    longest: float

    def misfit(self, p: FloatArray, local: FloatArray) -> FloatArray:
        """Return measured less simulated (4, n) with coefficients p and nuisances `local`, NaN where nothing was measured."""
        run, states = self.run, local[OWN:].reshape(-1, 3)
        straight = max(float(local[0]), LEAST_SURGE_M_S)
        out = simulate(p, straight, states, self.begins, run.time, run.fin, run.thrust, self.longest)
        out[RATE] += local[1]
        out[HEADING] += local[1]
        out[SWAY] += local[2]
        return np.asarray(run.measured - out)

    def residual(self, p: FloatArray, local: FloatArray, noise: FloatArray) -> FloatArray:
        """Return the weighted residuals (4, n), zero where nothing was measured; `noise` (4,)."""
        spread = np.hypot(noise, self.run.discrepancy)
        weighted = np.nan_to_num(self.misfit(p, local) / spread[:, None], nan=LARGEST_RESIDUAL)
        return np.where(np.isfinite(self.run.measured), np.clip(weighted, -LARGEST_RESIDUAL, LARGEST_RESIDUAL), 0.0)

    def away(self, local: FloatArray) -> FloatArray:
        """Return the weighted distances of the nuisances from what was measured of them, (3 + 3 m,)."""
        return np.asarray((local - self.first) * self.weight)

    def cost(self, p: FloatArray, local: FloatArray, noise: FloatArray) -> float:
        """Return the sum of the squares of both."""
        away = self.away(local)
        spread = np.hypot(noise, self.run.discrepancy)
        return float(away @ away) + float(_square_sum(self.misfit(p, local), self.run.measured, spread))


@jit
def _square_sum(misfit: FloatArray, measured: FloatArray, spread: FloatArray) -> float:
    """Return the sum of the residuals' squares; a simulation that ends in a NaN is as bad as any can be."""
    total = 0.0
    for i in range(misfit.shape[0]):
        for j in range(misfit.shape[1]):
            if math.isfinite(measured[i, j]):
                size = abs(misfit[i, j]) / spread[i]
                total += min(size, LARGEST_RESIDUAL) ** 2 if math.isfinite(size) else LARGEST_RESIDUAL**2
    return total


def cut_run(run: FlownRun, segment_s: float, length: float) -> CutRun:
    """Return a run cut into segments of about `segment_s`, of a vehicle about `length` m long."""
    begins = run.begins(segment_s)
    states = np.zeros((begins.size, 3))
    for i, begin in enumerate(begins):
        near = slice(max(begin - 2, 0), begin + 3)
        for j, channel in enumerate((SURGE, SWAY, RATE)):
            values = run.measured[channel, near]
            if np.isfinite(values).any():
                states[i, j] = np.mean(values[np.isfinite(values)])
            elif channel == SURGE:
                states[i, j] = run.speed
    spread = np.concatenate([[run.speed_sd, run.rate_bias_sd, SWAY_BIAS_SD], np.full(states.size, STATE_SD)])
    return CutRun(
        run, begins, np.concatenate([[run.speed, 0.0, 0.0], states.ravel()]), 1.0 / spread, longest_step(length, run.speed)
    )
