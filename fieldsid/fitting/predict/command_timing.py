"""The time, between two samples, at which a held command jumped: unknown from its log, but visible in the motion.

A log of one row for all shows a command at its samples only: a jump first seen at sample k was made at some time since sample
k - 1. One whose commands have times of their own keeps those. In a free run that time is a nuisance of the run, as its initial
state is. Each of K times is estimated by Gauss-Newton with a uniform prior over an interval, about one shift of them all; a
model that was fitted to such logs has absorbed half an interval, so that the shift lies between -1/2 and 1 of it. The times are
used only where they explain more than the shift alone (a delay or a clock offset) and a disturbance do: log L(own times) - log
L(shift) > (K - 1) / 2 log n + MIN_TIMING_EVIDENCE_GAIN with each likelihood at its best sensor noise and disturbance moment,
because a disturbance at the time of a jump looks the same. Source: Schwarz 1978, Annals of Statistics 6(2).
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
"""Share of the fin's whole range from which on a change within one interval is a jump; less is a fin that travels."""
MIN_SAMPLES_PER_JUMP = 20
"""Samples a jump at least: a command that always moves is a curve, not a row of jumps."""
MAX_JUMPS = 60
MIN_ERROR_RATIO = 1.05
"""Error over the noise below which there is nothing to explain."""
MIN_TIMING_EVIDENCE_GAIN = 6.0
"""Log evidence beyond the price of the times."""
MAX_TIMING_ITERATIONS = 4
MAX_CORRELATION_LAG_S = 2.0
MAX_ALTERNATIONS = 3
"""Turns of noise and start, each at its best for the other, as long as that gains anything."""
UNIFORM_VARIANCE_RATIO = 12.0
"""Square of an interval over the variance of what is spread evenly over it."""


def command_timing(problem: Problem, x: FloatArray, floor: Noise) -> Record | None:
    """Return the record of a one-run problem with its command's jumps timed, at the shared values and start in x.

    None where the log's own times do: without jumps, with the error down to the noise, or where it does not pay.
    """
    record = problem.records[0]
    jumps = jumps_of(record)
    if jumps.size < 2 or not _in_question(record, problem.residual(x, 0)[0], floor):
        return None
    slots = [i for i in problem.layout.nuisances_of(0) if problem.layout.parameters[i].name in START_NAMES]
    run = _CommandTiming(problem, x, jumps, floor, -problem.linearise(x, 0, slots).sensitivity * record.ok)
    slopes = run.slopes()
    if not np.isfinite(slopes).all():
        return None
    price = 0.5 * (slopes.shape[0] - 1) * np.log(len(record)) + MIN_TIMING_EVIDENCE_GAIN
    if not run.most_gain(slopes) > price:
        return None
    most, each = run.most, np.eye(slopes.shape[0])
    together, shift = run.best(slopes, each.sum(axis=1, keepdims=True), -0.5 * most, most)
    times, own = run.best(slopes, each, together - 0.5 * most, np.minimum(together + 0.5 * most, most))
    if not _rough_gain(record, shift, own) > price:
        return None
    likelihood, noise = run.likelihood(own)
    # under a noise of its own the shift is no less likely than under that of the times
    if not likelihood - run.likelihood_under(noise, shift)[0] > price:
        return None
    return run.record_with(times) if run.likelihood(shift, enough=likelihood - price)[0] < likelihood - price else None


def jumps_of(record: Record) -> npt.NDArray[np.intp]:
    """Return the samples (K,) at which a held command is first seen after a jump; none where it always moves or has its times."""
    change = np.abs(np.diff(record.fin))
    found = np.flatnonzero(change > MIN_JUMP_RANGE_SHARE * np.ptp(record.fin)) + 1
    told = (
        record.fin_is_held
        and record.fin_line is None
        and found.size * MIN_SAMPLES_PER_JUMP <= len(record)
        and found.size <= MAX_JUMPS
    )
    return found if told else found[:0]


def timing_note(record: Record) -> Note | None:
    """Return the note on a record whose command's jumps were timed, None for one that has them as logged."""
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
    """A one-run problem as a function of the times (K + 1,) in s by which its commands were given before their samples.

    One time for each jump, the last for all that is no jump.
    """

    problem: Problem
    x: FloatArray
    jumps: npt.NDArray[np.intp]
    floor: Noise
    starts: FloatArray
    """Change of the residual by each number of the initial state, (S, 2, n)."""

    @property
    def most(self) -> FloatArray:
        """The whole interval before each jump's sample, and a usual one, (K + 1,) s."""
        steps = self.problem.records[0].steps
        return np.append(steps[self.jumps - 1], np.median(steps))

    def record_with(self, times: FloatArray) -> Record:
        """Return the record with its commands given so much before their samples."""
        return self.problem.records[0].with_command_lead(self.command_lead(times))

    def command_lead(self, times: FloatArray) -> FloatArray:
        """Return by how much before its sample each command was given, (n,) s."""
        early = np.full(len(self.problem.records[0]), times[-1])
        early[self.jumps] = times[:-1]
        return early

    def residual(self, times: FloatArray) -> FloatArray:
        """Return measured minus simulated, (2, n)."""
        return replace(self.problem, records=(self.record_with(times),)).residual(self.x, 0)[0]

    def slopes(self) -> FloatArray:
        """Return the change of the residual by each time, (K + 1, 2, n), to first order in what half an interval does."""
        half, record = 0.5 * self.most, self.problem.records[0]
        logged = replace(self.problem, records=(self.record_with(0.0 * half),))
        moved = logged.command_sensitivities(self.x, 0, [record.path_with_lead(self.command_lead(t)) for t in np.diag(half)])
        return -moved * record.ok / half[:, None, None]

    def most_gain(self, slopes: FloatArray) -> float:
        """Return the log likelihood, roughly, that times free of bounds gain over one shift, to first order: no less."""
        logged = self.residual(0.0 * self.most)
        weight = 1.0 / residual_rms(self.problem.records[0], logged, self.floor)
        flat = (logged * weight[:, None]).ravel()
        left = []
        for columns in (slopes.sum(axis=0, keepdims=True), slopes):
            known = (np.concatenate([columns, self.starts]) * weight[:, None]).reshape(-1, flat.size)
            left.append((flat - gram_least_squares(known, flat) @ known).reshape(logged.shape))
        return _rough_gain(self.problem.records[0], *left)

    def best(self, slopes: FloatArray, shape: FloatArray, low: FloatArray, high: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the times of least weighted squares among shape (K + 1, m) times m numbers, and the residual they leave.

        They lie between low and high, (K + 1,), with a uniform prior over the interval. The start is refitted to first order; the
        residual is that of the simulation at the times, corrected for it.
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
            left = self._restarted(raw, weight)
        return times, left

    def likelihood(self, residual: FloatArray, *, enough: float = np.inf) -> tuple[float, Noise]:
        """Return the log likelihood of a residual (2, n) at its best start, under noise and disturbance of its own, and that.

        Noise and start are improved in turn, no further where the likelihood is `enough`.
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
        """Return the log likelihood of a residual (2, n) at its best start under a noise, and the residual there."""
        record, base = self.problem.records[0], self.problem.base_of(self.x, 0)
        white, logs = whiten(record, noise, base.damping, base.stiffness, np.concatenate([residual[None], self.starts]))
        flat = white.reshape(white.shape[0], -1)
        move = gram_least_squares(flat[1:], flat[0])
        value = -0.5 * (logs + float(np.sum((flat[0] - move @ flat[1:]) ** 2)))
        return value, np.asarray(residual - np.tensordot(move, self.starts, axes=1))

    def _restarted(self, residual: FloatArray, weight: FloatArray) -> FloatArray:
        """Return a residual (2, n) with what a better start would take from it taken away."""
        if not np.isfinite(residual).all():
            return residual
        flat = (self.starts * weight[:, None]).reshape(self.starts.shape[0], -1)
        move = gram_least_squares(flat, (residual * weight[:, None]).ravel())
        return np.asarray(residual - np.tensordot(move, self.starts, axes=(0, 0)))


def residual_rms(record: Record, residual: FloatArray, floor: Noise) -> FloatArray:
    """Return what is left of each channel (2,), at least its noise."""
    return np.array(
        [
            max(float(np.sqrt(np.mean(e[ok] ** 2))) if ok.any() else 0.0, sigma)
            for e, ok, sigma in zip(residual, record.ok, (floor.angle, floor.rate), strict=True)
        ]
    )


def _in_question(record: Record, residual: FloatArray, floor: Noise) -> bool:
    over = residual_rms(record, residual, floor) / np.array([floor.angle, floor.rate])
    return bool(np.isfinite(over).all() and over.max() > MIN_ERROR_RATIO)


def _rough_gain(record: Record, shift: FloatArray, own: FloatArray) -> float:
    """Return the log likelihood gained if what is left were white, correlated samples counted once: cheap."""
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
    # the products of all lags at once: one for each would cost its call
    products = np.correlate(np.concatenate([centred, np.zeros(reach)]), centred, "valid")
    if not products[0] > 0.0:
        return 1.0
    later = products[1:] / products[0]
    below = np.flatnonzero(later <= 0.0)
    return 1.0 + 2.0 * float(later[: below[0] if below.size else None].sum())
