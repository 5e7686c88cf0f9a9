"""Levenberg-Marquardt on whitened free-run residuals, within bounds, over the free parameters of a joint fit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fieldsid.errors import DivergenceError, EffectError
from fieldsid.fitting.optimise.chunked import chunked_normal_equations, is_chunked
from fieldsid.fitting.optimise.linear_white import LinearWhite, linear_white
from fieldsid.fitting.problem.problem import Problem, RunResult
from fieldsid.models.model import Noise
from fieldsid.models.record import Record
from fieldsid.noise.whiten import is_white, whiten
from fieldsid.numerics.arrays import FloatArray
from fieldsid.numerics.bounded_lm_step import bounded_step

RELATIVE_COST_TOLERANCE = 1e-8
MAX_LM_ITERATIONS = 40
INITIAL_DAMPING = 1e-4
MAX_DAMPING = 1e9
MAX_RELATIVE_LAST_STEP = 0.1
"""Largest relative change of a parameter in a last step whose cost is not evaluated: a parameter that the data hardly determine
would move far for almost no gain, out of the range of the linearisation."""


@dataclass(frozen=True, slots=True)
class GaussianPrior:
    """A Gaussian prior of the parameters: centre (N,) and precision (N, N), zero where there is none."""

    centre: FloatArray
    precision: FloatArray

    def cost(self, x: FloatArray) -> float:
        """Return the sum of squares that the prior adds at x."""
        return float((x - self.centre) @ self.precision @ (x - self.centre))


@dataclass(frozen=True, slots=True)
class Minimum:
    """The minimum found: vector (N,), weighted sum of squares, and its normal matrix (F, F) over the `free` parameters.

    Where the motion at the start grows without bound, the sum of squares is infinite and the vector is the start.
    """

    x: FloatArray
    cost: float
    normal: FloatArray
    gradient: FloatArray
    free: tuple[int, ...]
    iterations: int
    converged: bool


Dynamics = Sequence[tuple[float, float]]
"""Damping and stiffness of every run, through which a disturbance moves it."""


def dynamics_of(problem: Problem, x: FloatArray) -> list[tuple[float, float]]:
    """Return (damping, stiffness) of every run's linear base model."""
    bases = [problem.base_of(x, run) for run in range(len(problem.records))]
    return [(b.damping, b.stiffness) for b in bases]


def cost_of(problem: Problem, x: FloatArray, noise: Noise, dynamics: Dynamics | None = None) -> float:
    """Return the whitened sum of squares at x, infinite where the motion diverges or an effect refuses its values.

    dynamics are those of the whitening filter, by default the ones at x.
    """
    total = 0.0
    for run, record in enumerate(problem.records):
        try:
            residual, base = problem.residual(x, run)
        except EffectError:
            return float("inf")
        if not np.isfinite(residual).all():
            return float("inf")
        damping, stiffness = (base.damping, base.stiffness) if dynamics is None else dynamics[run]
        white, _ = whiten(record, noise, damping, stiffness, residual[None])
        total += float(np.vdot(white, white))
    return total


def gram_products(record: Record, noise: Noise, damping: float, stiffness: float, result: RunResult) -> FloatArray | None:
    """Return the products (1 + P, 1 + P) of a run's whitened residual and sensitivities, None where the motion diverges."""
    stack = result.stack
    with np.errstate(invalid="ignore", over="ignore"):
        if is_white(noise) and record.is_whole:
            angle, rate = stack[:, 0], stack[:, 1]
            product = angle @ angle.T / noise.angle**2 + rate @ rate.T / noise.rate**2
        else:
            white, _ = whiten(record, noise, damping, stiffness, stack)
            flat = white.reshape(white.shape[0], -1)
            product = flat @ flat.T
    return product if np.isfinite(product).all() else None


def normal_equations(
    problem: Problem, x: FloatArray, noise: Noise, free: Sequence[int], dynamics: Dynamics | None = None
) -> tuple[float, FloatArray, FloatArray, list[RunResult]]:
    """Return whitened cost, normal matrix (F, F), gradient (F,) and each run's linearisation."""
    place = {slot: i for i, slot in enumerate(free)}
    normal, gradient = np.zeros((len(free), len(free))), np.zeros(len(free))
    total, results = 0.0, []
    for run, record in enumerate(problem.records):
        result = problem.linearise(x, run, free)
        results.append(result)
        damping, stiffness = (result.base.damping, result.base.stiffness) if dynamics is None else dynamics[run]
        product = gram_products(record, noise, damping, stiffness, result)
        if product is None:
            return float("inf"), normal, gradient, results
        index = np.array([place[s] for s in result.columns], dtype=np.intp)
        normal[index[:, None], index] += product[1:, 1:]
        gradient[index] += product[1:, 0]
        total += float(product[0, 0])
    return total, normal, gradient, results


def levenberg_marquardt(
    problem: Problem, x: FloatArray, noise: Noise, *, free: Sequence[int] | None = None, max_iterations: int = MAX_LM_ITERATIONS,
    tolerance: float = RELATIVE_COST_TOLERANCE, prior: GaussianPrior | None = None, damping: float = INITIAL_DAMPING,
) -> Minimum:  # fmt: skip
    """Return the minimum of the whitened sum of squares that a start x converges to.

    The residuals are always whitened with the dynamics at the start: as the sum of squares lacks the determinant of the noise
    covariance, it could otherwise be lowered by dynamics that make the noise look larger. `damping` is that of the first step,
    small where x is near the minimum. A parameter at a bound whose gradient points outward is fixed for the step. After a refused
    step the times of events are fixed too, where a step of the other parameters promises to lower the cost. Source:
    Levenberg-Marquardt with Marquardt's scaling and projected bounds (Nocedal and Wright 2006, section 10.3).
    """
    slots = tuple(range(len(x)) if free is None else free)
    low, high = problem.layout.low[list(slots)], problem.layout.high[list(slots)]
    index, x = list(slots), x.copy()
    x[index] = np.clip(x[index], low, high)
    objective = _Objective(problem, noise, slots, dynamics_of(problem, x), prior, linear_white(problem, noise, slots))
    cost, normal, gradient = objective.linear(x)
    done, fell, fell_before, count = False, True, True, 0
    # near an edge of the fin the cost has a kink in the time of an event, along which no step of all parameters makes progress
    events, hold = np.array([problem.layout.parameters[i].is_event for i in slots], dtype=bool), False
    every, dampings = np.full(len(slots), True), np.full(len(slots), damping)
    while count < max_iterations and not done and np.isfinite(cost):
        count += 1
        stepped = ~events if hold else every
        within = np.where(stepped, low, x[index]), np.where(stepped, high, x[index])
        trial, expected = _bounded_trial(x, index, normal, gradient, dampings, within)
        if hold and not expected > tolerance * cost:
            hold, stepped = False, every
            trial, expected = _bounded_trial(x, index, normal, gradient, dampings, (low, high))
        moved = trial[index] - x[index]
        if (
            0.0 <= expected <= tolerance * cost
            and (dampings <= INITIAL_DAMPING).all()
            and (np.abs(moved) <= MAX_RELATIVE_LAST_STEP * np.abs(x[index])).all()
        ):
            # no step was refused and almost nothing is left to gain: the last step is taken without evaluating its cost
            x, cost, done = trial, cost - expected, True
            break
        # in a curved valley every second step is refused, elsewhere hardly any: where the cost fell two steps before it is
        # expected to fall again, and the normal equations are computed together with the cost
        new, equations = objective.at(trial, with_equations=fell_before and expected > tolerance * cost)
        fell, fell_before = new < cost, fell
        if fell:
            done = cost - new <= tolerance * cost or expected <= tolerance * cost
            x, hold = trial, False
            dampings[stepped] = np.maximum(dampings[stepped] * (0.1 if new < cost - 0.5 * expected else 1.0), 1e-12)
            if equations is None and done and (objective.long or _at_rest(dampings, cost - new, tolerance * cost)):
                cost = new
                break
            cost, normal, gradient = objective.linear(x) if equations is None else (new, *equations)
        else:
            done = abs(expected) <= tolerance * cost
            hold = not hold and bool(events.any())
            raised = events if hold else stepped
            dampings[raised] = np.maximum(dampings[raised], 1e-7) * 10.0
            done = done or bool(dampings.max() > MAX_DAMPING)
    return Minimum(x, cost, normal, gradient, slots, count, done)


def _bounded_trial(
    x: FloatArray,
    index: Sequence[int],
    normal: FloatArray,
    gradient: FloatArray,
    dampings: FloatArray,
    bounds: tuple[FloatArray, FloatArray],
) -> tuple[FloatArray, float]:
    """Return x after a step of the parameters at `index`, and the decrease of the cost that the normal equations predict."""
    low, high = bounds
    trial = x.copy()
    trial[index] = np.clip(x[index] + bounded_step(normal, gradient, dampings, x[index], low, high), low, high)
    moved = trial[index] - x[index]
    return trial, float(2 * gradient @ moved - moved @ normal @ moved)


def _at_rest(dampings: FloatArray, gained: float, least_gain: float) -> bool:
    """Whether a step gained so little that the normal equations need not be computed again after it."""
    return bool((dampings <= INITIAL_DAMPING).all()) and gained <= 1e-3 * least_gain


@dataclass(frozen=True, slots=True)
class _Objective:
    """Cost and normal equations over the free parameters, residuals whitened through fixed dynamics."""

    problem: Problem
    noise: Noise
    free: tuple[int, ...]
    whitening: Dynamics
    prior: GaussianPrior | None
    lean: LinearWhite | None

    @property
    def long(self) -> bool:
        """Whether the normal equations are costly: those before the last step are then used for the minimum."""
        return is_chunked(self.problem, self.noise)

    def linear(self, x: FloatArray) -> tuple[float, FloatArray, FloatArray]:
        """Return cost, normal matrix (F, F) and gradient (F,) at x."""
        if self.lean is not None:
            cost, normal, gradient = self.lean.linear(x)
        elif is_chunked(self.problem, self.noise):
            cost, normal, gradient = chunked_normal_equations(self.problem, x, self.noise, self.free)
        else:
            cost, normal, gradient, _ = normal_equations(self.problem, x, self.noise, self.free, self.whitening)
        if self.prior is None:
            return cost, normal, gradient
        index = list(self.free)
        pull = self.prior.precision @ (self.prior.centre - x)
        return cost + self.prior.cost(x), normal + self.prior.precision[np.ix_(index, index)], gradient + pull[index]

    def at(self, x: FloatArray, *, with_equations: bool) -> tuple[float, tuple[FloatArray, FloatArray] | None]:
        """Return the cost at x, and the normal equations where they are wanted or computed anyway."""
        if self.lean is not None or (with_equations and not self.long):
            try:
                cost, normal, gradient = self.linear(x)
            except EffectError:
                return float("inf"), None
            return cost, (normal, gradient)
        return cost_of(self.problem, x, self.noise, self.whitening) + (0.0 if self.prior is None else self.prior.cost(x)), None


def covariance(normal: FloatArray) -> FloatArray:
    """Return the inverse of a normal matrix, computed with unit diagonal; without information a variance is very large."""
    scale, values, vectors, floor = _directions(normal)
    inverse = (vectors / np.maximum(values, floor)) @ vectors.T
    return np.asarray(inverse / np.outer(scale, scale))


def sandwich(normal: FloatArray, centre: FloatArray) -> FloatArray:
    """Return N^-1 C N^-1 of a normal matrix and a centre C, as the square of a root: a covariance of any conditioning.

    C is first transformed to the eigenvectors of N, where its diagonal is the power of the noise relative to the weights. In the
    direct product, the rounding errors of C would be multiplied by the squared condition number of N, and a variance might become
    negative. In a direction without information, the largest relative power of the other directions is used.
    """
    scale, values, vectors, floor = _directions(normal)
    root, known = vectors / np.sqrt(np.maximum(values, floor)), values > floor
    power = root.T @ (centre / np.outer(scale, scale)) @ root
    power[~known], power[:, ~known] = 0.0, 0.0
    power[~known, ~known] = power.diagonal().max() if known.any() else 1.0
    sizes, turned = np.linalg.eigh(0.5 * (power + power.T))
    half = (root @ turned) * np.sqrt(np.maximum(sizes, 0.0)) / scale[:, None]
    return np.asarray(half @ half.T)


def _directions(normal: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, float]:
    """Return the scale (F,) of a normal matrix, eigenvalues and eigenvectors of the scaled matrix, and the least eigenvalue."""
    # the least eigenvalue keeps the inverse finite in a direction without information
    if not bool(np.isfinite(normal).all()):
        raise DivergenceError(
            "the fit came to sensitivities that are no numbers", found="the model grows beyond all bounds on this run",
            hint="check the units of the run's signals: `sysid inspect LOG`",
        )  # fmt: skip
    scale = np.sqrt(np.maximum(np.diag(normal), 1e-60))
    values, vectors = np.linalg.eigh(normal / np.outer(scale, scale))
    return scale, values, vectors, 1e-13 * max(float(values[-1]), 1.0)
