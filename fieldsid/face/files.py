"""Writing records to files and reading them back, in the formats of the commands."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

from fieldsid.errors import UsageError
from fieldsid.face.arguments import File
from fieldsid.logs import Run, save_run
from fieldsid.models import model as models
from fieldsid.models.model import Model

if TYPE_CHECKING:
    from fieldsid.diagnosis import Diagnosis
    from fieldsid.extension.extend import Extension
    from fieldsid.fitting.fit import Fit
    from fieldsid.plant.laws.axis_laws import Laws
    from fieldsid.schedule.record import Schedule

Kept: TypeAlias = "Run | Model | Fit | Diagnosis | Extension | Laws | Schedule"


def load_model(path: File) -> Model:
    """Return the model of a file; raises ArtifactError naming the key that is missing or wrong."""
    return models.load_model(Path(path))


def save(record: Kept, path: File, *, inputs: Sequence[File] = (), mapping: File | None = None, force: bool = False) -> Path:
    """Write a record for the commands, and return the path: a run as Parquet or CSV, a model, laws or a schedule as YAML.

    Of a fit, a diagnosis and an extension the model is written. inputs: the files it was made from, whose hashes are kept.
    mapping: the file that a model's logs were read with, for what reads them again. force: replace an existing file. Raises
    ArtifactError where the file exists or cannot be written, UsageError for another record.
    """
    from fieldsid.plant.laws.axis_laws import Laws, save_laws
    from fieldsid.schedule.record import Schedule, save_schedule

    place, sources = Path(path), [Path(p) for p in inputs]
    if isinstance(record, Run):
        return save_run(record, place, force=force)
    if isinstance(record, Laws):
        return save_laws(record, place, inputs=sources, force=force)
    if isinstance(record, Schedule):
        return save_schedule(record, place, inputs=sources, force=force)
    known = record if isinstance(record, Model) else getattr(record, "model", None)
    if isinstance(known, Model):
        return models.save_model(known, place, inputs=sources, mapping=None if mapping is None else Path(mapping), force=force)
    raise UsageError(
        f"a {type(record).__name__} has no file of its own", found=repr(record), hint="keep its table: `to_frame().to_csv(path)`"
    )
