"""Recursive least squares on the filtered equation of motion, with forgetting: one sample in, the estimate out.

    g = P phi,  d = beta + phi' g,  e = q - phi' Theta,  Theta += g e / d,  P <- (P - g g' / d) / beta
with phi = [-p_f, -y_f, delta_f, 1_f] and q of the filtered equation. Rows count once the filter has forgotten its start.
Where nothing excites a direction P would grow as beta^-n: forgetting rests while P is at its start value.
Source: the paper, estimator 2 (recursive); Ljung 1999, section 11.2.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite, remainder, tau

import numpy as np

from fieldsid.fitting.state_filter import advance, hold_weights
from fieldsid.logs.run import FloatArray
from fieldsid.models.jit import jit

INITIAL = 1e6
"""Start of P (the paper: 100): with filtered rates near 0.1 rad/s a start of 100 pulls the estimate by up to 2 %."""
KNOWN_ENOUGH = 1e-2
"""Share of INITIAL below which all of P must be before the estimate is used for the curvature between samples."""
SAME_STEP = 1e-9
"""Share by which two sampling intervals may differ and still use the same filter weights."""
MEMORY = 27
(
    SAMPLES, TIME, FIRST_TIME, ANGLE, RATE, FIN_START, P1, P2, Y1, Y2, D1, D2, FADE, START, SQUARES, WEIGHT, WEIGHT2,
    LAST_ERROR, ERROR_POWER, ERROR_LAG, H, W0, W1, W2, W3, W4, TARGET,
) = range(MEMORY)  # fmt: skip


@jit
def _row(m: FloatArray, stiff: float, order: int, lam: float, angle: float, rate: float, phi: FloatArray) -> float:
    """Fill phi with the row of the filtered equation, and return its target."""
    span = lam * (m[TIME] - m[FIRST_TIME])
    j = 1
    if order == 1:
        phi[0] = -lam * m[P1]
        if stiff != 0.0:
            phi[1] = -lam * m[Y1]
            j = 2
        phi[j], phi[j + 1] = lam * m[D1], 1.0 - m[FADE]
        return float(lam * (rate - lam * m[P1] - m[START] * m[FADE]))
    start = m[START]
    known = start * m[FADE] * (1.0 - span)
    phi[0] = -lam * lam * (m[Y1] - lam * m[Y2] - start * span / lam * m[FADE])
    if stiff != 0.0:
        phi[1] = -lam * lam * m[Y2]
        j = 2
    phi[j], phi[j + 1] = lam * lam * m[D2], 1.0 - m[FADE] * (1.0 + span)
    return float(lam * lam * (angle - 2.0 * lam * m[Y1] + lam * lam * m[Y2] - known))


@jit
def _update(
    theta: FloatArray, big: FloatArray, phi: FloatArray, target: float, beta: float, gain: FloatArray
) -> tuple[float, float]:
    """Update Theta and P by one row; return the error before it and the share of it that is left after."""
    size = theta.shape[0]
    error, spread = target, beta
    for i in range(size):
        total = 0.0
        for j in range(size):
            total += big[i, j] * phi[j]
        gain[i] = total
        spread += phi[i] * total
        error -= phi[i] * theta[i]
    share, largest = 1.0 / spread, 0.0
    for i in range(size):
        part = gain[i] * share
        theta[i] += part * error
        for j in range(i + 1):
            big[i, j] -= part * gain[j]
            big[j, i] = big[i, j]
        largest = max(largest, big[i, i])
    if beta < 1.0 and largest < beta * INITIAL:
        raised = 1.0 / beta
        for i in range(size):
            for j in range(size):
                big[i, j] *= raised
    return error, beta / spread


@jit
def _known(big: FloatArray) -> bool:
    """Whether every direction has been excited enough to use the estimate."""
    for i in range(big.shape[0]):
        if big[i, i] > KNOWN_ENOUGH * INITIAL:
            return False
    return True


@jit
def _curvatures(
    theta: FloatArray, stiff: float, order: int, h: float, angle: float, last_angle: float, turn: float, start: float, end: float
) -> tuple[float, float]:
    """Return the curvature of angle and rate over an interval by the estimate so far; turn is the slope of the rate."""
    size = theta.shape[0]
    stiffness = theta[1] if stiff != 0.0 else 0.0
    slope = (angle - last_angle) / h
    if order == 1:
        return turn, -theta[0] * turn - stiffness * slope + theta[size - 2] * (end - start) / h
    push = theta[size - 2] * 0.5 * (start + end) + theta[size - 1]
    return -theta[0] * slope - stiffness * 0.5 * (angle + last_angle) + push, 0.0


@jit
def step(m: FloatArray, theta: FloatArray, big: FloatArray, work: FloatArray, settings: FloatArray, sample: FloatArray) -> float:
    """Take one sample [time, fin at the interval's start, at its end, angle, rate, counts]; return the error, NaN unused.

    settings are [lambda, beta, order, stiff]; work (2, 4) has room for phi and gain; m is the filter's memory.
    """
    lam, beta, order, stiff = settings[0], settings[1], int(settings[2]), settings[3]
    angle, rate = sample[3], sample[4]
    if m[SAMPLES] == 0.0:
        m[SAMPLES], m[TIME], m[FIRST_TIME], m[FADE] = 1.0, sample[0], sample[0], 1.0
        m[ANGLE], m[RATE] = angle, rate
        m[START] = rate if order == 1 else angle
        return np.nan
    h = sample[0] - m[TIME]
    if abs(h - m[H]) > SAME_STEP * h:
        m[H] = h
        m[W0], m[W1], m[W2], m[W3], m[W4] = hold_weights(lam, h)
    weights = (m[W0], m[W1], m[W2], m[W3], m[W4])
    start, end = sample[1], sample[2]
    bow_y, bow_p = 0.0, 0.0
    if _known(big):
        bow_y, bow_p = _curvatures(theta, stiff, order, h, angle, m[ANGLE], (rate - m[RATE]) / h, start, end)
    if order == 1:
        m[P1], m[P2] = advance(m[P1], m[P2], m[RATE], rate, bow_p, h, weights)
    if order == 2 or stiff != 0.0:
        m[Y1], m[Y2] = advance(m[Y1], m[Y2], m[ANGLE], angle, bow_y, h, weights)
    m[D1], m[D2] = advance(m[D1], m[D2], start, end, 0.0, h, weights)
    m[FADE] *= weights[0]
    m[SAMPLES] += 1.0
    m[TIME], m[ANGLE], m[RATE] = sample[0], angle, rate
    phi, gain = work[0], work[1]
    target = m[TARGET] = _row(m, stiff, order, lam, angle, rate, phi)
    if sample[5] == 0.0 or lam * (sample[0] - m[FIRST_TIME]) < 3.0 * order:
        return np.nan
    error, left = _update(theta, big, phi, target, beta, gain)
    after = error * left
    m[SQUARES] = beta * m[SQUARES] + error * after
    m[WEIGHT], m[WEIGHT2] = beta * m[WEIGHT] + 1.0, beta * beta * m[WEIGHT2] + 1.0
    m[ERROR_LAG] = beta * m[ERROR_LAG] + after * m[LAST_ERROR]
    m[ERROR_POWER] = beta * m[ERROR_POWER] + after * after
    m[LAST_ERROR] = after
    return error


@jit
def sweep(
    m: FloatArray, theta: FloatArray, big: FloatArray, work: FloatArray, settings: FloatArray, samples: FloatArray,
    values: FloatArray, spread: FloatArray, rows: FloatArray,
) -> None:  # fmt: skip
    """Run `step` over samples (n, 6) and keep what it found.

    Fills values and plain standard deviations (n, p), and rows (n, p + 1) of phi and target, NaN where unused.
    """
    size = theta.shape[0]
    for i in range(samples.shape[0]):
        error = step(m, theta, big, work, settings, samples[i])
        free = m[WEIGHT] - size
        scale = m[SQUARES] / free * m[WEIGHT2] / m[WEIGHT] if free > 0.0 else np.nan
        used = not np.isnan(error)
        for j in range(size):
            values[i, j] = theta[j]
            spread[i, j] = np.sqrt(big[j, j] * scale)
            rows[i, j] = work[0, j] if used else np.nan
        rows[i, size] = m[TARGET] if used else np.nan


def plain_update(
    theta: FloatArray, big: FloatArray, phi: FloatArray, target: float, beta: float
) -> tuple[FloatArray, FloatArray]:
    """Return Theta (p,) and P (p, p) after one row, as the equations are written: the oracle of the compiled one."""
    gain = big @ phi
    spread = beta + phi @ gain
    theta = theta + gain * ((target - phi @ theta) / spread)
    big = big - np.outer(gain, gain) / spread
    if float(np.diag(big).max()) < beta * INITIAL:
        big = big / beta
    return theta, big


@dataclass(frozen=True, slots=True)
class Estimate:
    """What is known after a sample: values (p,), standard errors (p,) allowing for colour, NaN before they exist."""

    values: FloatArray
    std_errors: FloatArray


class Recursion:
    """Recursive least squares fed one sample at a time; the same arithmetic as the sweep over a whole record.

    stiff adds the angle's stiffness (pitch); by_rate takes the measured rate and a first-order filter, otherwise
    the angle alone and a second-order one. bandwidth is lambda in rad/s, forgetting beta in (0, 1].
    """

    __slots__ = ("_big", "_fin", "_memory", "_sample", "_settings", "_theta", "_work")

    def __init__(self, *, stiff: bool, by_rate: bool = True, bandwidth: float = 4.0, forgetting: float = 1.0) -> None:
        size = 4 if stiff else 3
        self._memory = np.zeros(MEMORY)
        self._theta = np.zeros(size)
        self._big = np.eye(size) * INITIAL
        self._work = np.zeros((2, 4))
        self._settings = np.array([bandwidth, forgetting, 1.0 if by_rate else 2.0, float(stiff)])
        self._sample = np.zeros(6)
        self._fin = 0.0

    def update(self, time: float, fin: float, angle: float, rate: float) -> None:
        """Take one sample: time s, fin command rad from this time on, angle rad, rate rad/s; NaN where not measured."""
        sample, memory = self._sample, self._memory
        if not self._settings[3] and isfinite(angle):
            angle = memory[ANGLE] + remainder(angle - memory[ANGLE], tau)
        wanted = isfinite(rate if self._settings[2] == 1.0 else angle)
        sample[0], sample[1], sample[2] = time, self._fin, self._fin
        sample[3] = angle if isfinite(angle) else memory[ANGLE]
        sample[4] = rate if isfinite(rate) else memory[RATE]
        sample[5] = float(wanted)
        if time > memory[TIME] if memory[SAMPLES] else wanted:
            step(memory, self._theta, self._big, self._work, self._settings, sample)
        if isfinite(fin):
            self._fin = fin

    @property
    def values(self) -> FloatArray:
        """The estimate now, (p,): damping, stiffness (pitch), authority, trim."""
        return self._theta.copy()

    def estimate(self) -> Estimate:
        """Return values and standard errors now; the colour of the errors enters by their lag-one correlation."""
        memory, size = self._memory, self._theta.size
        free = memory[WEIGHT] - size
        if free <= 0.0 or memory[ERROR_POWER] == 0.0:
            return Estimate(self.values, np.full(size, np.nan))
        rho = float(np.clip(memory[ERROR_LAG] / memory[ERROR_POWER], 0.0, 0.99))
        scale = memory[SQUARES] / free * memory[WEIGHT2] / memory[WEIGHT] * (1.0 + rho) / (1.0 - rho)
        return Estimate(self.values, np.sqrt(np.maximum(np.diag(self._big), 0.0) * scale))
