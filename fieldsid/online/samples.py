"""One sample of an axis, and messages with canonical names (`rudder_deg`, `yaw_rate_rad_s`) converted to SI."""

from __future__ import annotations

from array import array
from collections.abc import Iterator, Mapping
from math import isfinite, nan
from typing import NamedTuple

import numpy as np

from fieldsid.errors import DataError
from fieldsid.logs.convert.units import UNITS, factor_to
from fieldsid.logs.doctor.angle_and_rate import refuse_contradiction
from fieldsid.logs.doctor.fin_findings import refuse_no_angle
from fieldsid.logs.mapping.canonical_names import canonical
from fieldsid.logs.mapping.vocabulary import TIME
from fieldsid.logs.run import STEP_LINES, Run
from fieldsid.logs.segments import no_fin
from fieldsid.models.axis import NAMES, Axis
from fieldsid.records.reading import read_json

SURGE = "surge_m_s"
LONGEST_LINE = 1 << 14
"""Most bytes of a line or datagram that is read: the full state of a vehicle has some hundred numbers."""
LARGEST = 1e18
"""Largest number accepted: a time in ns since 1970 is about as large, and sums of squares of larger numbers may overflow."""


class Sample(NamedTuple):
    """Time (s), fin (rad), angle (rad), rate (rad/s) and surge (m/s) of one axis, NaN where not measured.

    `fin_is_held`: whether the fin is a command, constant between samples, and not a measurement. `fin_line` are the start and end
    (rad) of the line of the fin since the last sample, where the log has the fin between samples.
    """

    time: float
    fin: float
    angle: float = nan
    rate: float = nan
    speed: float = nan
    fin_is_held: bool = True
    fin_line: tuple[float, float] | None = None


def samples_of(run: Run, axis: Axis, after: float = -np.inf) -> Iterator[Sample]:
    """Yield the samples of a run after a time in s.

    Raises DataError where the log has no fin, or neither angle nor rate, or both and a finding says that they contradict.
    """
    names = NAMES[axis]
    column = names.fin_measured if run.has(names.fin_measured) else names.fin
    if not run.has(column):
        raise no_fin(run, axis.value, column)
    if not run.has(names.angle) and not run.has(names.rate):
        found = ", ".join(s for s in run.signals if run.has(s))
        raise DataError(f"run {run.name!r} has neither `{names.angle}` nor `{names.rate}`", found=found, hint="map one of them")
    refuse_no_angle(run, column)
    refuse_contradiction(run, names.angle, names.rate)
    nothing = np.full(len(run), nan)
    wanted = (column, names.angle, names.rate, SURGE)
    lines = [np.append(nan, run.signals.get(c, nothing)[:-1]) for c in STEP_LINES[column]]
    arrays = [run.time, *(run.signals.get(c, nothing) for c in wanted), *lines]
    start = int(np.searchsorted(run.time, after, side="right"))
    for *row, begin, end in zip(*(a[start:].tolist() for a in arrays), strict=True):
        line = (begin, end) if isfinite(begin) else None
        yield Sample(*row)._replace(fin_is_held=column == names.fin, fin_line=line)


class MessageReader:
    """Lines of JSON objects with canonical names, read as samples of one axis; `unreadable` counts the lines that are not.

    With `keeps`, the signals of all messages whose time increases are stored in `columns` by canonical name.
    """

    def __init__(self, axis: Axis, *, keeps: bool = False) -> None:
        self._names, self._keeps = NAMES[axis], keeps
        self.columns: dict[str, array[float]] = {TIME: array("d")}
        self.unreadable = 0
        self.fin_is_measured: bool | None = None

    def read(self, line: bytes) -> Sample | None:
        """Return the sample of a line; None for a line that is blank, too long, not a JSON object, or without a time."""
        if not line.strip():
            return None
        signals = _signals(line) if len(line) <= LONGEST_LINE else None
        if signals is None or not isfinite(signals.get(TIME, nan)):
            self.unreadable += 1
            return None
        names = self._names
        if self.fin_is_measured is None and (names.fin in signals or names.fin_measured in signals):
            self.fin_is_measured = names.fin_measured in signals
        fin = signals.get(names.fin_measured if self.fin_is_measured else names.fin, nan)
        angle, rate, speed = (signals.get(name, nan) for name in (names.angle, names.rate, SURGE))
        if self._keeps:
            self._store(signals)
        return Sample(signals[TIME], fin, angle, rate, speed, not self.fin_is_measured)

    def _store(self, signals: Mapping[str, float]) -> None:
        times = self.columns[TIME]
        if len(times) and signals[TIME] <= times[-1]:
            return
        before = len(times)
        for name in signals:
            self.columns.setdefault(name, array("d", [nan] * before))
        for name, column in self.columns.items():
            column.append(signals.get(name, nan))


def _signals(line: bytes) -> dict[str, float] | None:
    """Return the values of a line by canonical signal in SI; None where it is not a JSON object or has an impossible value."""
    try:
        body = read_json(line)
    except ValueError:
        return None
    if not isinstance(body, dict):
        return None
    found: dict[str, float] = {}
    for key, value in body.items():
        column = canonical(key)
        if column is None or value is None:
            continue
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            return None
        factor = UNITS[column.unit].factor if column.signal == TIME else factor_to(column.signal, column.unit)
        if abs(value) > LARGEST:
            return None
        found[column.signal] = float(value) * factor
    return found
