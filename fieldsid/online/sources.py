"""Where live samples come from: a log replayed, a log that grows, lines on a stream, datagrams on this machine.

Each is an iterator of samples; None says that nothing has come for a moment, so that a view can go on.
"""

from __future__ import annotations

import queue
import socket
import threading
import time as clock
from collections.abc import Iterator
from contextlib import closing
from io import BufferedIOBase
from math import inf, isfinite
from pathlib import Path

import numpy as np

from fieldsid.errors import LogError, UsageError
from fieldsid.logs.channels import ChannelMap
from fieldsid.logs.convert.assemble import assemble
from fieldsid.logs.load import map_for
from fieldsid.logs.reader import ReadOptions, reader_of
from fieldsid.logs.run import Run
from fieldsid.models.axis import NAMES, Axis
from fieldsid.online.samples import LONGEST_LINE, MessageReader, Sample, samples_of

TICK_S = 0.2
POLL_S = 0.5
READING_SHARE = 0.25
"""Share of the time that reading a log that grows may take: it is read again as a whole, less often the longer that takes."""
LOCALHOST = "127.0.0.1"
WAITING_LINES = 10_000
PIECE_BYTES = 1 << 18


def replayed(run: Run, axis: Axis, factor: float, after: float = -inf) -> Iterator[Sample | None]:
    """Yield the samples of a run after a time in s, `factor` times as fast as they were logged; inf does not wait."""
    begin: float | None = None
    started = clock.monotonic()
    for sample in samples_of(run, axis, after):
        begin = sample.time if begin is None else begin
        while isfinite(factor) and (wait := (sample.time - begin) / factor - (clock.monotonic() - started)) > 0.0:
            clock.sleep(min(wait, TICK_S))
            if wait > TICK_S:
                yield None
        yield sample


def followed(
    path: Path, mapping: ChannelMap | Path | None, axis: Axis, *, idle_s: float, after: float = -inf
) -> Iterator[Sample | None]:
    """Yield the samples of a log or bag folder as it grows, until nothing has come for idle_s.

    The newest row waits for the one behind it, for it may be half written. Raises MappingError and LogError as reading does;
    a log that holds nothing yet is waited for.
    """
    seen, grown, pause = (-1, -1), clock.monotonic(), POLL_S
    while clock.monotonic() - grown < idle_s:
        size = _size(path)
        if size != seen:
            begin = clock.monotonic()
            run = _so_far(path, mapping)
            pause = max(POLL_S, (clock.monotonic() - begin) / READING_SHARE)
            seen = size
            if run is not None:
                for sample in samples_of(run.between(-inf, _complete(run, axis)), axis, after):
                    after, grown = sample.time, clock.monotonic()
                    yield sample
        yield None
        clock.sleep(min(pause, max(idle_s - (clock.monotonic() - grown), 0.01)))
    run = _so_far(path, mapping)
    if run is not None:
        yield from samples_of(run, axis, after)


def lines_of(stream: BufferedIOBase, reader: MessageReader) -> Iterator[Sample | None]:
    """Yield the samples of a stream of JSON lines until it ends, or cannot be read any more."""
    waiting: queue.Queue[bytes | None] = queue.Queue(WAITING_LINES)

    def listen() -> None:
        try:
            for line in _lines(stream):
                waiting.put(line)
        except OSError:  # what was at the other end is gone
            return
        finally:
            waiting.put(None)

    threading.Thread(target=listen, daemon=True).start()
    while True:
        try:
            line = waiting.get(timeout=TICK_S)
        except queue.Empty:
            yield None
            continue
        if line is None:
            return
        if (sample := reader.read(line)) is not None:
            yield sample


def _lines(stream: BufferedIOBase) -> Iterator[bytes]:
    """Yield lines as their ends come; of one that is too long no more is kept than shows that."""
    kept, piece = b"", bytearray(PIECE_BYTES)
    while size := stream.readinto1(piece):
        if len(kept) > LONGEST_LINE and piece.find(b"\n", 0, size) < 0:
            continue
        first, *others = bytes(memoryview(piece)[:size]).split(b"\n")
        kept = (kept + first)[: LONGEST_LINE + 1]
        for line in others:
            yield kept
            kept = line[: LONGEST_LINE + 1]
    yield kept


def datagrams(port: int, reader: MessageReader, *, idle_s: float = inf) -> Iterator[Sample | None]:
    """Yield the samples of JSON lines that come as UDP datagrams on this machine, until nothing has come for idle_s.

    Raises UsageError where the port cannot be had.
    """
    with closing(socket.socket(socket.AF_INET, socket.SOCK_DGRAM)) as door:
        try:
            door.bind((LOCALHOST, port))
        except (OSError, OverflowError) as error:
            hint = "end what uses it, or name another port"
            raise UsageError(f"UDP port {port} cannot be had", found=str(error), hint=hint) from error
        door.settimeout(TICK_S)
        heard = clock.monotonic()
        while clock.monotonic() - heard < idle_s:
            try:
                data = door.recv(PIECE_BYTES)
            except TimeoutError:
                yield None
                continue
            heard = clock.monotonic()
            yield from (sample for line in data.splitlines() if (sample := reader.read(line)) is not None)


def _size(path: Path) -> tuple[int, int]:
    """Return bytes and newest change of a file, or of all in a folder."""
    files = [p for p in path.rglob("*") if p.is_file()] if path.is_dir() else [path]
    found = [p.stat() for p in files if p.exists()]
    return sum(s.st_size for s in found), max((s.st_mtime_ns for s in found), default=0)


def _so_far(path: Path, mapping: ChannelMap | Path | None) -> Run | None:
    """Return what a log holds now, None where that is nothing yet."""
    options = ReadOptions(salvage=True)
    try:
        reader = reader_of(path)
        chosen, _ = map_for(path, reader, options, mapping, {})
        return assemble(reader.read(path, chosen, options), chosen, path, options, max_gap_s=inf)
    except LogError:
        if not path.exists():
            raise
        return None


def _complete(run: Run, axis: Axis) -> float:
    """Return the time up to which every signal of the axis has come, before the last row."""
    names = NAMES[axis]
    used = [s for s in (names.fin, names.fin_measured, names.angle, names.rate) if run.has(s)]
    last = [float(run.time[np.flatnonzero(np.isfinite(run[s]))[-1]]) for s in used]
    return min([float(run.time[-2]), *last])
