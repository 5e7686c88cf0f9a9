"""Logs that a command could not use: each is named on stderr and listed in the JSON, and the exit code is 1."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from fieldsid.cli.console import Body, complain, gated
from fieldsid.errors import FieldsidError
from fieldsid.results.result import Skipped
from fieldsid.text.one_line import one_line

if TYPE_CHECKING:
    from fieldsid.logs.run import Run


class Skips:
    """The logs that a command skips: each step calls `skip` for a log that it cannot use."""

    def __init__(self) -> None:
        self.records: list[Skipped] = []
        self._runs: set[str] = set()

    def skip(self, log: Path | Run, error: FieldsidError) -> None:
        """Record that a log cannot be used, and print the reason on stderr."""
        from fieldsid.logs.several.run_names import stem_of

        file = log if isinstance(log, Path) else log.source
        name = stem_of(log) if isinstance(log, Path) else log.name
        if not isinstance(log, Path):
            self._runs.add(name)
        shown = str(file or "-")
        self.records.append(Skipped(name, shown, error.what, error.found, error.hint))
        complain(*f"skipped `{one_line(shown)}`: {error}\n".split("\n"))

    def without_skipped(self, runs: Sequence[Run]) -> list[Run]:
        """Return the runs without those that were skipped after they had been read."""
        return [run for run in runs if run.name not in self._runs]

    def end(self, body: Body, used: int) -> Body:
        """Return the JSON body of a command; where logs were skipped, say how many and end the command with exit code 1.

        used: the number of logs that were used.
        """
        count = len(self.records)
        why = f"{count} of {count + used} logs skipped, for the reasons above"
        return gated(body, [why], failed=count > 0)
