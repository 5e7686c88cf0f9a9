"""One sample of an axis, and what a message of canonical names (`rudder_deg`, `yaw_rate_rad_s`) says in SI."""

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
"""Bytes of a line or datagram that are read: a vehicle's whole state has some hundred numbers."""
LARGEST = 1e18
"""A time in ns since 1970 is as large; of what lies beyond no sum of squares would be a number."""


class Sample(NamedTuple):
    """Time s, fin rad, angle rad, rate rad/s and surge m/s of one axis, NaN where not measured; the fin held or is measured.

    `fin_line` is where the fin's line since the last sample starts and ends, in rad, where the log has the fin between them.
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
    """JSON objects of canonical names, one a line, as samples of one axis; counts those that are none in `unreadable`.

    With `keeps` all they say is kept in `columns`, by canonical name, where their time goes on.
    """

    def __init__(self, axis: Axis, *, keeps: bool = False) -> None:
        self._names, self._keeps = NAMES[axis], keeps
        self.columns: dict[str, array[float]] = {TIME: array("d")}
        self.unreadable = 0
        self.fin_is_measured: bool | None = None

    def read(self, line: bytes) -> Sample | None:
        """Return the sample of a line; None for one that is too long, no JSON object or without a time, and for a blank one."""
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
            self._keep(signals)
        return Sample(signals[TIME], fin, angle, rate, speed, not self.fin_is_measured)

    def _keep(self, signals: Mapping[str, float]) -> None:
        times = self.columns[TIME]
        if len(times) and signals[TIME] <= times[-1]:
            return
        before = len(times)
        for name in signals:
            self.columns.setdefault(name, array("d", [nan] * before))
        for name, column in self.columns.items():
            column.append(signals.get(name, nan))


def _signals(line: bytes) -> dict[str, float] | None:
    """Return what a line says by canonical signal in SI; None where it is no JSON object, or a number is none of a vehicle."""
    try:
        body = read_json(line)
    except ValueError:
        return None
    if not isinstance(body, dict):
        return None
    found: dict[str, float] = {}
    for key, value in body.items():
        said = canonical(key)
        if said is None or value is None:
            continue
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            return None
        factor = UNITS[said.unit].factor if said.signal == TIME else factor_to(said.signal, said.unit)
        if abs(value) > LARGEST:
            return None
        found[said.signal] = float(value) * factor
    return found
