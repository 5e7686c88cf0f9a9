"""Words that several headlines share: shortened lists of names, and the command that uses a finished model."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from fieldsid.cli.headlines.typed import pasted
from fieldsid.logs.unknown_file import own_kind
from fieldsid.records.named_inputs import inputs_of
from fieldsid.records.reading import read_yaml

USES = {"yaw": ("turn-radius",), "pitch": ("schedule", "design")}
"""The command that uses a model of each axis once its error is no more than the noise."""
MOST_NAMED = 3


def first_names(names: Sequence[str]) -> str:
    """Return the first few names, and how many more there are."""
    more = len(names) - MOST_NAMED
    return ", ".join(names[:MOST_NAMED]) + (f" and {more} more" if more > 0 else "")


def next_use(axis: str, model: str) -> str:
    """Return the command that uses a model, once its error is no more than the noise: a turning radius in yaw, gains in pitch."""
    return pasted(*USES[axis], model, *(("-o", "gains.yaml") if axis == "pitch" else ()))


def records_in(folders: Iterable[Path], kind: str) -> Iterator[tuple[Path, Mapping[str, Any], set[Path]]]:
    """Yield each record of a kind in some folders: its file, its body, and the files it was made from."""
    for path in (p for folder in dict.fromkeys(folders) for p in sorted(folder.glob("*.yaml"))):
        if own_kind(path) == kind:
            yield path, read_yaml(path), {p.resolve() for p in inputs_of(path)}
