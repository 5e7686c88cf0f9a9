"""T-optimality of a flight for two rival models: the distance of their predictions after the wrong one has been refitted.

The noise-free response of the true model serves as data; the other model is fitted to it with all its parameters, initial state
and per-run nuisances free, under the prior from earlier data. The whitened residual sum of squares is twice the expected log odds
of the flight (T-optimality: Atkinson and Fedorov 1975).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fieldsid.fitting.optimise.levenberg_marquardt import GaussianPrior, levenberg_marquardt
from fieldsid.models.model import Noise
from fieldsid.models.record import Record
from fieldsid.numerics.arrays import FloatArray
from fieldsid.planning.design.objective import problem_of
from fieldsid.planning.flight.operating_point import OperatingPoint
from fieldsid.planning.flight.rule_flight import Response

MAX_REFIT_ITERATIONS, CONVERGED_COST_CHANGE = 6, 0.01


@dataclass(frozen=True, slots=True)
class Rival:
    """A rival model at one speed: its operating point, and the prior precision (N, N) of its parameters from earlier data."""

    name: str
    scene: OperatingPoint
    precision: FloatArray

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
    return Rival("+".join(model.effects) or "none", scene, precision)


def log_odds(winner: Rival, loser: Rival, response: Response) -> float:
    """Return the expected log odds for the true model (`winner`) after its flight, with the other one refitted to it."""
    truth = winner.scene.record(response.time, response.command + winner.scene.trim_fin)
    problem, x = problem_of(winner.scene, truth)
    motion, _ = problem.simulate(x, 0)
    if not np.isfinite(motion.rate).all():
        return 0.0
    record = replace(truth, angle=motion.angle, rate=motion.rate)
    return 0.5 * _refitted(loser, record, winner.noise)


def _refitted(loser: Rival, record: Record, noise: Noise) -> float:
    """Return the whitened residual sum of squares of a refitted rival on a record, the prior's term included."""
    problem, start = problem_of(loser.scene, record)
    prior = GaussianPrior(start, loser.precision)
    found = levenberg_marquardt(
        problem, start, noise, prior=prior, max_iterations=MAX_REFIT_ITERATIONS, tolerance=CONVERGED_COST_CHANGE
    )
    return found.cost if np.isfinite(found.cost) else 0.0
