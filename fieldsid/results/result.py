"""What several commands come to: the logs that could not be used."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from fieldsid.records.keys import Key, Result


@dataclass(frozen=True, slots=True)
class Skipped:
    """A log that a command could not use."""

    run: Annotated[str, Key("Its name.")]
    file: Annotated[str, Key("The file.")]
    what: Annotated[str, Key("What is wrong with it.")]
    found: Annotated[str, Key("What was found.")]
    hint: Annotated[str, Key("What to do.")]


@dataclass(frozen=True, slots=True, kw_only=True)
class OfLogs(Result):
    """What a command that reads several logs came to."""

    skipped_runs: Annotated[
        tuple[Skipped, ...], Key("Logs that could not be used, and why; where there are any, the exit code is 1.")
    ]
