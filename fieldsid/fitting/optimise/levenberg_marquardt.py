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
"""Largest relative change of a parameter in a last step that is not evaluated: a parameter that the data hardly determine would
be moved far for almost no gain, to where the linearisation no longer holds."""


@dataclass(frozen=True, slots=True)
class GaussianPrior:
    """A Gaussian prior of the parameters: centre (N,) and precision (N,), zero where there is none."""

    centre: FloatArray
    precision: FloatArray

    def cost(self, x: FloatArray) -> float:
        """Return the sum of squares it adds at x."""
        return float(self.precision @ (x - self.centre) ** 2)


@dataclass(frozen=True, slots=True)
class Minimum:
    """The minimum found: vector (N,), weighted sum of squares, and its normal matrix (F, F) over the `free` parameters.

    The sum is infinite where the motion at the start grows without bound: then the vector is the start.
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

    dynamics are those that the noise is whitened through, by default the ones at x.
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

    Residuals are whitened through the dynamics at the start throughout: the sum of squares without the determinant of the noise
    covariance would otherwise be lowered by dynamics that make the noise look larger. `damping` is that of the first step, small
    where x is near the minimum. A parameter at a bound whose gradient points outward is fixed for the step; so are the times of
    events after a step that was refused, where the others alone promise to lower the cost. Source:
    Levenberg-Marquardt with Marquardt's scaling and projected bounds (Nocedal and Wright 2006, section 10.3).
    """
    slots = tuple(range(len(x)) if free is None else free)
    low, high = problem.layout.low[list(slots)], problem.layout.high[list(slots)]
    index, x = list(slots), x.copy()
    x[index] = np.clip(x[index], low, high)
    hill = _Objective(problem, noise, slots, dynamics_of(problem, x), prior, linear_white(problem, noise, slots))
    cost, normal, gradient = hill.linear(x)
    done, fell, fell_before, count = False, True, True, 0
    # beside an edge of the fin the cost has a kink in an event's time: no step of all parameters leads along it
    events, hold = np.array([problem.layout.parameters[i].is_event for i in slots], dtype=bool), False
    every, dampings = np.full(len(slots), True), np.full(len(slots), damping)
    while count < max_iterations and not done and np.isfinite(cost):
        count += 1
        stepped = ~events if hold else every
        within = np.where(stepped, low, x[index]), np.where(stepped, high, x[index])
        trial, expected = _stepped(x, index, normal, gradient, dampings, within)
        if hold and not expected > tolerance * cost:
            hold, stepped = False, every
            trial, expected = _stepped(x, index, normal, gradient, dampings, (low, high))
        moved = trial[index] - x[index]
        if (
            0.0 <= expected <= tolerance * cost
            and (dampings <= INITIAL_DAMPING).all()
            and (np.abs(moved) <= MAX_RELATIVE_LAST_STEP * np.abs(x[index])).all()
        ):
            # no step was refused: where so little is left to gain it is there, and nobody need look
            x, cost, done = trial, cost - expected, True
            break
        # in a bent valley every second step is refused, elsewhere hardly any: the cost falls where it fell two steps before, and
        # there the equations come with it
        new, equations = hill.at(trial, whole=fell_before and expected > tolerance * cost)
        fell, fell_before = new < cost, fell
        if fell:
            done = cost - new <= tolerance * cost or expected <= tolerance * cost
            x, hold = trial, False
            dampings[stepped] = np.maximum(dampings[stepped] * (0.1 if new < cost - 0.5 * expected else 1.0), 1e-12)
            if equations is None and done and (hill.long or _at_rest(dampings, cost - new, tolerance * cost)):
                cost = new
                break
            cost, normal, gradient = hill.linear(x) if equations is None else (new, *equations)
        else:
            done = abs(expected) <= tolerance * cost
            hold = not hold and bool(events.any())
            raised = events if hold else stepped
            dampings[raised] = np.maximum(dampings[raised], 1e-7) * 10.0
            done = done or bool(dampings.max() > MAX_DAMPING)
    return Minimum(x, cost, normal, gradient, slots, count, done)


def _stepped(
    x: FloatArray,
    index: Sequence[int],
    normal: FloatArray,
    gradient: FloatArray,
    dampings: FloatArray,
    bounds: tuple[FloatArray, FloatArray],
) -> tuple[FloatArray, float]:
    """Return where a step of the parameters at `index` leads, and the fall of the cost that the normal equations promise."""
    low, high = bounds
    trial = x.copy()
    trial[index] = np.clip(x[index] + bounded_step(normal, gradient, dampings, x[index], low, high), low, high)
    moved = trial[index] - x[index]
    return trial, float(2 * gradient @ moved - moved @ normal @ moved)


def _at_rest(dampings: FloatArray, gained: float, worth: float) -> bool:
    """Whether a step gained so little that the normal equations before it are those after it."""
    return bool((dampings <= INITIAL_DAMPING).all()) and gained <= 1e-3 * worth


@dataclass(frozen=True, slots=True)
class _Objective:
    """Cost and normal equations over the free parameters, residuals whitened through fixed dynamics."""

    problem: Problem
    noise: Noise
    free: tuple[int, ...]
    held: Dynamics
    prior: GaussianPrior | None
    lean: LinearWhite | None

    @property
    def long(self) -> bool:
        """Whether the normal equations are dear: those of one step before the end then stand for those at the end."""
        return is_chunked(self.problem, self.noise)

    def linear(self, x: FloatArray) -> tuple[float, FloatArray, FloatArray]:
        """Return cost, normal matrix (F, F) and gradient (F,) at x."""
        if self.lean is not None:
            cost, normal, gradient = self.lean.linear(x)
        elif is_chunked(self.problem, self.noise):
            cost, normal, gradient = chunked_normal_equations(self.problem, x, self.noise, self.free)
        else:
            cost, normal, gradient, _ = normal_equations(self.problem, x, self.noise, self.free, self.held)
        if self.prior is None:
            return cost, normal, gradient
        index = list(self.free)
        pull = self.prior.precision * (self.prior.centre - x)
        return cost + self.prior.cost(x), normal + np.diag(self.prior.precision[index]), gradient + pull[index]

    def at(self, x: FloatArray, *, whole: bool) -> tuple[float, tuple[FloatArray, FloatArray] | None]:
        """Return the cost at x, with the normal equations where they are wanted or come with it."""
        if self.lean is not None or (whole and not self.long):
            try:
                cost, normal, gradient = self.linear(x)
            except EffectError:
                return float("inf"), None
            return cost, (normal, gradient)
        return cost_of(self.problem, x, self.noise, self.held) + (0.0 if self.prior is None else self.prior.cost(x)), None


def covariance(normal: FloatArray) -> FloatArray:
    """Return the inverse of a normal matrix, computed in its own scale; a direction without information is infinite."""
    scale, values, vectors, floor = _directions(normal)
    inverse = (vectors / np.maximum(values, floor)) @ vectors.T
    return np.asarray(inverse / np.outer(scale, scale))


def sandwich(normal: FloatArray, centre: FloatArray) -> FloatArray:
    """Return N^-1 C N^-1 of a normal matrix and a centre C, as the square of a root: a covariance of any conditioning.

    The centre is taken into the directions of N first, where it is the noise's power over that of the weights: multiplied out
    as it stands, the rounding of C would be raised by the square of what a direction lacks in information, above its own
    variance or below zero. In a direction without any, the noise is taken to be the strongest of the others'.
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
    """Return a normal matrix's scale (F,), its eigenvalues and eigenvectors in that, and the least information there can be."""
    # not smaller: the inverse of a direction without information must stay a number
    if not bool(np.isfinite(normal).all()):
        raise DivergenceError(
            "the fit came to sensitivities that are no numbers", found="the model grows beyond all bounds on this run",
            hint="check the units of the run's signals: `sysid inspect LOG`",
        )  # fmt: skip
    scale = np.sqrt(np.maximum(np.diag(normal), 1e-60))
    values, vectors = np.linalg.eigh(normal / np.outer(scale, scale))
    return scale, values, vectors, 1e-13 * max(float(values[-1]), 1.0)
