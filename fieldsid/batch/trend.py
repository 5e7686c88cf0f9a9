"""Parameters over months, scaled to one speed, and the changes beyond their errors and the scatter from run to run.

Runs at other speeds are scaled to the median one, as damping is proportional to u and authority to u^2. Changes are found by
optimal partitioning: the series is divided into stretches of constant value so that
    sum (x - mean)^2 / (se^2 + tau^2) + 3 log(n) per change
is least, or a straight line over time takes their place where its own sum, at the price of one change, is less: a weight that is
moved at every dive is no event of one day. tau is the scatter from run to run beyond the stated errors, estimated from
differences of neighbours, on which a change has little influence. Source: Jackson et al. 2005, IEEE Signal Processing Letters
12(2); Killick, Fearnhead and Eckley 2012, JASA 107.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from itertools import pairwise
from math import isfinite, sqrt
from typing import Annotated

import numpy as np

from fieldsid.batch.rows import Row
from fieldsid.models.axis import NAMES, Axis
from fieldsid.numerics.arrays import BoolArray, FloatArray, IntArray
from fieldsid.records.keys import Key, Number

FEWEST_RUNS = 6
SHORTEST_STRETCH = 4
"""Least number of runs on either side of a change; fewer are outliers."""
ODD_WINDOW, ODD = 7, 5.0
"""Window of the running median, and standard deviations from it beyond which a run is an outlier (Hampel's rule)."""
PRICE = 3.0
"""Penalty of a change in units of log(n): Schwarz's for its mean and its place, and one more for the search over places."""
OF_MEDIAN = 2.198
"""Ratio of the variance of a normal variable to the median of its squared deviations."""
LARGEST_RELATIVE_ERROR = 0.5
"""Standard error, relative to the usual size of the parameter, above which a run is left out of its trend."""


@dataclass(frozen=True, slots=True)
class Drift:
    """A steady change of a parameter, by a line over the runs, with the standard error of the difference."""

    before: Annotated[float, Key("Value before, of a steady change at the first run, at the trend's speed.")]
    after: Annotated[float, Key("Value after, of a steady change at the last run.")]
    std_error: Annotated[float, Key("Standard error of the difference.")]

    @property
    def share(self) -> Annotated[Number, Key()]:
        """The change as a share of the value before: -0.18 is 18 % less of it, of either sign; NaN where it was zero."""
        return (self.after - self.before) / self.before if self.before else float("nan")


@dataclass(frozen=True, slots=True)
class Change(Drift):
    """A change of a parameter at a date, between the means before and after: the first run after it and its start."""

    run: Annotated[str, Key("The first run after it.")]
    start_utc: Annotated[str, Key("That run's start.")]


@dataclass(frozen=True, slots=True)
class Trend:
    """One parameter over the runs (n,) in the order of their starts: values and errors at one speed, means, changes or a drift.

    `speed` is that speed in m/s (NaN where unknown), `scatter` is tau.
    """

    name: Annotated[str, Key("Its name.", "parameter")]
    start: FloatArray
    values: FloatArray
    std_errors: FloatArray
    means: FloatArray
    speed: Annotated[
        Number, Key("The speed all runs are carried to; null where the parameter does not go with speed.", "speed_m_s")
    ]
    scatter: Annotated[float, Key("Scatter from run to run beyond the stated errors.")]
    changes: Annotated[tuple[Change, ...], Key("Where it changed.")]
    drift: Annotated[
        Drift | None, Key("Its steady change, where that explains the runs better than changes at a date; else null.")
    ]

    @property
    def runs(self) -> Annotated[int, Key()]:
        """Runs that know it."""
        return self.values.size


def trends_of(rows: Sequence[Row], axis: Axis) -> tuple[Trend, ...]:
    """Return the trend of each base parameter of an axis that enough runs have."""
    names = NAMES[axis]
    done = sorted((r for r in rows if r.get("status") == "done"), key=lambda r: str(r["start_utc"]))
    speeds = np.array([_number(r.get("speed_m_s")) for r in done])
    middle = float(np.nanmedian(speeds)) if np.isfinite(speeds).any() else float("nan")
    powers = {names.damping: 1.0, names.authority: 2.0, names.trim: 2.0}
    # files that were copied together have one date and no order
    if len({r["start_utc"] for r in done}) < FEWEST_RUNS:
        return ()
    found = (_trend(done, n, speeds, middle, powers.get(n, 0.0)) for n in names.base)
    return tuple(t for t in found if t is not None)


def _trend(rows: Sequence[Row], name: str, speeds: FloatArray, middle: float, power: float) -> Trend | None:
    values = np.array([_number(r.get(name)) for r in rows])
    errors = np.array([_number(r.get(f"{name}_std_error")) for r in rows])
    if power and isfinite(middle):
        factor = (middle / speeds) ** power
        values, errors = values * factor, errors * factor
    known = np.isfinite(values) & np.isfinite(errors) & (errors > 0.0)
    if known.sum() < FEWEST_RUNS:
        return None
    size = float(np.median(np.abs(values[known])))
    known &= errors <= max(LARGEST_RELATIVE_ERROR * size, 3.0 * float(np.median(errors[known])))
    if known.sum() < FEWEST_RUNS:
        return None
    tau = scatter_of(values[known], errors[known])
    known[np.flatnonzero(known)[odd_runs(values[known], np.hypot(errors[known], tau))]] = False
    kept = [row for row, ok in zip(rows, known, strict=True) if ok]
    x, se = values[known], errors[known]
    weight = 1.0 / (se**2 + tau**2)
    start = np.array([datetime.fromisoformat(str(r["start_utc"])).timestamp() for r in kept])
    starts = change_points(x, weight, np.diff(start, prepend=-np.inf) > 0.0)
    edges = [0, *starts.tolist(), x.size]
    parts = [slice(a, b) for a, b in pairwise(edges)]
    means = [float(np.average(x[p], weights=weight[p])) for p in parts]
    variances = [1.0 / float(weight[p].sum()) for p in parts]
    changes = tuple(
        Change(means[i], means[i + 1], sqrt(variances[i] + variances[i + 1]), str(kept[at]["run"]), str(kept[at]["start_utc"]))
        for i, at in enumerate(starts.tolist())
    )
    level = np.concatenate([np.full(p.stop - p.start, m) for p, m in zip(parts, means, strict=True)])
    speed, price = middle if power else float("nan"), PRICE * float(np.log(x.size))
    line, drift = line_over_time(start, x, weight)
    if float(weight @ (x - line) ** 2) + price < float(weight @ (x - level) ** 2) + price * len(changes):
        return Trend(name, start, x, se, line, speed, tau, (), drift)
    return Trend(name, start, x, se, level, speed, tau, changes, None)


def line_over_time(start: FloatArray, values: FloatArray, weight: FloatArray) -> tuple[FloatArray, Drift]:
    """Return the straight line (n,) through values (n,) with weights (n,) at the times `start` (n,) in order, and its drift."""
    middle = float(np.average(start, weights=weight))
    about = start - middle
    spread = float(weight @ about**2)
    line = float(np.average(values, weights=weight)) + float(weight @ (about * values)) / spread * about
    return line, Drift(float(line[0]), float(line[-1]), float(about[-1] - about[0]) / sqrt(spread))


def scatter_of(values: FloatArray, std_errors: FloatArray) -> float:
    """Return the scatter from run to run beyond the stated errors, from the median squared difference of neighbours."""
    squares = np.diff(values) ** 2
    stated = std_errors[1:] ** 2 + std_errors[:-1] ** 2
    # tau at which the median of the normalised squares is the expected one, by bisection, as the errors differ between runs
    low, high = 0.0, float(np.sqrt(squares.max(initial=0.0)))
    if OF_MEDIAN * float(np.median(squares / stated)) <= 1.0:
        return 0.0
    for _ in range(60):
        tau = 0.5 * (low + high)
        low, high = (tau, high) if OF_MEDIAN * float(np.median(squares / (stated + 2.0 * tau * tau))) > 1.0 else (low, tau)
    return high


def odd_runs(values: FloatArray, spread: FloatArray) -> IntArray:
    """Return the indices (k,) of values (n,) far from the running median in terms of their standard deviations (n,)."""
    half = ODD_WINDOW // 2
    padded = np.pad(values, half, mode="reflect")
    middle = np.median(np.lib.stride_tricks.sliding_window_view(padded, ODD_WINDOW), axis=1)
    return np.flatnonzero(np.abs(values - middle) > ODD * spread)


def change_points(values: FloatArray, weight: FloatArray, allowed: BoolArray) -> IntArray:
    """Return the indices (k,) at which the mean of a series (n,) with weights (n,) changes, by optimal partitioning.

    allowed (n,): where a stretch may begin; runs of one date have no order.
    """
    n, allowed = values.size, np.append(allowed, True)
    w, wx, wxx = (np.concatenate([[0.0], np.cumsum(v)]) for v in (weight, weight * values, weight * values**2))
    price = PRICE * float(np.log(n))
    best, last = np.full(n + 1, np.inf), np.zeros(n + 1, dtype=np.intp)
    best[0] = -price
    for end in range(SHORTEST_STRETCH, n + 1):
        begin = np.flatnonzero(allowed[: end - SHORTEST_STRETCH + 1])
        cost = wxx[end] - wxx[begin] - (wx[end] - wx[begin]) ** 2 / (w[end] - w[begin])
        total = best[begin] + cost + price
        place = int(np.argmin(total))
        best[end], last[end] = total[place], begin[place]
    places, end = [], n
    while last[end] > 0:
        end = int(last[end])
        places.append(end)
    return np.array(places[::-1], dtype=np.intp)


def _number(value: object) -> float:
    return float(value) if isinstance(value, (int, float)) else float("nan")
