"""Reading a pandas table as a Run, with the same names, units and findings as a file with these columns."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fieldsid.errors import LogError, MappingError
from fieldsid.logs.channels import ChannelMap, Source
from fieldsid.logs.convert.assemble import WHOLE, assemble
from fieldsid.logs.convert.conditioning import MAX_GAP_S
from fieldsid.logs.load import chosen_map, judged
from fieldsid.logs.mapping.vocabulary import TIME
from fieldsid.logs.reader import ReadOptions
from fieldsid.logs.readers._columns import Columns, own_map_of, series_of
from fieldsid.logs.run import Run

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt
    from pandas import DataFrame, Series

NAME = "table"
_HINT = (
    'name the columns `time_s`, `yaw_rad`, `rudder_rad` and so on, or map them: `channel=["yaw_rad=heading:deg"]`; '
    "`salvage=True` leaves damaged cells and rows out"
)


def run_of_frame(
    frame: DataFrame,
    name: str = "",
    mapping: ChannelMap | Path | None = None,
    *,
    channels: Mapping[str, Source] | None = None,
    salvage: bool = False,
    max_gap_s: float = MAX_GAP_S,
    part: tuple[float, float] = WHOLE,
    fin_max_rad: Mapping[str, float] | None = None,
) -> Run:
    """Return the Run of a table with one row per sample; arguments as those of `load_run`.

    The time is a column or the index: numbers, date and time, or a time difference. name: the name of the run; without it the
    name that `Run.to_frame` stored, else "table". Raises MappingError and LogError.
    """
    run_name = name or str(frame.attrs.get("name", "")) or NAME
    table, place = _with_time_column(frame), Path(run_name)
    names = tuple(map(str, table.columns))
    try:
        chosen = _chosen_map(run_name, names, mapping, channels or {})
        columns = Columns(place, names, len(names), lambda i: _cells(table.iloc[:, i]))
        options = ReadOptions(None, salvage)
        raw = series_of(place, columns, chosen, (), options)
        run = assemble(raw, chosen, place, options, part=part, max_gap_s=max_gap_s)
    except (LogError, MappingError) as error:  # the readers' own hints name commands that take files
        raise type(error)(error.what, found=error.found, hint=_HINT) from error
    return judged(replace(run, name=run_name, source=None), raw, chosen, fin_max_rad)


def _chosen_map(
    run_name: str, names: tuple[str, ...], mapping: ChannelMap | Path | None, channels: Mapping[str, Source]
) -> ChannelMap:
    chosen = chosen_map(mapping, own_map_of(names), channels)
    if chosen is None:
        what = f"`{run_name}` has no time and signal that are known by their names"
        raise MappingError(what, found=", ".join(names) or "no columns")
    return chosen


def _with_time_column(frame: DataFrame) -> DataFrame:
    """Return the table with its index as a column, where the index has a name or holds times."""
    if frame.index.name is None and frame.index.dtype.kind not in "Mm":
        return frame
    name = TIME if frame.index.name is None else str(frame.index.name)
    return frame.rename_axis(name).reset_index() if name not in frame.columns else frame


def _cells(column: Series[Any]) -> npt.NDArray[Any]:
    """Return the cells (n,) of a column as a file reader would: numbers, stamps in UTC, or text."""
    if column.dtype.kind == "m":
        seconds: npt.NDArray[np.float64] = column.dt.total_seconds().to_numpy()
        return seconds
    if column.dtype.kind == "M":
        stamps = column if column.dt.tz is None else column.dt.tz_convert(None)
        return stamps.to_numpy()
    if column.dtype.kind in "iufb" and column.hasnans:
        return column.to_numpy(dtype="float64", na_value=float("nan"))
    return column.to_numpy()
