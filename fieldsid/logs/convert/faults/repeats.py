"""Find how a table fills the rows of a slower sensor, by repeats or straight lines; what it fills in is no new measurement.

If the repeats were fitted as measurements, the signal would be late by half a step of the sensor, and the noise of each
measurement would be counted several times. Numbers on a line between two measurements have less noise than the sensor, and the
noise floor, against which a model is judged, would be too low.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from fieldsid.logs.convert.faults.spikes import last_digit
from fieldsid.logs.few_of import FEW, FEWEST, MOSTLY
from fieldsid.logs.run import Note
from fieldsid.numerics.arrays import BoolArray, FloatArray

UNEVEN = 1.5
"""Smallest ratio of the median change to the smallest one at which a sensor that measures anew seldom repeats a number; and
largest ratio of the rows per line, but for FEW lines, to their median."""

STRAIGHT, BENT = 2.5, 10.0
"""Largest bend of a straight line and smallest median bend between two lines, in last digits."""
LEAST_CHANGE = 1e-12
"""Range in SI up to which a signal is constant: a simulation leaves less by rounding in a plane in which nothing moves."""
SIGNIFICANT = 1e-5
"""Largest last digit of a number that is written with six digits, as a share of it."""


def without_repeats(name: str, values: FloatArray) -> tuple[FloatArray, list[Note]]:
    """Return a signal (n,) with the repeats of its slower sensor as NaN, and a note; unchanged where it has none."""
    seen = np.flatnonzero(np.isfinite(values))
    if not seen.size or float(np.ptp(values[seen])) <= LEAST_CHANGE:
        return values, []
    changed = np.flatnonzero(np.diff(values[seen]) != 0.0)
    every = _rows_per_measurement(changed)
    if every == 1:
        own = measured_anew(values)
        return (values, []) if own[seen].all() else (np.where(own, values, np.nan), [note_on_repeats(name, own, values)])
    measured = np.full(values.shape, np.nan)
    fresh = seen[(changed[0] + 1) % every :: every]
    measured[fresh] = values[fresh]
    message = (
        f"{name} changes at every {every}th sample only ({changed.size} times): it was taken at a lower rate, and repeated until "
        "the next; the repeats are missing now"
    )
    return measured, [Note("repeated", message, {"signal": name, "value": every, "count": changed.size})]


def _rows_per_measurement(changed: npt.NDArray[np.intp]) -> int:
    """Return the number of rows per measurement, by the indices (k,) before each change; 1 where it is not constant.

    k changes fall on multiples of m rows by chance with the probability m^(1-k), which is negligible for ten. Two equal
    measurements in succession give an interval of 2 m rows, so that m is the greatest common divisor of the intervals.
    """
    if changed.size < FEWEST:
        return 1
    apart = np.diff(changed)
    every = int(np.gcd.reduce(apart))
    return every if every == int(np.median(apart)) else 1


def rows_of(values: FloatArray) -> BoolArray:
    """Return a mask of the rows (n,) in which a sensor has a number, or several (n, k)."""
    return np.asarray(np.isfinite(values if values.ndim > 1 else values[:, None]).all(axis=1))


def measured_anew(values: FloatArray) -> BoolArray:
    """Return a mask of the rows (n,) in which a sensor has a number, or several (n, k), without those that it repeats by turns.

    A table that is written at each message repeats the other sensors, now once and now several times. Most changes are then more
    than a row apart, though they are larger than the last digit. Of a sensor that stops, with its vehicle or by a fault, most
    changes follow on each other, and of one with few digits most are by the last digit: those keep all rows. So do the bends of a
    line through the numbers, where a table is filled by straight lines.
    """
    columns = values if values.ndim > 1 else values[:, None]
    rows = rows_of(values)
    steps = np.abs(np.diff(columns[rows], axis=0)).max(axis=1, initial=0.0)
    changed = np.flatnonzero(steps)
    if changed.size < FEWEST or steps.max() <= LEAST_CHANGE or _rows_per_measurement(changed) > 1:
        return rows
    if float(np.median(np.diff(changed))) < 2.0:
        rows[rows] = _bends(columns[rows])
    elif float(np.median(steps[changed])) > UNEVEN * float(steps[changed].min()):
        rows[rows] = np.append(True, steps > 0.0)
    return rows


def _bends(columns: FloatArray) -> BoolArray:
    """Return a mask of the rows of numbers (n, k) between straight lines, with both ends; all rows where there are no such lines.

    The lines between the messages of a sensor are about equally long, and unlike those of numbers with few digits they bend by
    many digits. The numbers lie on them: those of a log without noise, whose few digits hide how they curve between two steps of
    the fin, do not.
    """
    digit = np.maximum(last_digit(columns[:, 0]), SIGNIFICANT * np.abs(columns).max(axis=1))[1:-1]
    bend = np.abs(np.diff(columns, 2, axis=0)).max(axis=1) / np.where(digit > 0.0, digit, np.inf)
    at, every = np.flatnonzero(bend > STRAIGHT), np.ones(len(columns), dtype=np.bool_)
    apart = np.diff(at)
    if at.size < FEWEST or float(np.median(apart)) < 2.0 or float(np.median(bend[at])) < BENT:
        return every
    if float(np.quantile(apart, 1.0 - FEW)) > UNEVEN * float(np.median(apart)):
        return every
    between = np.setdiff1d(np.arange(at[0], at[-1]), at)
    lines = np.stack([np.interp(between, at, c[at + 1]) for c in columns.T], axis=1)
    if np.mean(np.abs(columns[between + 1] - lines).max(axis=1) > STRAIGHT * digit[between]) > MOSTLY:
        return every
    every[1:-1] = bend > STRAIGHT
    return every


def note_on_repeats(name: str, own: BoolArray, values: FloatArray) -> Note:
    """Return the note that of the samples of a signal (n,), or of several (n, k), only its `own` (n,) were measured."""
    seen = rows_of(values)
    is_held = bool((np.diff(values[seen], axis=0)[~own[seen][1:]] == 0.0).all())
    how, what = (
        ("repeated until the next, as in a table that is written at each message", "the repeats")
        if is_held
        else ("interpolated between, as in a table that is filled by straight lines", "the samples between")
    )
    message = (
        f"{name} was measured at {100 * own.sum() / seen.sum():.0f} % of its samples only ({own.sum()}), and {how}; {what} are "
        "missing now"
    )
    return Note("repeated", message, {"signal": name, "count": int(own.sum())})
