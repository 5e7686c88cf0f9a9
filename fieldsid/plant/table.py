"""Points from a table of parameters over speed, as the paper prints them."""

from __future__ import annotations

import io
import sys
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np

from fieldsid.errors import DataError, FieldsidError
from fieldsid.logs.mapping.canonical_names import canonical
from fieldsid.logs.mapping.vocabulary import TIME
from fieldsid.logs.wrong_file import if_log
from fieldsid.models.axis import NAMES, Axis
from fieldsid.plant.points import Point

if TYPE_CHECKING:
    import pandas as pd

SPEED = "speed_m_s"


def read_table(path: Path) -> tuple[Axis, tuple[Point, ...]]:
    """Read a table of parameters over speed; `-` reads standard input.

    Columns: speed_m_s and any of the axis' parameters, each with `<name>_std_error` where known; `delta_r0_rad` or
    `delta_s0_rad` replaces a trim column that is absent; other columns are ignored. Raises DataError.
    """
    table = _frame(path)
    if SPEED not in table.columns:
        raise _no_speed(path, table)
    axis = _axis_of(table, path)
    _check_numbers(table, path, axis)
    points = tuple(
        _row_point({str(k): v for k, v in row.items()}, axis, f"row {i + 1}") for i, row in enumerate(table.to_dict("records"))
    )
    return axis, points


def _no_speed(path: Path, table: pd.DataFrame) -> FieldsidError:
    """Return the error for a table without speeds; with a column of time it is the one for a log in place of a table."""
    if any((column := canonical(str(c))) is not None and column.signal == TIME for c in table.columns):
        mistaken = if_log(path, "a table of parameters over speed")
        if mistaken is not None:
            return mistaken
    return DataError(
        f"table `{path}` has no column `{SPEED}`",
        found=", ".join(map(str, table.columns)) or "no columns",
        hint=f"name the columns {SPEED},a22,b2,C0 or {SPEED},c22,c23,d2,Cb",
    )


def _frame(path: Path) -> pd.DataFrame:
    import pandas as pd

    try:
        source = io.StringIO(sys.stdin.read()) if str(path) == "-" else path
        table = pd.read_csv(source, comment="#", skipinitialspace=True)
    except OSError as error:
        raise DataError(
            f"`{path}` cannot be read: {error.strerror or error}", hint="check the path and its permissions"
        ) from error
    except (pd.errors.ParserError, pd.errors.EmptyDataError, UnicodeDecodeError) as error:
        raise DataError(
            f"`{path}` is not a table", found=str(error).strip(), hint=f"give a CSV file with a header line, {SPEED},a22,b2,C0"
        ) from error
    if not isinstance(table.index, pd.RangeIndex):
        raise DataError(
            f"`{path}` has rows with more cells than its header names",
            found=", ".join(map(str, table.columns)),
            hint="give every column a name",
        )
    if table.empty:
        raise DataError(f"`{path}` has no rows", found=", ".join(map(str, table.columns)), hint="add one line per speed")
    return table


def _axis_of(table: pd.DataFrame, path: Path) -> Axis:
    present = {a: [n for n in NAMES[a].base if n in table.columns] for a in Axis}
    best = max(present, key=lambda a: len(present[a]))
    if not present[best] or all(present.values()):
        raise DataError(
            f"table `{path}` must give parameters of one axis",
            found=", ".join(map(str, table.columns)),
            hint=f"yaw: {SPEED},a22,b2,C0   pitch: {SPEED},c22,c23,d2,Cb",
        )
    return best


def _check_numbers(table: pd.DataFrame, path: Path, axis: Axis) -> None:
    import pandas as pd

    names = NAMES[axis]
    for column in (SPEED, *names.base, f"{names.trim_fin}_rad", *(f"{n}_std_error" for n in names.base)):
        if column not in table.columns:
            continue
        numbers = pd.to_numeric(table[column], errors="coerce")
        bad = table.index[numbers.isna() & table[column].notna()]
        if len(bad):
            raise DataError(
                f"`{path}` line {bad[0] + 2}: `{column}` is not a number",
                found=repr(table[column][bad[0]]),
                hint="mend that cell",
            )
        table[column] = numbers.astype(float)
        below = table.index[numbers < 0.0]
        if column.endswith("_std_error") and len(below):
            raise DataError(
                f"`{path}` line {below[0] + 2}: a standard error is not below zero",
                found=f"{column} = {numbers[below[0]]:g}",
                hint="mend that cell, or leave it empty where the error is not known",
            )
    speed = table[SPEED]
    if not bool((speed > 0).all()):
        where = int(np.argmax(~(speed > 0).to_numpy()))
        raise DataError(
            f"`{path}` line {where + 2}: the speed must be above zero", found=f"{speed.iloc[where]}", hint="speeds are in m/s"
        )


def _row_point(row: Mapping[str, float], axis: Axis, name: str) -> Point:
    names = NAMES[axis]
    values = {n: float(row[n]) for n in names.base if n in row and np.isfinite(row[n])}
    offset = row.get(f"{names.trim_fin}_rad")
    if names.trim not in values and names.authority in values and offset is not None and np.isfinite(offset):
        values[names.trim] = values[names.authority] * float(offset)
    errors = {n: float(row[f"{n}_std_error"]) for n in values if f"{n}_std_error" in row and row[f"{n}_std_error"] > 0}
    return Point(name, float(row[SPEED]), MappingProxyType(values), MappingProxyType(errors))
