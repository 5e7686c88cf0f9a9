"""Tests of the final model's innovations, which separate a disturbance from an effect that is not in the catalogue.

A disturbance is a stationary Gaussian moment, independent of the fin and the motion. Its innovations under the fitted noise model
are white, of constant variance, and unrelated to the fin and the motion. Three tests look for violations: whiteness (Ljung-Box);
dependence on fin and motion (F test, the score test of diagnosis/residual_tests/memory_score_test.py, Breusch-Pagan test) and on
other measured signals (F test); and constant variance (largest windowed energy, homoscedasticity of the windows).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import factorial

import numpy as np

from fieldsid.diagnosis.evidence.likelihood_fit import LikelihoodFit
from fieldsid.diagnosis.residual_tests.memory_score_test import memory_score_test
from fieldsid.diagnosis.thresholds import COLOUR_P_EXPONENT
from fieldsid.fitting.problem.problem import Problem
from fieldsid.models.model import Noise
from fieldsid.models.record import Record
from fieldsid.noise.whiten import whiten
from fieldsid.numerics.arrays import FloatArray
from fieldsid.numerics.block_means import block_means
from fieldsid.numerics.ljung_box import ljung_box_p
from fieldsid.numerics.tail_probabilities import chi_square_tail, f_tail, pearson3_tail

ENERGY_WINDOW_S = 2.0
HISTORY_SPAN_S = 3.0
BREUSCH_PAGAN_BLOCK_S, MIN_BLOCKS = 1.0, 20
BLOCK_S, BLOCKS_PER_WINDOW = 0.5, 8
"""Length of a block of slow innovations, in s, and the number of blocks in a window whose energy is tested."""


@dataclass(frozen=True, slots=True)
class ResidualTests:
    """The p-values of the three tests, and where the windowed energy is largest: run, start and end in s, ratio to the mean."""

    colour: float
    dependence: float
    bursts: float
    worst_run: str
    worst_start_s: float
    worst_end_s: float
    worst_ratio: float
    moves_with: str

    @property
    def p(self) -> float:
        """The smallest of the three p-values, corrected for three tests (Bonferroni) and for disturbances of any spectrum."""
        return min(1.0, 3.0 * min(float(self.colour**COLOUR_P_EXPONENT), self.dependence, self.bursts))


@dataclass(frozen=True, slots=True)
class Innovations:
    """Innovations (2, n) of one run, and its simulated rate (n,)."""

    record: Record
    white: FloatArray
    rate: FloatArray


def residual_tests(ml_fit: LikelihoodFit) -> ResidualTests:
    """Return the tests of a fit's innovations on its training runs, under the noise of the fit.

    The validation runs are left out: there the errors of the parameters follow the motion and would be taken for a missing
    effect.
    """
    runs = _training(ml_fit)
    memory = memory_score_test(ml_fit.fitted, ml_fit.noise)
    relation, name = min(_dependence(runs), _other_signals(runs), _breusch_pagan(runs), (memory.p, memory.what))
    relation = min(1.0, 4.0 * relation)
    bursts, run, window, ratio = _maximum_energy(runs)
    start = runs[run].record.time[0] + window * ENERGY_WINDOW_S
    bursts = min(1.0, 2.0 * min(bursts, _homoscedasticity(runs)))
    return ResidualTests(
        _colour(runs),
        relation,
        bursts,
        runs[run].record.name,
        float(start),
        float(start + ENERGY_WINDOW_S),
        ratio,
        name,
    )


def _training(ml_fit: LikelihoodFit) -> list[Innovations]:
    problem, x = ml_fit.fitted.problem, ml_fit.fitted.x
    return [_innovations(problem, x, run, ml_fit.noise) for run in range(len(problem.records))]


def _innovations(problem: Problem, x: FloatArray, run: int, noise: Noise) -> Innovations:
    record = problem.records[run]
    motion, base = problem.simulate(x, run)
    residual, _ = problem.residual(x, run)
    white, _ = whiten(record, noise, base.damping, base.stiffness, residual[None])
    return Innovations(record, white[0], motion.rate)


def _colour(runs: Sequence[Innovations]) -> float:
    return min(1.0, 2.0 * min(ljung_box_p(run.white[c][run.record.ok[c]] for run in runs) for c in range(2)))


def _features(run: Innovations, width: int) -> dict[str, FloatArray]:
    """Return block means of the signals that a missing effect could depend on, by name."""
    fin, rate = run.record.fin - run.record.fin.mean(), run.rate
    lags = max(1, round(HISTORY_SPAN_S / BLOCK_S))
    parts: dict[str, FloatArray] = {"rate x |rate|": rate * np.abs(rate), "rate cubed": rate**3, "fin x rate": fin * rate}
    parts |= {"rate": rate, "fin x |fin|": fin * np.abs(fin), "fin squared": fin**2, "rate squared": rate**2}
    blocks = {name: block_means(v, width) for name, v in parts.items()}
    mean = block_means(fin, width)
    for lag in range(lags):
        blocks[f"fin {lag * BLOCK_S:g} s before" if lag else "fin"] = np.concatenate([np.zeros(lag), mean[: mean.size - lag]])
    return blocks


def _dependence(runs: Sequence[Innovations]) -> tuple[float, str]:
    """Return the p-value of an F test of innovations against fin and motion, and the best feature."""
    return _regression(runs, _features)


def _other_signals(runs: Sequence[Innovations]) -> tuple[float, str]:
    """Return the p-value of an F test of innovations against other signals that every run has, and the best feature.

    Roll, depth, speed and thrust enter with their rates and the signed squares of both: a moment that depends on one of them, in
    a form outside the catalogue, is not a disturbance.
    """
    shared = sorted(set.intersection(*(set(run.record.signals) for run in runs)))
    return _regression(runs, lambda run, width: _signal_features(run, width, shared)) if shared else (1.0, "")


def _signal_features(run: Innovations, width: int, roles: Sequence[str]) -> dict[str, FloatArray]:
    blocks = {}
    for role in roles:
        value = run.record.signals[role] - run.record.signals[role].mean()
        slope = np.gradient(value, run.record.time)
        for name, v in ((role, value), (f"{role} rate", slope)):
            blocks[name] = block_means(v, width)
            blocks[f"{name} x |{name}|"] = block_means(v * np.abs(v), width)
    return blocks


def _regression(
    runs: Sequence[Innovations], features_of: Callable[[Innovations, int], dict[str, FloatArray]]
) -> tuple[float, str]:
    """Return the p-value of an F test of slow innovations against features of all runs together, and the best feature."""
    target, columns, names = [], [], list[str]()
    for run in runs:
        slow, width = _slow(run, BLOCK_S)
        features = features_of(run, width)
        names = list(features)
        target.append(slow)
        columns.append(np.column_stack(list(features.values())))
    y, x = np.concatenate(target), np.concatenate(columns)
    p, index = _f_test(y - y.mean(), x - x.mean(axis=0))
    return p, names[index]


def _slow(run: Innovations, seconds: float) -> tuple[FloatArray, int]:
    """Return means of the innovations over blocks, scaled to unit variance, and the number of samples of a block.

    A disturbance stands out from sensor noise at low frequencies.
    """
    width = max(1, round(seconds / float(np.median(run.record.steps))))
    channel = 1 if run.record.rate_ok.any() else 0
    return block_means(run.white[channel], width) * np.sqrt(width), width


def _breusch_pagan(runs: Sequence[Innovations]) -> tuple[float, str]:
    """Return the p-value of a test for a variance of slow innovations that grows with the motion or the fin, and the feature.

    A missing factor of damping or authority acts in proportion to what it multiplies; a disturbance does not. Score test of
    variance = 1 + g (x / mean x - 1) for g > 0: sum of (x / mean x - 1) (e^2 / mean e^2 - 1), its first three moments those of a
    weighted sum of chi squares (Breusch and Pagan 1979, Econometrica 47(5)).
    """
    size, parts = [], []
    for run in runs:
        slow, width = _slow(run, BREUSCH_PAGAN_BLOCK_S)
        fin, rate = run.record.fin - run.record.fin.mean(), run.rate
        size.append(slow**2)
        parts.append([block_means(v, width) for v in (rate**2, fin**2, np.abs(fin * rate))])
    y = np.concatenate(size)
    best, name = 1.0, ""
    for what, blocks in zip(("rate squared", "fin squared", "|fin x rate|"), zip(*parts, strict=True), strict=True):
        x = np.concatenate(blocks)
        if not (x.size > MIN_BLOCKS and x.mean() > 0.0 and y.mean() > 0.0):
            continue
        w = x / x.mean() - 1.0
        spread = np.sqrt(2.0 * float(w @ w))
        if spread > 0.0:
            p = pearson3_tail(float(w @ (y / y.mean() - 1.0)) / spread, 8.0 * float(np.sum(w**3)) / spread**3)
            best, name = min((best, name), (3.0 * p, f"the size of {what}"))
    return min(best, 1.0), name


def _f_test(y: FloatArray, x: FloatArray) -> tuple[float, int]:
    size = np.linalg.norm(x, axis=0)
    x = x[:, size > 1e-12] / size[size > 1e-12]
    if y.size <= 3 * x.shape[1] or x.shape[1] == 0:
        return 1.0, 0
    solved, _, rank, _ = np.linalg.lstsq(x, y, rcond=1e-9)
    left = y - x @ solved
    freedom = y.size - 1 - int(rank)
    f = ((float(y @ y) - float(left @ left)) / int(rank)) / (float(left @ left) / freedom)
    single = np.abs(x.T @ y)
    return f_tail(f, int(rank), freedom), int(np.flatnonzero(size > 1e-12)[int(np.argmax(single))])


def _maximum_energy(runs: Sequence[Innovations]) -> tuple[float, int, int, float]:
    """Return the p-value of the largest windowed energy, and its run, window and ratio to the average."""
    smallest, where = 1.0, (0, 0, 1.0)
    count = 0
    for channel in range(2):
        for slow in (False, True):
            energies = [(i, *e) for i, run in enumerate(runs) if (e := _energy(run, channel, slow=slow)) is not None]
            if not energies:
                continue
            average = float(np.mean(np.concatenate([e / w for _, w, e in energies])))
            for i, width, energy in energies:
                count += energy.size
                index = int(np.argmax(energy))
                p = chi_square_tail(energy[index] / average, width)
                if p < smallest:
                    smallest, where = p, (i, index, float(energy[index] / average / width))
    return min(1.0, smallest * max(count, 1)), *where


def _homoscedasticity(runs: Sequence[Innovations]) -> float:
    """Return the p-value of the windows' energies under constant variance, each run relative to its own mean.

    Of w blocks with variance one the mean square X has the cumulants (r-1)! (2/w)^(r-1); the sum of (X - 1)^2 over windows is
    tested by its first three moments (Pearson's type III).
    """
    squared = [block_means(_slow(run, BLOCK_S)[0] ** 2, BLOCKS_PER_WINDOW) for run in runs]
    y = np.concatenate([(x / x.mean() - 1.0) ** 2 for x in squared if x.size > 1 and x.mean() > 0.0] or [np.zeros(0)])
    if y.size < MIN_BLOCKS:
        return 1.0
    k2, k3, k4, k6 = (factorial(r - 1) * (2.0 / BLOCKS_PER_WINDOW) ** (r - 1) for r in (2, 3, 4, 6))
    fourth, sixth = k4 + 3.0 * k2**2, k6 + 15.0 * k4 * k2 + 10.0 * k3**2 + 15.0 * k2**3
    variance, third = fourth - k2**2, sixth - 3.0 * fourth * k2 + 2.0 * k2**3
    z = float(np.sum(y - k2)) / np.sqrt(y.size * variance)
    return pearson3_tail(z, third / variance**1.5 / np.sqrt(y.size))


def _energy(run: Innovations, channel: int, *, slow: bool) -> tuple[int, FloatArray] | None:
    """Return the degrees of freedom and the energies of a run's windows, of all innovations or of their slow part."""
    if not run.record.ok[channel].any():
        return None
    sample = float(np.median(run.record.steps))
    block = max(1, round(ENERGY_WINDOW_S / 8 / sample)) if slow else 1
    e = block_means(run.white[channel], block) * np.sqrt(block)
    width = max(4, round(ENERGY_WINDOW_S / sample / block))
    energy = block_means(e**2, width) * width
    return (width, energy) if energy.size else None
