"""The noise of several runs, each with a random constant moment, by maximum likelihood.

The standard deviation s of the moments and the other noise parameters are estimated in turn: the latter from the residuals less
the response to each run's most probable moment, s from q and t of the runs. Let r be the response of a run to a unit moment and e
its residual, both whitened and with the initial state projected out, q = r'r and t = r'e. The log likelihood of the run is, up to
a constant,

    -log(1 + s^2 q) / 2 + s^2 t^2 / (2 + 2 s^2 q),   and the most probable moment is s^2 t / (1 + s^2 q).
Source: Searle, Casella and McCulloch 1992, Variance Components, chapter 6.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import sqrt

import numpy as np

from fieldsid.models.model import Noise
from fieldsid.models.record import Record
from fieldsid.noise.maximum_likelihood import estimate_noise, log_likelihood, log_prior
from fieldsid.noise.moment_response import base_responses
from fieldsid.noise.white_floor import WhiteBounds
from fieldsid.noise.whiten import base_dynamics, whiten
from fieldsid.numerics.arrays import FloatArray
from fieldsid.numerics.gram_least_squares import solve_normal_equations
from fieldsid.runtime.evaluation_counter import EvaluationCounter

DEAD_BAND_RAD = 0.0017
"""A tenth of a degree: the dead band of a digital servo and its linkage, within which the neutral position of a fin may lie."""
FIN_REPEATABILITY_RAD = DEAD_BAND_RAD / sqrt(12.0)
"""The standard deviation of a uniform distribution over the dead band. As a fin angle it is the largest standard deviation of the
runs' moments: a moment that differs more from run to run is not a trim."""
MIN_OWN_MOMENT_GAIN = 0.5
"""Least gain of log likelihood by the moments of the runs: half a unit is the expected gain of one parameter by chance."""
STD_GRID = np.geomspace(1e-3, 1.0, 61)
"""Shares of the largest standard deviation that are tried: neighbours differ by an eighth, which loses less than 0.01 of log
likelihood."""
MAX_ROUNDS, SAME_STD_RATIO = 3, 1.3
"""Most rounds of the alternation, and the ratio of two successive standard deviations at which it ends."""


@dataclass(frozen=True, slots=True)
class MomentInformation:
    """The information of a run about its constant moment, with the initial state projected out.

    information q in (rad/s^2)^-2, pull t = r'e, and start (2,), the change of initial angle and rate with a unit moment.
    """

    information: float
    pull: float
    start: FloatArray

    def most_probable(self, std: float) -> float:
        """Return the posterior mean (rad/s^2) under a prior of that standard deviation."""
        return std**2 * self.pull / (1.0 + std**2 * self.information)


def moment_information(
    records: Sequence[Record], dynamics: Sequence[tuple[float, float]], residuals: Sequence[FloatArray], noise: Noise
) -> tuple[MomentInformation, ...]:
    """Return the information of residuals [(2, n)] about each run's moment, under a noise without its `own_moment`."""
    stationary, found = replace(noise, own_moment=0.0), list[MomentInformation]()
    for record, (a, k), residual in zip(records, dynamics, residuals, strict=True):
        series = np.concatenate([residual[None], base_responses(record.nominal_steps, *base_dynamics(a, k))])
        white, _ = whiten(record, stationary, a, k, series)
        flat = white.reshape(4, -1)
        gram = flat @ flat.T
        start = solve_normal_equations(gram[2:, 2:], gram[2:, 1])
        pull, information = gram[:2, 1] - gram[:2, 2:] @ start
        found.append(MomentInformation(max(float(information), 0.0), float(pull), start))
    return tuple(found)


def disturbance_mean_std(noise: Noise, span: float) -> float:
    """Return the standard deviation (rad/s^2) of the mean of a disturbance over a run of length `span` (s).

    An AR(1) moment of standard deviation w and time T has the variance w^2 (2 T / span) (1 - (T / span) (1 - exp(-span / T))).
    """
    share = noise.disturbance_time / span
    return noise.disturbance * float(np.sqrt(2.0 * share * (1.0 + share * np.expm1(-1.0 / share))))


def likeliest_std(runs: Sequence[MomentInformation], most: float) -> float:
    """Return the likeliest standard deviation (rad/s^2) of the runs' moments, at most `most`; zero where it gains too little.

    It is zero for a single run, where a moment of the run cannot be distinguished from the common trim.
    """
    if len(runs) < 2 or not most > 0.0:
        return 0.0
    q, t = np.array([r.information for r in runs])[:, None], np.array([r.pull for r in runs])[:, None]
    v = (most * STD_GRID) ** 2
    gain = 0.5 * (v * t**2 / (1.0 + v * q) - np.log1p(v * q)).sum(axis=0)
    best = int(np.argmax(gain))
    return float(most * STD_GRID[best]) if gain[best] > MIN_OWN_MOMENT_GAIN else 0.0


def estimate_noise_of_runs(
    records: Sequence[Record], dynamics: Sequence[tuple[float, float]], residuals: Sequence[FloatArray], noise_kind: str,
    start: Noise, white: WhiteBounds, most: float, known: Sequence[MomentInformation] = (), *,
    reinitialise: bool = True, evaluations: EvaluationCounter | None = None,
) -> tuple[Noise, float]:  # fmt: skip
    """Return the noise of a kind, with `own_moment`, of the highest posterior density, and the log of that density.

    The density is the likelihood times the prior density, each up to a constant. The arguments are those of `estimate_noise`;
    `most` is the largest standard deviation of the moments (rad/s^2), `known` the information of other runs about their moments.
    Where a residual is not finite, `start` and minus infinity are returned.
    """
    noise, std = start, start.own_moment if len(records) + len(known) > 1 else 0.0
    for count in range(MAX_ROUNDS):
        reduced, again = _less_own_moments(records, dynamics, residuals, noise, std), reinitialise and count == 0
        noise, value = estimate_noise(
            records,
            dynamics,
            reduced,
            noise_kind,
            noise,
            white=white,
            reinitialise=again,
            has_prior=True,
            evaluations=evaluations,
        )
        if not np.isfinite(value):
            return start, -np.inf
        last, std = std, likeliest_std([*known, *moment_information(records, dynamics, residuals, noise)], most)
        if last == std or min(last, std) * SAME_STD_RATIO > max(last, std):
            break
    noise = replace(noise, own_moment=std)
    moved = not std == last == 0.0
    return noise, log_likelihood(records, dynamics, residuals, noise) + log_prior(noise) if moved else value


def _less_own_moments(
    records: Sequence[Record], dynamics: Sequence[tuple[float, float]], residuals: Sequence[FloatArray], noise: Noise, std: float
) -> Sequence[FloatArray]:  # fmt: skip
    """Return residuals [(2, n)] less the response to each run's most probable moment, with the initial state refitted."""
    if std == 0.0 or not all(np.isfinite(e).all() for e in residuals):
        return residuals
    reduced = []
    for record, (a, k), e, about_moment in zip(
        records, dynamics, residuals, moment_information(records, dynamics, residuals, noise), strict=True
    ):
        moment, *starts = base_responses(record.nominal_steps, *base_dynamics(a, k))
        response = moment - np.tensordot(about_moment.start, np.stack(starts), axes=1)
        reduced.append(np.where(record.ok, e - about_moment.most_probable(std) * response, 0.0))
    return reduced
