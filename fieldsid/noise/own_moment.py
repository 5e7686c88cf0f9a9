"""The noise of runs of which each has a constant moment of its own, by maximum likelihood.

The moment's standard deviation s and the rest of the noise are estimated in turn: the rest from residuals less each run's most
probable moment, s from what the runs tell of their moments. With r a run's response to a unit moment and e its residual, both
whitened and free of its initial state, q = r'r and t = r'e, its log likelihood is, up to a constant,

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
from fieldsid.noise.whiten import base_dynamics, whiten
from fieldsid.numerics.arrays import FloatArray
from fieldsid.numerics.gram_least_squares import solve_normal_equations
from fieldsid.runtime.evaluation_counter import EvaluationCounter

DEAD_BAND_RAD = 0.0017
"""A tenth of a degree: the dead band of a digital servo and its linkage, anywhere in which the middle of a fin may lie."""
FIN_REPEATABILITY_RAD = DEAD_BAND_RAD / sqrt(12.0)
"""The standard deviation of that, the largest of the runs' own moments as an angle of the fin: one that differs more from run to
run is no trim."""
MIN_OWN_MOMENT_GAIN = 0.5
"""Log likelihood that moments of the runs' own must gain: half a unit is what one parameter gains by chance."""
STD_GRID = np.geomspace(1e-3, 1.0, 61)
"""Shares of the largest standard deviation that are tried: neighbours differ by an eighth, which costs less than 0.01."""
MAX_ROUNDS, SAME_STD_RATIO = 3, 1.3
"""Rounds in which both are estimated in turn, and the ratio within which a new standard deviation ends them."""


@dataclass(frozen=True, slots=True)
class MomentInformation:
    """What a run tells of its own moment, free of its initial state.

    Information q in (rad/s^2)^-2, pull t, and how angle and rate at the start (2,) move with a unit moment.
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
    """Return what residuals [(2, n)] of runs tell of each run's own moment under a noise, its own moment left out of that."""
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
    """Return the standard deviation (rad/s^2) of a disturbance's mean over a run of that length (s).

    Of an AR(1) moment of size w and time T: w^2 (2 T / span) (1 - (T / span) (1 - exp(-span / T))).
    """
    share = noise.disturbance_time / span
    return noise.disturbance * float(np.sqrt(2.0 * share * (1.0 + share * np.expm1(-1.0 / share))))


def likeliest_std(runs: Sequence[MomentInformation], most: float) -> float:
    """Return the standard deviation (rad/s^2) of the runs' own moments, at most `most`, zero where none gains likelihood.

    One run alone does not tell its own moment from the trim of all.
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
    start: Noise, floor: Noise, most: float, known: Sequence[MomentInformation] = (), *,
    reinitialise: bool = True, evaluations: EvaluationCounter | None = None,
) -> tuple[Noise, float]:  # fmt: skip
    """Return the noise of a kind, each run's own moment with it, of the highest posterior density, and the log of that.

    It is the likelihood times the prior density, each up to a constant. Arguments are those of `estimate_noise`; `most` is the
    largest standard deviation of the moments (rad/s^2), `known` what other runs tell of theirs. Where the motion is without
    bound: the start, and minus infinity.
    """
    noise, std = start, start.own_moment if len(records) + len(known) > 1 else 0.0
    for count in range(MAX_ROUNDS):
        left, again = _less_own_moments(records, dynamics, residuals, noise, std), reinitialise and count == 0
        noise, value = estimate_noise(
            records, dynamics, left, noise_kind, noise, floor=floor, reinitialise=again, has_prior=True, evaluations=evaluations
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
    """Return residuals [(2, n)] less what each run's most probable own moment does, its start moved along."""
    if std == 0.0 or not all(np.isfinite(e).all() for e in residuals):
        return residuals
    left = []
    for record, (a, k), e, told in zip(
        records, dynamics, residuals, moment_information(records, dynamics, residuals, noise), strict=True
    ):
        moment, *starts = base_responses(record.nominal_steps, *base_dynamics(a, k))
        free = moment - np.tensordot(told.start, np.stack(starts), axes=1)
        left.append(np.where(record.ok, e - told.most_probable(std) * free, 0.0))
    return left
