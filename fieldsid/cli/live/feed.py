"""The source of the samples of `sysid live`: a log that is replayed or followed, standard input, or a UDP port."""

from __future__ import annotations

import shlex
import sys
from bisect import bisect_left
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from fieldsid.logs.mapping.vocabulary import TIME
from fieldsid.models.axis import Axis

if TYPE_CHECKING:
    from io import BufferedIOBase

    from fieldsid.logs.run import Run
    from fieldsid.online.samples import MessageReader, Sample


@dataclass
class Feed:
    """The source of the samples and how it is read; `run` and `reader` are set once it is opened.

    factor: replay speed, as a multiple of real time. idle_s: seconds without a sample after which the source counts as ended.
    keeps: keep the samples of standard input or of the port, for `flown`.
    """

    axis: Axis
    log: Path | None
    factor: float
    follow: bool
    udp: int | None
    idle_s: float
    mapping: Path | None
    reader: MessageReader | None = None
    run: Run | None = None
    keeps: bool = False

    @property
    def name(self) -> str:
        """The name of the source, by which a saved state is recognised as one of it."""
        return f"udp:{self.udp}" if self.log is None else str(self.log)

    @property
    def is_log(self) -> bool:
        """Whether the source is a file: samples that a saved state has used already are passed over."""
        return self.log is not None and str(self.log) != "-"

    @property
    def unreadable(self) -> int:
        """Number of lines that were no JSON objects with a time."""
        return self.reader.unreadable if self.reader else 0

    def next_command(self, *, usable: bool) -> str:
        """Return the command that comes next for a log: `identify`, or `inspect` where it is not usable; none for a stream."""
        if not self.is_log:
            return ""
        words = ["identify", str(self.log), "--axis", self.axis.value, "-o", "models/"] if usable else ["inspect", str(self.log)]
        return shlex.join(["sysid", *words])

    def flown(self, since: float, until: float) -> Run | Mapping[str, Any]:
        """Return the data flown between two times in s: a run, or the columns of the lines received."""
        from fieldsid.cli.inputs import read_run

        if self.reader is not None:
            columns = self.reader.columns
            first = bisect_left(columns[TIME], since)
            return {name: column[first:] for name, column in columns.items()}
        run = self.run or read_run(Path(str(self.log)), mapping=self.mapping)
        return run if since <= float(run.time[0]) and until >= float(run.time[-1]) else run.between(since, until)

    def samples(self, after: float) -> Iterator[Sample | None]:
        """Yield the samples after a time in s."""
        from fieldsid.cli.inputs import mapping_of, read_run
        from fieldsid.online.samples import MessageReader
        from fieldsid.online.sources import datagrams, followed, lines_of, replayed

        if not self.is_log:
            self.reader = MessageReader(self.axis, keeps=self.keeps)
            if self.udp is not None:
                return datagrams(self.udp, self.reader, idle_s=self.idle_s)
            return lines_of(cast("BufferedIOBase", sys.stdin.buffer), self.reader)
        if self.log is None or not self.follow:
            self.run = read_run(Path(str(self.log)), mapping=self.mapping)
            return replayed(self.run, self.axis, self.factor, after)
        return followed(self.log, mapping_of(self.mapping), self.axis, idle_s=self.idle_s, after=after)
