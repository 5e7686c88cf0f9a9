"""Runs that share their name with one a model was fitted to, and are others: those of the day before a swap and after it."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from fieldsid.logs.run import Run
    from fieldsid.models.model import Model


def fitted_to(path: Path, model: Model, runs: Iterable[Run]) -> frozenset[str]:
    """Return the names of the runs that the model of a file was fitted to, without those whose log is only called the same.

    By their hashes. Where the model's own log is gone, or of another format, its name is all there is to go by.
    """
    from fieldsid.logs.several.run_names import stem_of
    from fieldsid.records.named_inputs import inputs_of, sha256_of, sha256_of_named

    own = {(stem_of(p), p.suffix): p for p in inputs_of(path)}
    pairs = [(r.name, r.source, own.get((stem_of(r.source), r.source.suffix))) for r in runs if r.source is not None]
    return frozenset(model.runs) - frozenset(
        name
        for name, here, there in pairs
        if there is not None and here.is_file() and there.is_file() and sha256_of(here) != sha256_of_named(there)
    )
