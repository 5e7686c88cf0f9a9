"""The rows of one log in the table, one for each run: its data, its parameters, and the missing effect.

A log that cannot be used gives a row with the reason, so that it does not stop the others.
"""

from __future__ import annotations

import time as clock
import traceback
import warnings
from datetime import UTC, datetime
from functools import lru_cache
from math import isfinite, nan
from pathlib import Path
from typing import Any

import numpy as np

from fieldsid._version import __version__
from fieldsid.batch.task import Settings, Task
from fieldsid.errors import FieldsidError
from fieldsid.logs.channels import ChannelMap
from fieldsid.logs.importing import Importer
from fieldsid.logs.run import EXPLAINING, Run
from fieldsid.logs.several.run_names import stem_of
from fieldsid.models.axis import NAMES, Axis
from fieldsid.records.keys import body_of
from fieldsid.records.named_inputs import sha256_of
from fieldsid.vehicle import Vehicle, load_vehicle

FIRST = ("log", "run", "status", "start_utc", "time_from", "speed_m_s", "verdict", "effects")
EARLIEST_NS = 300_000_000 * 10**9
"""Times before 1979 are not taken as a date."""
Row = dict[str, Any]


def columns(axis: Axis) -> tuple[str, ...]:
    """Return the columns of the table of an axis, in their order."""
    parameters = [c for n in NAMES[axis].base for c in (n, f"{n}_std_error")]
    return (
        *FIRST, *parameters, "angle_rms_rad", "rate_rms_rad_s", "angle_fit_percent", "rate_fit_percent", "angle_noise_rad",
        "rate_noise_rad_s", "method", "samples", "duration_s", "rate_hz", "findings", "warnings", "probability", "says", "what",
        "found", "hint", "sha256", "seconds", "tool",
    )  # fmt: skip


def rows_of(task: Task) -> list[Row]:
    """Return the rows of one log, at least one; raises only what ends the process."""
    begin = clock.perf_counter()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        rows = _rows_of_readable(task)
    took = clock.perf_counter() - begin
    return [{"seconds": took / len(rows), "tool": f"fieldsid {__version__}", **row} for row in rows]


def failed_row(task: Task, status: str, what: str, found: str = "", hint: str = "") -> Row:
    """Return the row of a log that could not be processed, with the reason."""
    return {
        "log": task.log, "run": stem_of(Path(task.log)), "status": status, "what": what, "found": found, "hint": hint,
        "tool": f"fieldsid {__version__}",
    }  # fmt: skip


def _rows_of_readable(task: Task) -> list[Row]:
    try:
        runs, digest = _read(task)
    except FieldsidError as error:
        return [failed_row(task, "skipped", error.what, error.found, error.hint)]
    except Exception as error:  # noqa: BLE001 - the boundary of a log: a bug of ours in one must not stop the others
        return [_bug_row(task, error)]
    rows = []
    for i, run in enumerate(runs):
        name = run.name if len(runs) == 1 else f"{run.name}_{i + 1}"
        row = {**_run_columns(task, run), "run": name, "sha256": digest}
        try:
            rows.append(row | _with_parameters(run, task.settings))
        except FieldsidError as error:
            rows.append(row | {"status": "skipped", "what": error.what, "found": error.found, "hint": error.hint})
        except Exception as error:  # noqa: BLE001 - the same
            rows.append(row | _bug_row(task, error) | {"run": name})
    return rows


def _bug_row(task: Task, error: Exception) -> Row:
    trace = "".join(traceback.format_exception(error))[-2000:]
    return failed_row(task, "failed", f"a bug of fieldsid: {type(error).__name__}: {error}", trace, "send us the log")


def _read(task: Task) -> tuple[list[Run], str]:
    settings, path = task.settings, Path(task.log)
    vehicle = _vehicle(settings.vehicle)
    limits = {} if vehicle is None else vehicle.signal_limits
    runs = Importer(_mapping(settings.mapping), whole=settings.whole, recognise=True).read(path, limits)
    return runs, sha256_of(path)


@lru_cache(maxsize=4)
def _mapping(path: str | None) -> ChannelMap | None:
    if path is None:
        return None
    from fieldsid.logs.mapping.mapping_file import load_mapping

    return load_mapping(Path(path))


@lru_cache(maxsize=4)
def _vehicle(path: str | None) -> Vehicle | None:
    return None if path is None else load_vehicle(Path(path))


def _run_columns(task: Task, run: Run) -> Row:
    """Return the columns of a run that do not need a fit."""
    start, source = _start(run, Path(task.log))
    return {
        "log": task.log,
        "run": run.name,
        "start_utc": datetime.fromtimestamp(start, UTC).isoformat(timespec="seconds"),
        "time_from": source,
        "samples": len(run),
        "duration_s": float(run.time[-1] - run.time[0]),
        "rate_hz": 1.0 / float(np.median(np.diff(run.time))),
        "findings": ",".join(sorted({n.code for n in run.notes if n.code not in EXPLAINING})),
    }


def _start(run: Run, log: Path) -> tuple[float, str]:
    """Return the start of a run in s since 1970: by the log's clock where it has a date, else by the file's modification time."""
    origins = [int(n.data["origin_ns"]) for n in run.notes if n.code == "time_origin" and "origin_ns" in n.data]
    if origins and origins[0] > EARLIEST_NS:
        return origins[0] / 1e9 + float(run.time[0]), "log"
    return log.stat().st_mtime, "file"


def _with_parameters(run: Run, settings: Settings) -> Row:
    from fieldsid.fitting.checks.warnings import is_warning
    from fieldsid.fitting.identify import identify
    from fieldsid.fitting.predict.goodness_of_fit import goodness_of_fit

    axis = Axis(settings.axis)
    (fit,) = identify([run], axis, method=settings.method, whole=settings.whole, vehicle=_vehicle(settings.vehicle))
    model = fit.model
    known = [name for name in NAMES[axis].base if name in model.values]
    parameters = {
        column: value for n in known for column, value in ((n, model.values[n]), (f"{n}_std_error", model.std_error(n)))
    }
    row: Row = {
        "status": "done",
        "speed_m_s": model.law.reference,
        "method": model.method,
        **parameters,
        **body_of(goodness_of_fit(fit.predictions)),
        "angle_noise_rad": fit.floor.angle,
        "rate_noise_rad_s": fit.floor.rate,
        "warnings": ",".join(sorted({n.code for n in fit.notes if is_warning(n, axis)})),
    }
    return row | (_with_diagnosis(run, axis) if settings.diagnose else {})


def _with_diagnosis(run: Run, axis: Axis) -> Row:
    """Return the verdict on an identified run, or the reason where there is none; the row keeps its parameters."""
    from fieldsid.diagnosis import diagnose

    try:
        found = diagnose([run], axis)
    except FieldsidError as error:
        return {"verdict": "", "what": f"not diagnosed: {error.what}", "found": error.found, "hint": error.hint}
    named = "+".join(found.effects)
    of_it = [c.probability for c in found.candidates if c.effect == named]
    probability = of_it[0] if of_it and isfinite(of_it[0]) else nan
    return {"verdict": str(found.verdict), "effects": named, "probability": probability, "says": found.says}
