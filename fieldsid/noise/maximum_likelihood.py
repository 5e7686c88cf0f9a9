"""The noise model by maximum likelihood, with Fisher scoring on the logarithms of its parameters."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fieldsid.models.model import Noise
from fieldsid.models.record import Record
from fieldsid.noise.fisher_scoring import information, innovations_of
from fieldsid.noise.innovations import kind_of
from fieldsid.noise.noise_kinds import LOG_MEDIANS, LOG_PRECISIONS, NOISE_FIELDS, NOISE_KINDS, NOISE_PARAMETERS
from fieldsid.noise.secant_information import with_secants
from fieldsid.noise.white_floor import MIN_ANGLE_NOISE_RAD, MIN_RATE_NOISE_RAD_S, WhiteBounds, white_noise_floor
from fieldsid.noise.whiten import base_dynamics, noise_vector, whiten
from fieldsid.numerics.arrays import FloatArray
from fieldsid.numerics.bounded_lm_step import bounded_step
from fieldsid.runtime.evaluation_counter import EvaluationCounter

MIN_NOISE_SIGNAL_SHARE = 1e-4
MAX_SCORING_ITERATIONS, MIN_DAMPING, MIN_DAMPING_AFTER_REFUSAL = 30, 1e-3, 0.1
"""Most iterations, least damping of a step, and the least damping from which a refused step raises it."""
MAX_LOG_STEP = 1.5
"""Longest step of the logarithm of a noise parameter: the Fisher information is valid only locally."""
BELOW_ANY_BOUND = 1e-12
"""A value below the lower bound of every noise parameter, so that its logarithm exists."""
MIN_SCORING_GAIN = 0.02
"""Gain in log likelihood below which the iteration ends."""
GRADIENT_STEP = 1e-4


def log_likelihood(
    records: Sequence[Record], dynamics: Sequence[tuple[float, float]], residuals: Sequence[FloatArray], noise: Noise
) -> float:
    """Return the Gaussian log likelihood, up to its constant, of residuals [(2, n)] under a noise.

    It is minus infinity where a residual is not finite, as that of an unbounded motion.
    """
    if not all(np.isfinite(e).all() for e in residuals):
        return -np.inf
    total = 0.0
    for record, (a, k), e in zip(records, dynamics, residuals, strict=True):
        white, logs = whiten(record, noise, a, k, e[None])
        total -= 0.5 * (logs + float(np.vdot(white, white)))
    return total


def log_prior(noise: Noise) -> float:
    """Return the log prior density of the parameters of a noise, up to a constant; see `NoiseParameter.usual`."""
    numbers = noise_vector(noise)
    place = np.array([i for i in map(NOISE_FIELDS.index, kind_of(numbers).fields) if LOG_PRECISIONS[i] > 0.0], dtype=np.int64)
    return _log_prior_at(np.log(numbers[place]), place)


def _log_prior_at(x: FloatArray, place: npt.NDArray[np.int64]) -> float:
    """Return the log prior density, up to a constant, of the logarithms x (P,) of the noise parameters at `place` (P,)."""
    return -0.5 * float(LOG_PRECISIONS[place] @ (x - LOG_MEDIANS[place]) ** 2)


def estimate_noise(
    records: Sequence[Record],
    dynamics: Sequence[tuple[float, float]],
    residuals: Sequence[FloatArray],
    noise_kind: str,
    start: Noise,
    likelihood: Callable[[FloatArray], float] | None = None,
    white: WhiteBounds | None = None,
    *,
    reinitialise: bool = True,
    has_prior: bool = False,
    evaluations: EvaluationCounter | None = None,
) -> tuple[Noise, float]:
    """Return the noise of a kind with the highest likelihood, and that log likelihood.

    `dynamics` are (damping, stiffness) of each run's base model. `start` is where the search begins. `likelihood` is a function
    of a noise vector (7,), by default the likelihood of the residuals. `white` are the bounds of the white noise, by default near
    the floor of the signals' third differences. With `reinitialise`, components that are nearly zero in `start`
    begin at a share of their rough size. With `has_prior` the prior density is part of the objective, see `log_prior`.
    `evaluations` counts the runs filtered. The method is Fisher scoring on the logarithms of the noise parameters (Harvey 1989,
    section 3.4.5). Where a `likelihood` is given, its gradient is by differences and the information is still that of the
    residuals. Where a residual is not finite, `start` and minus infinity are returned.
    """
    if not all(np.isfinite(e).all() for e in residuals):
        return start, -np.inf
    names = NOISE_KINDS[noise_kind].fields
    white = white or WhiteBounds.near(white_noise_floor(records))
    initial, near_zero = _reinitialised(records, dynamics, residuals, white.floor, start) if reinitialise else ({}, ())
    low, high = _bounds(names, white, _least_white_noise(records))
    place = np.array([NOISE_FIELDS.index(n) for n in names])
    known = np.array([p.absent for p in NOISE_PARAMETERS.values()])
    counted = evaluations or EvaluationCounter()
    slope = _LogNoiseLikelihood(records, dynamics, residuals, known, place, has_prior, likelihood, counted)
    x = np.clip(np.log([max(initial.get(n, getattr(start, n)), BELOW_ANY_BOUND) for n in names]), low, high)
    value, score, fisher = slope.at(x)
    stays_zero = np.array([n in near_zero for n in names]) & (score <= 0.0)
    if stays_zero.any():  # a component near zero that gains nothing by growing would take many steps to its lower bound
        x[stays_zero] = low[stays_zero]
        value, score, fisher = slope.at(x)
    damping, secants, curvature = MIN_DAMPING, list[tuple[FloatArray, FloatArray]](), fisher
    for _ in range(MAX_SCORING_ITERATIONS):
        # the step of each parameter is bounded and the others are solved for given that: scaling the entire step would let one
        # parameter on its way to zero slow all others down
        moved = bounded_step(curvature, score, damping, x, np.maximum(low, x - MAX_LOG_STEP), np.minimum(high, x + MAX_LOG_STEP))
        if float(score @ moved) < MIN_SCORING_GAIN:
            break
        trial, sufficient = x + moved, value + MIN_SCORING_GAIN
        new = slope.at(trial, sufficient)
        if value < new[0] < sufficient:
            x, value = trial, new[0]
            break
        if new[0] > value:
            gained, expected, x = new[0] - value, float(score @ moved - 0.5 * moved @ curvature @ moved), trial
            secants = [*secants, (moved, score - new[1])][-x.size :]
            value, score, fisher = new
            curvature = with_secants(fisher, secants)
            damping = max(damping * _next_damping(gained / expected), MIN_DAMPING)
        else:
            damping = max(damping, MIN_DAMPING_AFTER_REFUSAL) * 6.0
    return Noise(*slope.vector(x).tolist()), value


def _next_damping(gained_share: float) -> float:
    """Return the factor of the damping after a step that gained this share of the predicted gain."""
    return 0.1 if gained_share > 0.5 else 1.0 if gained_share > 0.25 else 3.0


@dataclass(frozen=True, slots=True)
class _LogNoiseLikelihood:
    """The log likelihood of residuals as a function of the logarithms of some of the noise parameters."""

    records: Sequence[Record]
    dynamics: Sequence[tuple[float, float]]
    residuals: Sequence[FloatArray]
    known: FloatArray
    place: npt.NDArray[np.int64]
    has_prior: bool
    likelihood: Callable[[FloatArray], float] | None
    evaluations: EvaluationCounter

    def vector(self, x: FloatArray) -> FloatArray:
        """Return the noise vector (7,) at logarithms x (P,)."""
        noise = self.known.copy()
        noise[self.place] = np.exp(x)
        return noise

    def at(self, x: FloatArray, least: float = -np.inf) -> tuple[float, FloatArray, FloatArray]:
        """Return log likelihood, score (P,) and information (P, P) at x (P,); minus infinity where one is not finite.

        Where the likelihood is below `least`, score and information are not computed: they are zero and the identity.
        """
        count, noise = x.size, self.vector(x)
        runs = [(r, *base_dynamics(a, k), e) for r, (a, k), e in zip(self.records, self.dynamics, self.residuals, strict=True)]
        here = [innovations_of(r, a, k, noise, e) for r, a, k, e in runs]
        learned = sum(h.likelihood for h in here) if self.likelihood is None else self.likelihood(noise)
        total = learned + self.has_prior * _log_prior_at(x, self.place)
        if not (np.isfinite(total) and total >= least):
            return (total if np.isfinite(total) else -np.inf), np.zeros(count), np.eye(count)
        parts = [information(r, a, k, noise, self.place, e, h) for (r, a, k, e), h in zip(runs, here, strict=True)]
        self.evaluations.add(len(parts))
        score, fisher = np.sum([s for s, _ in parts], axis=0), np.sum([f for _, f in parts], axis=0)
        if self.likelihood is not None:
            score = np.array(
                [(self.likelihood(self.vector(x + d)) - learned) / GRADIENT_STEP for d in GRADIENT_STEP * np.eye(count)]
            )
        precisions = self.has_prior * LOG_PRECISIONS[self.place]
        score, fisher = score - precisions * (x - LOG_MEDIANS[self.place]), fisher + np.diag(precisions)
        known = np.isfinite(score).all() and np.isfinite(fisher).all()
        return (total, score, fisher) if known else (-np.inf, np.zeros(count), np.eye(count))


def _bounds(names: tuple[str, ...], white: WhiteBounds, least: tuple[float, float]) -> tuple[FloatArray, FloatArray]:
    """Return the bounds of the logarithms of noise parameters, with those of the white sensor noise given.

    Where the floor is below `least` (angle, rate), that is the lower bound.
    """
    floor = white.floor
    least_white = (
        low if seen > bound else bound
        for low, seen, bound in zip((white.least.angle, white.least.rate), (floor.angle, floor.rate), least, strict=True)
    )
    low = {n: p.low for n, p in NOISE_PARAMETERS.items()} | dict(zip(("angle", "rate"), least_white, strict=True))
    high = {n: p.high for n, p in NOISE_PARAMETERS.items()} | {
        "angle": max(2.0 * floor.angle, 2.5 * least[0]),
        "rate": max(2.0 * floor.rate, 2.5 * least[1]),
    }
    return np.log([low[n] for n in names]), np.log([high[n] for n in names])


def _least_white_noise(records: Sequence[Record]) -> tuple[float, float]:
    """Return the least white noise of angle and rate: a share of the channel's rms, below which no model can be exact.

    It matters for a signal that was filtered before it was logged and shows no white noise at all.
    """
    angle = _rms([r.angle[r.angle_ok] - r.angle[r.angle_ok].mean() for r in records if r.angle_ok.any()])
    rate = _rms([r.rate[r.rate_ok] - r.rate[r.rate_ok].mean() for r in records if r.rate_ok.any()])
    return max(MIN_NOISE_SIGNAL_SHARE * angle, MIN_ANGLE_NOISE_RAD), max(MIN_NOISE_SIGNAL_SHARE * rate, MIN_RATE_NOISE_RAD_S)


ROUGH_SHARE, ALMOST_NONE_SHARE = 0.5, 0.1
"""Share of its rough size at which a component starts where the start is white; and the share below which a component of another
start counts as nearly zero and is raised to it, as the likelihood has no slope at zero. Of 300 estimates in four diagnoses all
but two ended within 0.5 of the best log likelihood known. With a threshold of half the rough size six missed it by more, with no
threshold nine."""


def _reinitialised(
    records: Sequence[Record],
    dynamics: Sequence[tuple[float, float]],
    residuals: Sequence[FloatArray],
    floor: Noise,
    start: Noise,
) -> tuple[dict[str, float], Collection[str]]:
    """Return the noise parameters that are changed from the start, and the components that are nearly zero in the start."""
    rms_angle = _rms([e[0][r.angle_ok] for e, r in zip(residuals, records, strict=True)])
    rms_rate = _rms([e[1][r.rate_ok] for e, r in zip(residuals, records, strict=True)])
    excess_rate = max(float(np.sqrt(max(rms_rate**2 - floor.rate**2, 0.0))), 0.1 * floor.rate)
    excess_angle = max(float(np.sqrt(max(rms_angle**2 - floor.angle**2, 0.0))), 0.1 * floor.angle)
    damping = max(float(np.mean([max(d[0], 0.1) for d in dynamics])), 0.1)
    rough = {"disturbance": damping * excess_rate + 1e-6, "coloured_angle": excess_angle, "coloured_rate": excess_rate}
    if all(getattr(start, name) == 0.0 for name in rough):
        return {"angle": floor.angle, "rate": floor.rate} | {name: ROUGH_SHARE * size for name, size in rough.items()}, ()
    least = {name: ALMOST_NONE_SHARE * size for name, size in rough.items()}
    near_zero = {name: size for name, size in least.items() if getattr(start, name) < size}
    return near_zero, near_zero


def _rms(parts: list[FloatArray]) -> float:
    values = np.concatenate(parts) if parts else np.zeros(0)
    return float(np.sqrt(np.mean(values**2))) if values.size else 0.0
