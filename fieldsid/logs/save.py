"""Writing a Run to a file: Parquet keeps all of it, CSV only time and signals."""

from __future__ import annotations

import gzip
import json
from importlib import import_module
from pathlib import Path
from typing import IO

from fieldsid._version import __version__
from fieldsid.artifacts import plain, replacing
from fieldsid.errors import UsageError
from fieldsid.logs.mapping.vocabulary import TIME
from fieldsid.logs.run import READ_WITH, Run
from fieldsid.records.named_inputs import sha256_of

SCHEMA = "fieldsid/run/1"
SUFFIXES = (".parquet", ".csv", ".csv.gz")


def save_run(run: Run, path: Path, *, force: bool = False) -> Path:
    """Write a run to .parquet, .csv or .csv.gz and return the path.

    Numbers are written without loss. Parquet also keeps the notes, the schema, the tool's version and the sha256 of
    the log and of its mapping file. Raises UsageError for another suffix, ArtifactError when the file exists or cannot be
    written.
    """
    if path.name.endswith(".parquet"):
        return _save_parquet(run, path, force=force)
    if path.name.endswith((".csv", ".csv.gz")):
        return _save_csv(run, path, force=force)
    raise UsageError(
        f"a run cannot be written to `{path}`", found=f"suffix {path.suffix!r}", hint=f"name it `{path.stem}.parquet`"
    )


def _save_parquet(run: Run, path: Path, *, force: bool) -> Path:
    pa, pq = import_module("pyarrow"), import_module("pyarrow.parquet")
    table = pa.table({TIME: run.time, **run.signals}).replace_schema_metadata(
        {"fieldsid": json.dumps(_head(run), allow_nan=False)}
    )
    with replacing(path, force=force) as temporary:
        pq.write_table(table, temporary)
    return path


def _head(run: Run) -> dict[str, object]:
    mappings = (Path(n.data["path"]) for n in run.notes if n.code == READ_WITH)
    read = [p for p in (run.source, *mappings) if p is not None and p.exists()]
    inputs = [{"path": str(p), "sha256": sha256_of(p)} for p in read]
    notes = [{"code": n.code, "message": n.message, "data": plain(n.data)} for n in run.notes]
    return {
        "schema": SCHEMA,
        "tool": f"fieldsid {__version__}",
        "name": run.name,
        "inputs": inputs,
        "parent": None,
        "notes": notes,
    }


def _save_csv(run: Run, path: Path, *, force: bool) -> Path:
    with replacing(path, force=force) as temporary, temporary.open("wb") as raw:
        if path.suffix == ".gz":
            # mtime=0 leaves the time of writing out of the header, so that the same run gives the same bytes
            with gzip.GzipFile(filename="", fileobj=raw, mode="wb", mtime=0, compresslevel=6) as packed:
                _write_rows(run, packed)
        else:
            _write_rows(run, raw)
    return path


def _write_rows(run: Run, stream: IO[bytes] | gzip.GzipFile) -> None:
    """Write every number with as many digits as restore it exactly, and an empty cell for NaN."""
    pa, csv = import_module("pyarrow"), import_module("pyarrow.csv")
    columns = {TIME: run.time, **run.signals}
    table = pa.table({name: pa.array(values, from_pandas=True) for name, values in columns.items()})
    stream.write((",".join(columns) + "\n").encode())
    csv.write_csv(table, stream, csv.WriteOptions(include_header=False, quoting_style="none"))
