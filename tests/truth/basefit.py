"""An output-error fit of the base model, which measures how badly it fits: linear parameters eliminated, damping searched.

The small systems are solved by loops: the threads of a linear algebra library cost ten times what they save here.
"""

from __future__ import annotations

from dataclasses import dataclass

import numba as nb
import numpy as np

FITTED_S = 0.1
"""Spacing of the samples that enter the fit, s."""


@dataclass(frozen=True, slots=True)
class Sample:
    """One run for the fit: fin, angle and rate (n,), interval in s, speed over the reference, authority group, factor on trim."""

    fin: np.ndarray
    angle: np.ndarray
    rate: np.ndarray
    interval: float
    ratio: float
    group: int
    trim_factor: float = 1.0


@dataclass(frozen=True, slots=True)
class BaseFit:
    """Damping, stiffness, trim at the reference speed, authority by group over speed squared, damping's exponent of speed."""

    damping: float
    stiffness: float
    authority: np.ndarray
    trim: float
    exponent: float
    cost: float


@nb.njit(cache=True)
def _exponential(matrix):
    """Return the exponential of a (3, 3) matrix of norm below about 4, by its series."""
    total, term, after = np.eye(3), np.eye(3), np.zeros((3, 3))
    for n in range(1, 40):
        for i in range(3):
            for j in range(3):
                after[i, j] = (term[i, 0] * matrix[0, j] + term[i, 1] * matrix[1, j] + term[i, 2] * matrix[2, j]) / n
        term[:] = after
        total += term
    return total


@nb.njit(cache=True)
def _march(step, drive, fin):
    """Return the responses (n, 2, 4) of angle and rate to the fin, a constant moment, an initial angle and an initial rate."""
    n = fin.size
    out = np.zeros((n, 2, 4))
    out[0, 0, 2], out[0, 1, 3] = 1.0, 1.0
    for k in range(n - 1):
        for j in range(4):
            push = fin[k] if j == 0 else (1.0 if j == 1 else 0.0)
            y, p = out[k, 0, j], out[k, 1, j]
            out[k + 1, 0, j] = step[0, 0] * y + step[0, 1] * p + drive[0] * push
            out[k + 1, 1, j] = step[1, 0] * y + step[1, 1] * p + drive[1] * push
    return out


def responses(damping, stiffness, fin, interval):
    """Return the exact responses (n, 2, 4) of y'' = -damping y' - stiffness y + push, the fin held constant between samples."""
    whole = _exponential(np.array([[0.0, 1.0, 0.0], [-stiffness, -damping, 1.0], [0.0, 0.0, 0.0]]) * interval)
    return _march(whole[:2, :2].copy(), whole[:2, 2].copy(), np.ascontiguousarray(fin))


def _system(samples, groups, x, exponent, weights):
    """Return the weighted design (rows, p) and target (rows,) of the linear parameters, damping and stiffness x given."""
    rows, targets, p = [], [], groups + 1 + 2 * len(samples)
    for i, s in enumerate(samples):
        unit = responses(x[0] * s.ratio**exponent, x[1] if len(x) > 1 else 0.0, s.fin, s.interval)
        every = max(1, round(FITTED_S / s.interval))
        for channel, measured in enumerate((s.angle[::every], s.rate[::every])):
            block, part = np.zeros((measured.size, p)), unit[::every, channel]
            block[:, s.group], block[:, groups] = part[:, 0] * s.ratio**2, part[:, 1] * s.trim_factor
            block[:, groups + 1 + 2 * i : groups + 3 + 2 * i] = part[:, 2:]
            rows.append(block / weights[channel])
            targets.append(measured / weights[channel])
    return np.concatenate(rows), np.concatenate(targets)


@nb.njit(cache=True)
def _normal(design, target):
    """Return design' design (p, p) and design' target (p,)."""
    n, p = design.shape
    square, right = np.zeros((p, p)), np.zeros(p)
    for k in range(n):
        for i in range(p):
            a = design[k, i]
            if a != 0.0:
                right[i] += a * target[k]
                for j in range(i + 1):
                    square[i, j] += a * design[k, j]
    for i in range(p):
        for j in range(i):
            square[j, i] = square[i, j]
    return square, right


@nb.njit(cache=True)
def _cholesky_solve(square, right):
    """Return the solution (p,) of a small positive definite system; `square` and `right` are overwritten."""
    p = right.size
    for i in range(p):
        for j in range(i + 1):
            total = square[i, j]
            for k in range(j):
                total -= square[i, k] * square[j, k]
            square[i, j] = np.sqrt(max(total, 1e-300)) if i == j else total / square[j, j]
        for k in range(i):
            right[i] -= square[i, k] * right[k]
        right[i] /= square[i, i]
    for i in range(p - 1, -1, -1):
        for k in range(i + 1, p):
            right[i] -= square[k, i] * right[k]
        right[i] /= square[i, i]
    return right


@nb.njit(cache=True)
def _residual(design, linear, target):
    out = np.empty(target.size)
    for k in range(target.size):
        total = -target[k]
        for i in range(linear.size):
            total += design[k, i] * linear[i]
        out[k] = total
    return out


def _solve(design, target):
    square, right = _normal(design, target)
    size = np.sqrt(np.maximum(np.diag(square), 1e-300))
    return _cholesky_solve(square / np.outer(size, size) + 1e-11 * np.eye(size.size), right / size) / size


def _descend(residual, x, low, high):
    """Return the minimum of one or two parameters within bounds, and half its sum of squares.

    Levenberg-Marquardt with a Jacobian by differences.
    """
    here, damp = residual(x), 1e-3
    for _ in range(40):
        step = 1e-4 * np.maximum(np.abs(x), 0.05)
        jacobian = np.stack(
            [(residual(x + step * unit) - here) / s for unit, s in zip(np.eye(x.size), step, strict=True)], axis=1
        )
        square, right = _normal(jacobian, here)
        trial = np.clip(x - _cholesky_solve(square + damp * np.diag(np.diag(square) + 1e-12), right), low, high)
        there = residual(trial)
        gain, moved = np.sum(here**2) - np.sum(there**2), np.abs(trial - x).max()
        if gain > 0.0:
            x, here, damp = trial, there, damp / 5.0
        else:
            damp *= 10.0
        if moved < 1e-6 * max(np.abs(x).max(), 0.1) or damp > 1e6:
            break
    return x, 0.5 * float(np.sum(here**2))


def fit_base(samples, start, weights, *, exponent=0.0):
    """Return the fit from the start values (damping,) or (damping, stiffness); weights: the noise of angle and rate."""
    groups = max(s.group for s in samples) + 1

    def residual(x):
        design, target = _system(samples, groups, x, exponent, weights)
        return _residual(design, _solve(design, target), target)

    low, high = np.array([-0.5, 0.0])[: len(start)], np.array([15.0, 20.0])[: len(start)]
    x, cost = _descend(residual, np.clip(start, low, high), low, high)
    design, target = _system(samples, groups, x, exponent, weights)
    linear = _solve(design, target)
    stiffness = float(x[1]) if len(start) > 1 else 0.0
    return BaseFit(float(x[0]), stiffness, linear[:groups], float(linear[groups]), exponent, cost)


def left_over(fit, sample, weights):
    """Return the residuals (n, 2) of angle and rate on a run, with only the initial state refitted."""
    unit = responses(fit.damping * sample.ratio**fit.exponent, fit.stiffness, sample.fin, sample.interval)
    model = unit[:, :, 0] * fit.authority[sample.group] * sample.ratio**2 + unit[:, :, 1] * fit.trim * sample.trim_factor
    return start_removed(np.stack([sample.angle, sample.rate], axis=1) - model, unit[:, :, 2:], weights)


def start_removed(error, unit, weights=(1.0, 1.0)):
    """Return an error (n, 2) less its best fit by the responses `unit` (n, 2, 2) to an initial angle and an initial rate."""
    w = np.asarray(weights)[None, :, None]
    design, target = (unit / w).reshape(-1, 2), (error / w[:, :, 0]).reshape(-1)
    best = _solve(design, target)
    return error - unit[:, :, 0] * best[0] - unit[:, :, 1] * best[1]
