"""T-optimality of a flight for two rival models: the distance of their predictions after the wrong one has been refitted.

The noise-free response of the true model serves as data; the other model is fitted to it with all its parameters, initial state
and per-run nuisances free, under the prior from earlier data. The whitened residual sum of squares is twice the expected log odds
of the flight (T-optimality: Atkinson and Fedorov 1975).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fieldsid.fitting.optimise.levenberg_marquardt import normal_equations
from fieldsid.fitting.problem.problem import Problem
from fieldsid.models.model import Noise
from fieldsid.models.record import Record
from fieldsid.numerics.arrays import FloatArray
from fieldsid.planning.design.objective import problem_of
from fieldsid.planning.flight.operating_point import OperatingPoint
from fieldsid.planning.flight.rule_flight import Response

MAX_REFIT_ITERATIONS, CONVERGED_COST_CHANGE = 6, 0.01
SMALLEST_STEP = 1.0 / 64.0


@dataclass(frozen=True, slots=True)
class Rival:
    """A rival model at one speed: its operating point, and the prior precision (N, N) of its parameters from earlier data."""

    name: str
    scene: OperatingPoint
    precision: FloatArray
    scale: FloatArray

    @property
    def noise(self) -> Noise:
        """The noise by which the residual is whitened."""
        return self.scene.model.noise


def rival_of(scene: OperatingPoint) -> Rival:
    """Return an operating point's model as a rival; without a covariance its prior is weak, about its own values."""
    problem, x = problem_of(scene, scene.record(np.linspace(0.0, 0.2, 3), np.zeros(3)))
    layout = problem.layout
    size = np.maximum(np.abs(x), 1e-3)
    precision = np.diag(np.where(np.arange(x.size) < layout.shared, 1.0 / (3.0 * size) ** 2, 1e-6 / size**2))
    model = scene.model
    names = [n for n in model.free if n in layout.names]
    if names and np.isfinite(model.covariance).all():
        inside = [model.free.index(n) for n in names]
        at = [layout.names.index(n) for n in names]
        known = model.covariance[np.ix_(inside, inside)]
        root = np.sqrt(np.maximum(np.diag(known), 1e-300))
        unit = known / np.outer(root, root) + 1e-8 * np.eye(root.size)
        precision[np.ix_(at, at)] += np.linalg.inv(unit) / np.outer(root, root)
    return Rival("+".join(model.effects) or "none", scene, precision, size)


def log_odds(winner: Rival, loser: Rival, response: Response, rounds: int = MAX_REFIT_ITERATIONS) -> float:
    """Return the expected log odds for the true model (`winner`) after its flight, with the other one refitted to it."""
    truth = winner.scene.record(response.time, response.command + winner.scene.trim_fin)
    problem, x = problem_of(winner.scene, truth)
    motion, _ = problem.simulate(x, 0)
    if not np.isfinite(motion.rate).all():
        return 0.0
    record = replace(truth, angle=motion.angle, rate=motion.rate)
    return 0.5 * _refitted(loser, record, winner.noise, rounds)


def _refitted(loser: Rival, record: Record, noise: Noise, rounds: int) -> float:
    """Return the whitened residual sum of squares of a refitted rival on a record, the prior's term included."""
    problem, start = problem_of(loser.scene, record)
    x, total = start.copy(), np.inf
    step = np.zeros_like(x)
    share = 1.0
    for _ in range(2 * rounds):
        trial = np.clip(x + share * step, problem.layout.low, problem.layout.high)
        cost, normal, gradient = _cost(problem, trial, start, loser, noise)
        if cost < total:
            settled = total - cost < CONVERGED_COST_CHANGE * max(cost, 1.0)
            x, total, share = trial, cost, 1.0
            if settled:
                break
            step = _solve(normal, gradient, x, problem)
        else:
            share *= 0.25
            if share < SMALLEST_STEP or not np.isfinite(total):
                break
    return float(total) if np.isfinite(total) else 0.0


def _cost(problem: Problem, x: FloatArray, start: FloatArray, loser: Rival, noise: Noise) -> tuple[float, FloatArray, FloatArray]:
    cost, normal, gradient, _ = normal_equations(problem, x, noise, range(x.size))
    moved = x - start
    pull = loser.precision @ moved
    return cost + float(moved @ pull), normal + loser.precision, gradient - pull


def _solve(normal: FloatArray, gradient: FloatArray, x: FloatArray, problem: Problem) -> FloatArray:
    low, high = problem.layout.low, problem.layout.high
    at_bound = ((x <= low) & (gradient < 0)) | ((x >= high) & (gradient > 0))
    free = np.flatnonzero(~at_bound)
    scale = np.sqrt(np.maximum(np.diag(normal)[free], 1e-30))
    unit = normal[np.ix_(free, free)] / np.outer(scale, scale) + 1e-9 * np.eye(free.size)
    step = np.zeros_like(x)
    step[free] = np.linalg.solve(unit, gradient[free] / scale) / scale
    return step
