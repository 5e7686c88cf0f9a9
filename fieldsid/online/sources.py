"""Sources of live samples: a log that is replayed, a log that grows, lines of a stream, datagrams on this machine.

Each is an iterator of samples; it yields None where no sample has come for a moment, so that the caller can update its display.
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
from fieldsid.records.named_inputs import size_and_time

TICK_S = 0.2
"""Longest wait before the caller can update its display."""
READING_SHARE = 0.25
"""Share of the time spent on reading a log that grows: it is read in full each time, less often the longer that takes."""
LOCALHOST = "127.0.0.1"
WAITING_LINES = 10_000
PIECE_BYTES = 1 << 18


def replayed(run: Run, axis: Axis, factor: float, after: float = -inf) -> Iterator[Sample | None]:
    """Yield the samples of a run after a time in s, `factor` times as fast as they were logged; with inf without waiting."""
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

    The newest row is used only once another follows it, as it may be half written. A log without samples is waited for. Raises
    MappingError and LogError as reading does.
    """
    seen, grown, pause = (-1, -1), clock.monotonic(), TICK_S
    while clock.monotonic() - grown < idle_s:
        size = size_and_time(path)
        if size != seen:
            begin = clock.monotonic()
            run = _present_run(path, mapping)
            pause = max(TICK_S, (clock.monotonic() - begin) / READING_SHARE)
            seen = size
            if run is not None:
                for sample in samples_of(run.between(-inf, _complete_until(run, axis)), axis, after):
                    after, grown = sample.time, clock.monotonic()
                    yield sample
        yield None
        clock.sleep(min(pause, max(idle_s - (clock.monotonic() - grown), 0.01)))
    run = _present_run(path, mapping)
    if run is not None:
        yield from samples_of(run, axis, after)


def lines_of(stream: BufferedIOBase, reader: MessageReader) -> Iterator[Sample | None]:
    """Yield the samples of a stream of JSON lines until it ends or reading it fails."""
    waiting: queue.Queue[bytes | None] = queue.Queue(WAITING_LINES)

    def listen() -> None:
        try:
            for line in _lines(stream):
                waiting.put(line)
        except OSError:  # the process at the other end has ended
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
    """Yield each line when it is complete, a line that is too long cut to LONGEST_LINE + 1 bytes."""
    partial, piece = b"", bytearray(PIECE_BYTES)
    while size := stream.readinto1(piece):
        if len(partial) > LONGEST_LINE and piece.find(b"\n", 0, size) < 0:
            continue
        first, *others = bytes(memoryview(piece)[:size]).split(b"\n")
        partial = (partial + first)[: LONGEST_LINE + 1]
        for line in others:
            yield partial
            partial = line[: LONGEST_LINE + 1]
    yield partial


def datagrams(port: int, reader: MessageReader, *, idle_s: float = inf) -> Iterator[Sample | None]:
    """Yield the samples of JSON lines that come as UDP datagrams on this machine, until nothing has come for idle_s.

    Raises UsageError where the port cannot be opened.
    """
    with closing(socket.socket(socket.AF_INET, socket.SOCK_DGRAM)) as receiver:
        try:
            receiver.bind((LOCALHOST, port))
        except (OSError, OverflowError) as error:
            hint = "end what uses it, or name another port"
            raise UsageError(f"UDP port {port} cannot be had", found=str(error), hint=hint) from error
        receiver.settimeout(TICK_S)
        last_received = clock.monotonic()
        while clock.monotonic() - last_received < idle_s:
            try:
                data = receiver.recv(PIECE_BYTES)
            except TimeoutError:
                yield None
                continue
            last_received = clock.monotonic()
            yield from (sample for line in data.splitlines() if (sample := reader.read(line)) is not None)


def _present_run(path: Path, mapping: ChannelMap | Path | None) -> Run | None:
    """Return the run that a log contains at present, None where it has no samples yet."""
    options = ReadOptions(salvage=True)
    try:
        reader = reader_of(path)
        chosen, _ = map_for(path, reader, options, mapping, {})
        return assemble(reader.read(path, chosen, options), chosen, path, options, max_gap_s=inf)
    except LogError:
        if not path.exists():
            raise
        return None


def _complete_until(run: Run, axis: Axis) -> float:
    """Return the time up to which all signals of the axis are present, without the last row."""
    names = NAMES[axis]
    used = [s for s in (names.fin, names.fin_measured, names.angle, names.rate) if run.has(s)]
    last = [float(run.time[np.flatnonzero(np.isfinite(run[s]))[-1]]) for s in used]
    return min([float(run.time[-2]), *last])
