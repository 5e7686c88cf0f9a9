"""The times between samples at which a zero-order-hold command jumped: not in the log, but visible in the motion.

A log with one row for all signals shows a command at its samples only: a jump first seen at sample k was made at an unknown time
since sample k - 1. A log with separate time stamps for the command keeps those. In a free run the times of the K jumps are
nuisance parameters of the run, as its initial state is. They are estimated by Gauss-Newton, each with a uniform prior over one
interval, relative to one common shift. A model that was fitted to such logs has absorbed half an interval, so that the shift lies
between -1/2 and 1 interval. The times are used only where they explain more than the shift alone (a delay or a clock offset)
together with a disturbance: log L(times) - log L(shift) > (K - 1) / 2 log n + MIN_TIMING_EVIDENCE_GAIN. Each likelihood is at its
best sensor noise and disturbance moment, because a disturbance at the time of a jump has the same effect. Source: Schwarz 1978,
Annals of Statistics 6(2).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from fieldsid.fitting.problem.parameters import START_NAMES
from fieldsid.fitting.problem.problem import Problem
from fieldsid.logs.run import Note
from fieldsid.models.model import Noise
from fieldsid.models.record import Record
from fieldsid.noise.maximum_likelihood import MIN_SCORING_GAIN, estimate_noise
from fieldsid.noise.whiten import whiten
from fieldsid.numerics.arrays import FloatArray
from fieldsid.numerics.gram_least_squares import gram_least_squares

MIN_JUMP_RANGE_SHARE = 0.25
"""Least change within one interval, as a share of the fin's range, that is a jump; smaller changes are a slow motion of the
fin."""
MIN_SAMPLES_PER_JUMP = 20
"""Least number of samples for each jump: a command that always moves is a curve and not a sequence of jumps."""
MAX_JUMPS = 60
MIN_ERROR_RATIO = 1.05
"""Ratio of error to noise below which the residual needs no explanation."""
MIN_TIMING_EVIDENCE_GAIN = 6.0
"""Log evidence that the times must gain beyond their penalty."""
MAX_TIMING_ITERATIONS = 4
MAX_CORRELATION_LAG_S = 2.0
MAX_ALTERNATIONS = 3
"""Most alternations between the noise and the initial state, each optimal for the other."""
UNIFORM_VARIANCE_RATIO = 12.0
"""Square of an interval over the variance of a uniform distribution on it."""


def command_timing(problem: Problem, x: FloatArray, floor: Noise) -> Record | None:
    """Return the record of a one-run problem with estimated times of its command's jumps, given x (N,).

    None where the logged times are to be used: there are no jumps, the error is as small as the noise, or the gain is too small.
    """
    record = problem.records[0]
    jumps = jumps_of(record)
    if jumps.size < 2 or not _exceeds_noise(record, problem.residual(x, 0)[0], floor):
        return None
    slots = [i for i in problem.layout.nuisances_of(0) if problem.layout.parameters[i].name in START_NAMES]
    run = _CommandTiming(problem, x, jumps, floor, -problem.linearise(x, 0, slots).sensitivity * record.ok)
    slopes = run.slopes()
    if not np.isfinite(slopes).all():
        return None
    price = 0.5 * (slopes.shape[0] - 1) * np.log(len(record)) + MIN_TIMING_EVIDENCE_GAIN
    if not run.largest_gain(slopes) > price:
        return None
    most, each = run.most, np.eye(slopes.shape[0])
    together, shift = run.best(slopes, each.sum(axis=1, keepdims=True), -0.5 * most, most)
    times, own = run.best(slopes, each, together - 0.5 * most, np.minimum(together + 0.5 * most, most))
    if not _rough_gain(record, shift, own) > price:
        return None
    likelihood, noise = run.likelihood(own)
    # the likelihood of the shift at its best noise is at least that under the noise of the times
    if not likelihood - run.likelihood_under(noise, shift)[0] > price:
        return None
    return run.record_with(times) if run.likelihood(shift, enough=likelihood - price)[0] < likelihood - price else None


def jumps_of(record: Record) -> npt.NDArray[np.intp]:
    """Return the samples (K,) that first show a jump of the command; empty where it always moves or has separate time stamps."""
    change = np.abs(np.diff(record.fin))
    found = np.flatnonzero(change > MIN_JUMP_RANGE_SHARE * np.ptp(record.fin)) + 1
    has_unknown_times = (
        record.fin_is_held
        and record.fin_line is None
        and found.size * MIN_SAMPLES_PER_JUMP <= len(record)
        and found.size <= MAX_JUMPS
    )
    return found if has_unknown_times else found[:0]


def timing_note(record: Record) -> Note | None:
    """Return the note on a record with estimated times of the command's jumps, None for one with the logged times."""
    if record.command_lead is None:
        return None
    jumps = jumps_of(record)
    early = record.command_lead[jumps]
    first, last = -1e3 * early.max(), -1e3 * early.min()
    return Note(
        "command_between_samples",
        f"{record.name}: as the motion says, {jumps.size} jumps of the command were made {first:+.0f} .. {last:+.0f} ms from "
        "the samples that first show them",
        {"run": record.name, "jumps": int(jumps.size), "mean_s": float(early.mean()), "largest_s": float(early.max())},
    )


@dataclass(frozen=True, slots=True)
class _CommandTiming:
    """A one-run problem as a function of the times (K + 1,) in s by which its commands precede their samples.

    There is one time for each jump; the last is that of all other samples.
    """

    problem: Problem
    x: FloatArray
    jumps: npt.NDArray[np.intp]
    floor: Noise
    starts: FloatArray
    """Derivatives of the residual by the initial state, (S, 2, n)."""

    @property
    def most(self) -> FloatArray:
        """The interval before the sample of each jump, and the median interval, (K + 1,) s."""
        steps = self.problem.records[0].steps
        return np.append(steps[self.jumps - 1], np.median(steps))

    def record_with(self, times: FloatArray) -> Record:
        """Return the record with its commands given `times` before their samples."""
        return self.problem.records[0].with_command_lead(self.command_lead(times))

    def command_lead(self, times: FloatArray) -> FloatArray:
        """Return the time (n,) in s by which each command precedes its sample."""
        early = np.full(len(self.problem.records[0]), times[-1])
        early[self.jumps] = times[:-1]
        return early

    def residual(self, times: FloatArray) -> FloatArray:
        """Return measured minus simulated, (2, n)."""
        return replace(self.problem, records=(self.record_with(times),)).residual(self.x, 0)[0]

    def slopes(self) -> FloatArray:
        """Return the derivatives of the residual by the times, (K + 1, 2, n), as differences over half an interval."""
        half, record = 0.5 * self.most, self.problem.records[0]
        logged = replace(self.problem, records=(self.record_with(0.0 * half),))
        moved = logged.command_sensitivities(self.x, 0, [record.path_with_lead(self.command_lead(t)) for t in np.diag(half)])
        return -moved * record.ok / half[:, None, None]

    def largest_gain(self, slopes: FloatArray) -> float:
        """Return an approximate upper bound of the log likelihood that the times gain over one shift, to first order."""
        logged = self.residual(0.0 * self.most)
        weight = 1.0 / residual_rms(self.problem.records[0], logged, self.floor)
        flat = (logged * weight[:, None]).ravel()
        left = []
        for columns in (slopes.sum(axis=0, keepdims=True), slopes):
            known = (np.concatenate([columns, self.starts]) * weight[:, None]).reshape(-1, flat.size)
            left.append((flat - gram_least_squares(known, flat) @ known).reshape(logged.shape))
        return _rough_gain(self.problem.records[0], *left)

    def best(self, slopes: FloatArray, shape: FloatArray, low: FloatArray, high: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the times shape (K + 1, m) @ (m,) of least weighted squares, and the residual there.

        They lie between low and high, (K + 1,), with the variance of a uniform prior over the interval. The initial state is
        refitted to first order; the residual is that of the simulation at the times, corrected for the new initial state.
        """
        columns = np.concatenate([np.tensordot(shape, slopes, axes=(0, 0)), self.starts])
        count, middle = shape.shape[1], 0.5 * (low + high)
        pull = np.zeros((columns.shape[0], middle.size))
        pull[:count] = shape.T * (UNIFORM_VARIANCE_RATIO / (high - low) ** 2)
        normal_pull = np.zeros((columns.shape[0], columns.shape[0]))
        normal_pull[:count, :count] = pull[:count] @ shape
        times = middle
        left = raw = self.residual(times)
        for _ in range(MAX_TIMING_ITERATIONS):
            if not np.isfinite(raw).all():
                break
            weight = 1.0 / residual_rms(self.problem.records[0], left, self.floor)
            flat = (columns * weight[:, None]).reshape(columns.shape[0], -1)
            gradient = flat @ (raw * weight[:, None]).ravel() - pull @ (middle - times)
            step = np.linalg.lstsq(flat @ flat.T + normal_pull, gradient, rcond=1e-12)[0]
            times = np.clip(times - shape @ step[:count], low, high)
            raw = self.residual(times)
            left = self._with_best_start(raw, weight)
        return times, left

    def likelihood(self, residual: FloatArray, *, enough: float = np.inf) -> tuple[float, Noise]:
        """Return the log likelihood of a residual (2, n) at its best noise, disturbance and initial state, and that noise.

        Noise and initial state are improved in turn until the likelihood reaches `enough` or gains no more.
        """
        record, base = self.problem.records[0], self.problem.base_of(self.x, 0)
        noise, best = self.floor, (-np.inf, self.floor)
        for count in range(MAX_ALTERNATIONS):
            noise, _ = estimate_noise(
                [record], [(base.damping, base.stiffness)], [residual], "disturbance", noise, reinitialise=count == 0,
                evaluations=self.problem.evaluations,
            )  # fmt: skip
            value, residual = self.likelihood_under(noise, residual)
            gained = value - best[0]
            best = max(best, (value, noise), key=lambda found: found[0])
            if gained < MIN_SCORING_GAIN or best[0] >= enough:
                break
        return best

    def likelihood_under(self, noise: Noise, residual: FloatArray) -> tuple[float, FloatArray]:
        """Return the log likelihood of a residual (2, n) at its best initial state under a noise, and the residual there."""
        record, base = self.problem.records[0], self.problem.base_of(self.x, 0)
        white, logs = whiten(record, noise, base.damping, base.stiffness, np.concatenate([residual[None], self.starts]))
        flat = white.reshape(white.shape[0], -1)
        move = gram_least_squares(flat[1:], flat[0])
        value = -0.5 * (logs + float(np.sum((flat[0] - move @ flat[1:]) ** 2)))
        return value, np.asarray(residual - np.tensordot(move, self.starts, axes=1))

    def _with_best_start(self, residual: FloatArray, weight: FloatArray) -> FloatArray:
        """Return a residual (2, n) after a least-squares correction of the initial state."""
        if not np.isfinite(residual).all():
            return residual
        flat = (self.starts * weight[:, None]).reshape(self.starts.shape[0], -1)
        move = gram_least_squares(flat, (residual * weight[:, None]).ravel())
        return np.asarray(residual - np.tensordot(move, self.starts, axes=(0, 0)))


def residual_rms(record: Record, residual: FloatArray, floor: Noise) -> FloatArray:
    """Return the root mean square residual of each channel (2,), at least its noise."""
    return np.array(
        [
            max(float(np.sqrt(np.mean(e[ok] ** 2))) if ok.any() else 0.0, sigma)
            for e, ok, sigma in zip(residual, record.ok, (floor.angle, floor.rate), strict=True)
        ]
    )


def _exceeds_noise(record: Record, residual: FloatArray, floor: Noise) -> bool:
    over = residual_rms(record, residual, floor) / np.array([floor.angle, floor.rate])
    return bool(np.isfinite(over).all() and over.max() > MIN_ERROR_RATIO)


def _rough_gain(record: Record, shift: FloatArray, own: FloatArray) -> float:
    """Return an approximate gain of log likelihood: residuals taken as white, correlated samples counted once."""
    total, lags = 0.0, round(MAX_CORRELATION_LAG_S / float(np.median(record.steps)))
    for before, after, ok in zip(shift, own, record.ok, strict=True):
        if ok.any():
            size = float(ok.sum()) / correlation_length(after[ok], lags)
            total += 0.5 * size * float(np.log(np.mean(before[ok] ** 2) / np.mean(after[ok] ** 2)))
    return total


def correlation_length(values: FloatArray, lags: int) -> float:
    """Return 1 + 2 sum of the autocorrelation up to its first value below zero, in samples."""
    centred = values - values.mean()
    reach = min(lags, values.size - 1)
    # one call for the products of all lags: a loop would cost one call for each
    products = np.correlate(np.concatenate([centred, np.zeros(reach)]), centred, "valid")
    if not products[0] > 0.0:
        return 1.0
    later = products[1:] / products[0]
    below = np.flatnonzero(later <= 0.0)
    return 1.0 + 2.0 * float(later[: below[0] if below.size else None].sum())
