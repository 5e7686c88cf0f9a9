"""Checks of the data of a fit: each note has a code, the measured number, its limit, and what to change."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
import numpy.typing as npt

from fieldsid.fitting.checks.closed_loop import closed_loop_note
from fieldsid.fitting.problem.estimator import Solution
from fieldsid.fitting.problem.problem import Problem
from fieldsid.logs.run import Note
from fieldsid.models.axis import NAMES
from fieldsid.models.record import Record
from fieldsid.numerics.arrays import FloatArray
from fieldsid.numerics.white_noise import white_noise_std

MIN_TIME_CONSTANTS = 5.0
MAX_SPEED_RANGE = 0.10
MAX_GAP_STEPS = 5.0
MIN_CLIPPED_S = 0.2
MAX_CLIPPED_SHARE = 0.005
MAX_FILTERED_NOISE = 1e-4
"""Ratio of noise floor to standard deviation of a signal, below which it was filtered before it was logged."""


def record_checks(problem: Problem, solution: Solution) -> tuple[Note, ...]:
    """Return the notes on the data of a fit, the most serious first in each run."""
    damping = [problem.base_of(solution.x, run).damping for run in range(len(problem.records))]
    known = {e.name for e in problem.layout.effects}
    return tuple(
        note
        for record, a in zip(problem.records, damping, strict=True)
        for note in (*closed_loop_note(record), *_clipped(record), *_gaps(record), *_motion_checks(record, a, known))
    )


def _motion_checks(record: Record, damping: float, effects: set[str]) -> Iterator[Note]:
    yield from _short(record, damping)
    yield from _speed(record, effects)
    yield from _filtered(record)


def _short(record: Record, damping: float) -> Iterator[Note]:
    seconds = float(record.time[-1] - record.time[0])
    needed = MIN_TIME_CONSTANTS / max(damping, 1e-3)
    if damping > 0.0 and seconds < needed:
        name = NAMES[record.axis].damping
        yield Note(
            "short_record",
            f"run {record.name!r} lasts {seconds:.0f} s, less than {MIN_TIME_CONSTANTS:g} time constants of the vehicle "
            f"({needed:.0f} s): {name} is poorly known; fly longer pulses, or widen `--from` and `--to`",
            {"value": seconds, "limit": needed, "run": record.name},
        )


def _speed(record: Record, effects: set[str]) -> Iterator[Note]:
    surge = record.signals.get("surge")
    if surge is None or "speed_varying" in effects:
        return
    low, middle, high = np.percentile(surge, [2.5, 50.0, 97.5]).tolist()
    change = (high - low) / max(abs(middle), 1e-6)
    if change > MAX_SPEED_RANGE:
        yield Note(
            "speed_changing",
            f"run {record.name!r}: the speed changes by {100 * change:.0f} % ({low:.2f} to {high:.2f} m/s, limit "
            f"{100 * MAX_SPEED_RANGE:.0f} %): the parameters are a mean over it; hold the speed, or use `--effects "
            "speed_varying`",
            {"value": change, "limit": MAX_SPEED_RANGE, "run": record.name, "signal": "surge_m_s"},
        )


def _gaps(record: Record) -> Iterator[Note]:
    median = float(np.median(record.steps))
    widest, count = int(np.argmax(record.steps)), int((record.steps > MAX_GAP_STEPS * median).sum())
    if count:
        yield Note(
            "clock_jump",
            f"run {record.name!r}: {record.steps[widest]:.2f} s between two samples at {record.time[widest]:.2f} s, "
            f"{median:.3f} s elsewhere (limit {MAX_GAP_STEPS:g} times): the fin in between is "
            "taken as held; cut there with `--from` and `--to`",
            {"value": float(record.steps[widest]), "limit": MAX_GAP_STEPS * median, "count": count, "run": record.name},
        )


def _clipped(record: Record) -> Iterator[Note]:
    for name, values, ok in _channels(record):
        level, share = clipped_share(values[ok], max(5, round(MIN_CLIPPED_S / float(np.median(record.steps)))))
        if share > MAX_CLIPPED_SHARE:
            yield Note(
                "sensor_clipped",
                f"run {record.name!r}: {name} stays at its extreme {level:.3g} for {100 * share:.1f} % of the run "
                f"(limit {100 * MAX_CLIPPED_SHARE:g} %): the sensor is saturated; use smaller pulses, or a sensor of larger "
                "range",
                {"value": share, "limit": MAX_CLIPPED_SHARE, "level": level, "signal": name, "run": record.name},
            )


def _channels(record: Record) -> Sequence[tuple[str, FloatArray, npt.NDArray[np.bool_]]]:
    names = NAMES[record.axis]
    return [(names.rate, record.rate, record.rate_ok), (names.angle, record.angle, record.angle_ok)]


def clipped_share(values: FloatArray, shortest: int) -> tuple[float, float]:
    """Return the level of the worse extreme, and the share of samples (n,) in stretches of at least `shortest` at that level.

    A stretch counts only where the signal enters it by at least three times its smallest change among values of similar size. A
    smaller change is a peak of a signal that was rounded, for example to three digits, and no saturation.
    """
    worst = (0.0, 0.0)
    moves = np.abs(np.diff(values))
    if values.size < 2 * shortest or not moves.any():
        return worst
    for level in (float(values.max()), float(values.min())):
        edges = np.flatnonzero(np.diff(np.concatenate([[False], values == level, [False]]).astype(int)))
        starts, ends = edges[::2], edges[1::2]
        similar = moves[(moves > 0) & (np.abs(values[1:]) >= 0.5 * abs(level))]
        smallest = float(similar.min() if similar.size else moves[moves > 0].min())
        is_long = (ends - starts >= shortest) & (starts > 0)
        entered = np.array([abs(values[s] - values[s - 1]) >= 3.0 * smallest for s in starts[is_long]], dtype=bool)
        share = float((ends - starts)[is_long][entered].sum()) / values.size
        worst = max(worst, (level, share), key=lambda item: item[1])
    return worst


def _filtered(record: Record) -> Iterator[Note]:
    for name, values, ok in _channels(record):
        if not ok.any():
            continue
        floor, size = white_noise_std(values, ok), float(np.std(values[ok]))
        if floor < MAX_FILTERED_NOISE * size:
            yield Note(
                "filtered_sensor",
                f"{name} of run {record.name!r} shows no white noise ({floor:.1e}, limit {MAX_FILTERED_NOISE:g} of its own size "
                f"{size:.2g}): it was filtered before it was logged, or simulated: its noise floor is not known; "
                "log it unfiltered",
                {"value": floor, "limit": MAX_FILTERED_NOISE * size, "signal": name, "run": record.name},
            )
