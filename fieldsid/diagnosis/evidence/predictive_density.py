"""The predictive density of the validation runs, with the uncertainty of the parameters integrated out.

At the parameters' estimate alone, a model whose parameters the training runs hardly determine would be penalised as if it were
wrong. With theta ~ N(estimate, Lambda^-1) after the training runs, residual e and sensitivities S of a validation run, both
whitened, |e - S d|^2 = e'e - 2 b'd + d'A d, and to first order

    log p(run) = -e'e/2 + (Lambda m + b)' (Lambda + A)^-1 (Lambda m + b) / 2 - m' Lambda m / 2 - log det(I + Lambda^-1 A) / 2

after which Lambda <- Lambda + A, and m becomes the posterior mean. The nuisances of a run are projected out of A and b, and take
their best values under the noise: with their gradient g and normal matrix N, log p <- log p + g' N^-1 g / 2. Nuisances fitted
under the noise of the training runs would change a run's start to balance a drift that this noise does not allow for. A run's
speed is measured with an error e ~ N(0, 1) along c in the shared parameters, which is integrated out first,
    A <- A - A c c'A / (1 + s),  b <- b - A c t / (1 + s),  log p <- log p + t^2 / (2 + 2 s) - log(1 + s) / 2,  s = c'A c, t = c'b
Source: MacKay 1992, Neural Computation 4(3), Bayesian interpolation; Kass and Raftery 1995, section 4.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fieldsid.diagnosis.evidence.likelihood_fit import LikelihoodFit, largest_own_moment
from fieldsid.fitting.optimise.levenberg_marquardt import gram_products
from fieldsid.fitting.predict.predict import values_at_speed
from fieldsid.fitting.problem.problem import Problem, RunResult
from fieldsid.models.axis import NAMES
from fieldsid.models.model import Noise
from fieldsid.models.record import Record
from fieldsid.noise.maximum_likelihood import log_likelihood
from fieldsid.noise.own_moment import estimate_noise_of_runs
from fieldsid.numerics.arrays import FloatArray
from fieldsid.numerics.gram_least_squares import solve_normal_equations

RELATIVE_DIFFERENCE_STEP = 1e-4
INFORMATION_ROUNDING_SHARE = 1e-14
"""Share of a parameter's information below which what remains after projection is rounding."""
MIN_PRECISION = 1e-10
"""Precision added to every combination of normalised parameters."""
MAX_RESIDUAL_RATIO = 4.0
"""Sum of squares over the noise floor up to which two sets of residuals lead to the same noise."""


@dataclass(frozen=True, slots=True)
class ValidationRun:
    """A validation run: its one-run problem and x, residual (2, n), and Jacobian (F, S) to the training parameters.

    `speed` (F,) is the change of its parameters by one standard error of its speed; `linearisation` holds the sensitivities to
    all its parameters, without noise.
    """

    problem: Problem
    x: FloatArray
    residual: FloatArray
    parameter_jacobian: FloatArray
    speed: FloatArray
    linearisation: RunResult


def log_predictive_density(
    ml_fit: LikelihoodFit, runs: Sequence[ValidationRun], records: Sequence[Record]
) -> tuple[FloatArray, list[FloatArray], float]:
    """Return the log predictive density of each validation run, (R,), in turn, under the noise that all of them support.

    Also return each run's residual (2, n) at the parameters' posterior mean after all runs, and the standard deviation (rad/s^2)
    of the moments of the runs, estimated from training and validation runs together.

    The parameters are those of the training runs. The noise is estimated from the validation runs: that of the training runs
    would penalise a model the more for a small error, the better it fitted there.
    """
    dynamics = [(b.damping, b.stiffness) for b in (r.problem.base_of(r.x, 0) for r in runs)]
    known, evaluations = precision(ml_fit), ml_fit.fitted.problem.evaluations

    at_estimate = [r.residual for r in runs]
    _, at_posterior_mean = _density_and_residuals(ml_fit.noise, runs, dynamics, known)
    found = []
    for residuals in (
        (at_estimate, at_posterior_mean) if _differ(at_estimate, at_posterior_mean, ml_fit.white.floor) else (at_estimate,)
    ):
        noise, _ = estimate_noise_of_runs(
            records, dynamics, residuals, ml_fit.noise_kind, ml_fit.noise, ml_fit.white,
            largest_own_moment(ml_fit.fitted.problem, ml_fit.fitted.x), ml_fit.own_moments, evaluations=evaluations,
        )  # fmt: skip
        found.append((*_density_and_residuals(noise, runs, dynamics, known), noise.own_moment))
    return max(found, key=lambda v: float(v[0].sum()))


def _differ(at_estimate: Sequence[FloatArray], at_posterior_mean: Sequence[FloatArray], floor: Noise) -> bool:
    """Whether two sets of residuals differ by more than the noise could resolve."""
    sigma = np.array([[floor.angle], [floor.rate]])
    return (
        sum(float(np.sum(((a - b) / sigma) ** 2)) for a, b in zip(at_estimate, at_posterior_mean, strict=True))
        > MAX_RESIDUAL_RATIO
    )


def precision(ml_fit: LikelihoodFit) -> FloatArray:
    """Return the posterior precision (S, S) of the shared parameters after the training runs, nuisances projected out."""
    problem, x = ml_fit.fitted.problem, ml_fit.fitted.x
    shared = problem.layout.shared
    width = (problem.layout.high - problem.layout.low)[:shared]
    a, _ = _schur_complement(ml_fit.information.normal, np.zeros(x.size), shared)
    return a + np.diag(1.0 / width**2)


def parameter_jacobian(ml_fit: LikelihoodFit, frozen: Problem, speed: float) -> FloatArray:
    """Return the Jacobian (F, S) of the shared parameters of a one-run problem with respect to those of the training problem."""
    layout, x = ml_fit.fitted.problem.layout, ml_fit.fitted.x
    damping = NAMES[layout.axis].damping
    out = np.zeros((frozen.layout.shared, layout.shared))

    def at(values: dict[str, float]) -> FloatArray:
        law = layout.law(values)
        here = values_at_speed(law, values, layout.axis, speed)
        here[damping] *= law.scale(speed) ** (law.damping_exponent - frozen.layout.groups.exponent)
        return np.array([here[n] for n in frozen.layout.names])

    values = dict(zip(layout.names, x[: layout.shared].tolist(), strict=True))
    for j, name in enumerate(layout.names):
        step = RELATIVE_DIFFERENCE_STEP * max(abs(values[name]), RELATIVE_DIFFERENCE_STEP)
        out[:, j] = (at(values | {name: values[name] + step}) - at(values | {name: values[name] - step})) / (2.0 * step)
    return out


def _density_and_residuals(
    noise: Noise, runs: Sequence[ValidationRun], dynamics: Sequence[tuple[float, float]], known: FloatArray
) -> tuple[FloatArray, list[FloatArray]]:
    """Return each run's log predictive density under a noise, and its residual at the posterior mean."""
    values, parts = list[float](), list[FloatArray | None]()
    posterior_mean: FloatArray = np.zeros(known.shape[0])
    # normalised by the standard error of each parameter: their sizes differ by ten orders, and some are nearly dependent
    unit = 1.0 / np.sqrt(np.diag(known))
    posterior_precision = known * np.outer(unit, unit) + MIN_PRECISION * np.eye(unit.size)
    for run, d in zip(runs, dynamics, strict=True):
        likelihood = log_likelihood(run.problem.records, [d], [run.residual], noise)
        product = gram_products(run.problem.records[0], noise, *d, run.linearisation)
        parts.append(product)
        if product is not None:
            shared = run.problem.layout.shared
            a, b = _schur_complement(product[1:, 1:], product[1:, 0], shared)
            nuisances = product[1 + shared :, 0]
            likelihood += 0.5 * float(nuisances @ solve_normal_equations(product[1 + shared :, 1 + shared :], nuisances))
            a, b, averaged = _marginalise_speed(a, b, run.speed)
            likelihood += averaged
            jacobian = run.parameter_jacobian * unit
            a, b = jacobian.T @ a @ jacobian, jacobian.T @ b
            pull = posterior_precision @ posterior_mean
            moved = np.linalg.solve(posterior_precision + a, pull + b)
            gain = 0.5 * float((pull + b) @ moved - posterior_mean @ pull)
            likelihood += gain - 0.5 * (_log_det(posterior_precision + a) - _log_det(posterior_precision))
            posterior_mean, posterior_precision = np.asarray(moved), posterior_precision + a
        values.append(likelihood)
    at_posterior_mean = [
        run.residual if p is None else _posterior_residual(run, p, unit * posterior_mean)
        for run, p in zip(runs, parts, strict=True)
    ]
    return np.array(values), at_posterior_mean


def _posterior_residual(run: ValidationRun, product: FloatArray, posterior_mean: FloatArray) -> FloatArray:
    """Return a run's residual (2, n) at the posterior mean, its speed and nuisances refitted to first order."""
    shared, normal = run.problem.layout.shared, product[1:, 1:]
    step = run.parameter_jacobian @ posterior_mean
    a, b = _schur_complement(normal, product[1:, 0], shared)
    step = step + run.speed * float(run.speed @ (b - a @ step)) / (1.0 + float(run.speed @ a @ run.speed))
    nuisances = solve_normal_equations(normal[shared:, shared:], product[1 + shared :, 0] - normal[shared:, :shared] @ step)
    return np.asarray(run.residual - np.tensordot(np.concatenate([step, nuisances]), run.linearisation.sensitivity, axes=1))


def _schur_complement(normal: FloatArray, gradient: FloatArray, shared: int) -> tuple[FloatArray, FloatArray]:
    """Return normal matrix and gradient of the shared parameters with the nuisances projected out.

    Parameters are normalised by their information, since the rest of a nearly dependent parameter is a small difference.
    """
    size = np.sqrt(np.maximum(np.diag(normal), np.finfo(float).tiny))
    unit, pull = normal / np.outer(size, size), gradient / size
    cross = unit[shared:, :shared]
    inverse = np.linalg.pinv(unit[shared:, shared:], rcond=1e-12, hermitian=True)
    a = unit[:shared, :shared] - cross.T @ inverse @ cross
    known, of = 0.5 * (a + a.T), size[:shared]
    known[np.diag_indices(shared)] = np.maximum(np.diag(known), INFORMATION_ROUNDING_SHARE)
    return known * np.outer(of, of), (pull[:shared] - cross.T @ inverse @ pull[shared:]) * of


def _marginalise_speed(a: FloatArray, b: FloatArray, c: FloatArray) -> tuple[FloatArray, FloatArray, float]:
    """Return normal matrix and gradient with the error of a run's speed integrated out, and its term of the log density."""
    along, t = a @ c, float(c @ b)
    divisor = 1.0 + float(c @ along)
    gain = 0.5 * (t * t / divisor - np.log(divisor))
    return a - np.outer(along, along) / divisor, b - along * t / divisor, gain


def _log_det(matrix: FloatArray) -> float:
    return float(np.linalg.slogdet(matrix)[1])
