"""Time columns as seconds: numbers in any unit, epoch times, and ISO 8601 text."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from fieldsid.errors import LogError
from fieldsid.logs.cells import as_numbers
from fieldsid.logs.reader import ReadOptions
from fieldsid.logs.run import FloatArray, Note
from fieldsid.logs.strangers import COPY_AGAIN
from fieldsid.logs.units import UNITS, pick_unit

EPOCH_FROM_S = 1e8
"""A time that starts later than this many seconds (three years) counts from an epoch, not from the start of the run."""


def seconds_of(
    cells: npt.NDArray[Any], unit: str | None, options: ReadOptions | None = None, *, name: str
) -> tuple[FloatArray, list[Note]]:
    """Return a time column (n,) in s, and notes.

    Numbers are in `unit` (seconds when None); text is ISO 8601, taken as UTC. A time that counts from an epoch
    starts at zero, and the note `time_origin` keeps its start. Cells that are no times become NaN when salvaging.
    Raises LogError for a cell that is no time, and MappingError for a unit that is not one of time.
    """
    options = options or ReadOptions()
    if cells.size == 0:
        raise LogError("the table has no rows", found=f"only the header, with column `{name}`", hint=COPY_AGAIN)
    if cells.dtype.kind == "M":
        return _of_integers(cells.astype("datetime64[ns]").astype(np.int64), 1e-9)
    if cells.dtype.kind in "iu":
        return _of_integers(cells.astype(np.int64), _factor(unit))
    if cells.dtype.kind == "f":
        return _of_floats(cells.astype(np.float64), _factor(unit), name, options)
    return _of_text(cells, unit, name, options)


def likely_time_unit(cells: npt.NDArray[Any]) -> str | None:
    """Return the unit of numbers of time by their size, as an epoch has them; None where the cells are no numbers."""
    if cells.dtype.kind not in "iuf" or not cells.size or not np.isfinite(cells[0]):
        return None
    size = float(cells[0])
    return "ns" if size > 1e17 else "us" if size > 1e14 else "ms" if size > 1e11 else "s"


def _factor(unit: str | None) -> float:
    if unit is None:
        return 1.0
    picked = pick_unit(unit)
    if picked.dimension != "time":
        fitting = ", ".join(u.name for u in UNITS.values() if u.dimension == "time")
        raise LogError(f"time cannot be in {picked.name!r}", found=f"a unit of {picked.dimension}", hint=f"use one of: {fitting}")
    return picked.factor


def _of_integers(values: npt.NDArray[np.int64], factor: float) -> tuple[FloatArray, list[Note]]:
    """Subtract the start before scaling, so that nanoseconds of an epoch keep every digit."""
    start = int(values[0])
    if start * factor <= EPOCH_FROM_S:
        return _scaled(values.astype(np.float64), factor), []
    return _scaled((values - start).astype(np.float64), factor), [_origin(start * factor)]


def _of_floats(values: FloatArray, factor: float, name: str, options: ReadOptions) -> tuple[FloatArray, list[Note]]:
    notes: list[Note] = []
    missing = np.flatnonzero(~np.isfinite(values))
    if missing.size:
        notes.append(_no_times(missing, values, name, options))
    seen = values[np.isfinite(values)]
    start = float(seen[0]) if seen.size else 0.0
    if start * factor <= EPOCH_FROM_S:
        return _scaled(values, factor), notes
    return _scaled(values - start, factor), [*notes, _origin(start * factor)]


def _scaled(values: FloatArray, factor: float) -> FloatArray:
    """Divide by a whole number where there is one: 50 ms is then 0.05 s to the last bit."""
    if factor == 1.0:
        return values
    return values / round(1.0 / factor) if factor < 1.0 else values * factor


def _of_text(cells: npt.NDArray[Any], unit: str | None, name: str, options: ReadOptions) -> tuple[FloatArray, list[Note]]:
    values, wrong = as_numbers(cells)
    if wrong.size < cells.size // 2:
        if wrong.size and not options.salvage:
            raise _refused(f"column `{name}` holds cells that are no times", wrong, cells, options)
        return _of_floats(values, _factor(unit), name, options)
    stamps = _iso(cells)
    missing = np.flatnonzero(np.isnat(stamps))
    notes = [_no_times(missing, cells, name, options)] if missing.size else []
    nanoseconds = stamps.astype(np.int64)
    start = int(nanoseconds[~np.isnat(stamps)][0]) if missing.size < cells.size else 0
    seconds = np.where(np.isnat(stamps), np.nan, (nanoseconds - start) / 1e9)
    return seconds, [*notes, _origin(start / 1e9)]


def _iso(cells: npt.NDArray[Any]) -> npt.NDArray[np.datetime64]:
    import pandas as pd

    parsed = pd.to_datetime(pd.Series(cells).astype("string").str.strip(), format="ISO8601", utc=True, errors="coerce")
    return np.asarray(parsed.dt.tz_localize(None).to_numpy(dtype="datetime64[ns]"))


def _no_times(missing: npt.NDArray[np.intp], cells: npt.NDArray[Any], name: str, options: ReadOptions) -> Note:
    if not options.salvage:
        raise _refused(f"column `{name}` has rows without a time", missing, cells, options)
    return Note("no_time", f"rows left out because they have no time: {missing.size}", {"count": int(missing.size)})


def _refused(what: str, places: npt.NDArray[np.intp], cells: npt.NDArray[Any], options: ReadOptions) -> LogError:
    found = f"{places.size} of {cells.size}, the first in row {int(places[0]) + 1}: {str(cells[places[0]])[:40]!r}"
    hint = options.salvaging("mend the column, or leave such rows out", 1.0 - places.size / cells.size)
    return LogError(what, found=found, hint=hint or "check which column is the time")


def _origin(start_s: float) -> Note:
    return Note("time_origin", f"time 0 is {start_s:.6f} s of the log's clock", {"origin_ns": round(start_s * 1e9)})
