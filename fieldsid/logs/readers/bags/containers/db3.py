"""Read ROS 2 SQLite files (.db3), with their rows in the order in which they were written.

Over rosbags: packets read 2 to 3 times as fast (tests/benchmarks/bag_reading.py; SQLite reads the bytes in both,
but rosbags also counts and sorts the rows), and the readable rows are returned of a file that is cut off, has damaged pages, or
has a write-ahead log left by a crash.
"""

from __future__ import annotations

import shutil
import sqlite3
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, closing, contextmanager
from pathlib import Path
from typing import Any
from urllib.parse import quote

from fieldsid.errors import LogError
from fieldsid.logs.readers.bags.packets import LAST_NS, SETTLE_BYTES, Collector, Connection, TopicPackets
from fieldsid.logs.unknown_file import COPY_AGAIN

MAGIC = b"SQLite format 3\x00"
DAMAGE = (sqlite3.DatabaseError, MemoryError, UnicodeDecodeError)
"""Errors that SQLite raises on a damaged file; MemoryError for a damaged length, UnicodeDecodeError for damaged text."""
NO_MESSAGE = (KeyError, TypeError, OverflowError)
"""Errors for a row whose topic is unknown, whose stamp is no integer of 64 bits, or that has no data."""
MAPPED_BYTES = 1 << 24
"""Number of bytes of a file that SQLite maps to memory, which is a tenth faster than reading by calls."""
_LANGUAGES = {"ros2msg": "msg", "ros2idl": "idl"}


def scan(path: Path, collector: Collector) -> None:
    """Read every message of a file into `collector`; raises LogError when not even the list of topics can be read."""
    with _opened(path) as base:
        if _pages_left(path) is not None:
            collector.truncated("pages are missing", path.stat().st_size)
        packets = _connections(path, base, collector)
        if any(place is not None for place in packets.values()):
            _Rows(base, collector, packets).read()


@contextmanager
def _opened(path: Path) -> Iterator[sqlite3.Connection]:
    """Yield a connection that reads a file without changing it.

    A file with a write-ahead log left by a crash is read in a copy. A file that was cut off is read in a copy of its complete
    pages whose head states their number, because SQLite would read missing pages as zeros, which are no data.
    """
    log = path.with_name(path.name + "-wal")
    with ExitStack() as stack:
        address = f"file:{quote(str(path.resolve()))}?immutable=1"
        if log.is_file() and log.stat().st_size > 0:
            folder = stack.enter_context(tempfile.TemporaryDirectory())
            shutil.copy(log, Path(folder) / log.name)
            address = f"file:{quote(shutil.copy(path, folder))}"
        elif (pages := _pages_left(path)) is not None:
            folder = stack.enter_context(tempfile.TemporaryDirectory())
            address = f"file:{quote(str(_shortened(path, Path(folder), *pages)))}?immutable=1"
        base = stack.enter_context(closing(sqlite3.connect(address, uri=True)))
        base.execute(f"PRAGMA mmap_size = {MAPPED_BYTES}")
        yield base


def _pages_left(path: Path) -> tuple[int, int] | None:
    """Return page size and number of complete pages of a file shorter than its head states; None for a complete file."""
    with path.open("rb") as stream:
        head = stream.read(100)
    size = int.from_bytes(head[16:18], "big")
    size = 65536 if size == 1 else size
    stated = int.from_bytes(head[28:32], "big")
    if len(head) < 100 or size < 512:
        return None
    pages, rest = divmod(path.stat().st_size, size)
    return (size, pages) if rest or pages < stated else None


def _shortened(path: Path, folder: Path, size: int, pages: int) -> Path:
    """Return a copy of the first pages, whose head states this number of pages."""
    copy = folder / path.name
    with path.open("rb") as source, copy.open("wb") as target:
        for _ in range(pages):
            target.write(source.read(size))
        target.seek(28)
        target.write(pages.to_bytes(4, "big"))
    return copy


def _connections(path: Path, base: sqlite3.Connection, collector: Collector) -> dict[int, TopicPackets | None]:
    try:
        topics = base.execute("SELECT id, name, type, serialization_format FROM topics ORDER BY id").fetchall()
    except sqlite3.OperationalError as error:
        raise LogError(f"`{path}` has no table of topics", found=str(error), hint=COPY_AGAIN) from error
    except DAMAGE as error:
        raise LogError(
            f"`{path}` is not a readable ROS 2 bag: {error}",
            found=f"{path.stat().st_size} bytes",
            hint=COPY_AGAIN,
        ) from error
    definitions = _definitions(base)
    packets: dict[int, TopicPackets | None] = {}
    for number, topic, kind, form in topics:
        if not all(isinstance(text, str) for text in (topic, kind, form)):
            collector.damaged("a row of the table of topics", {"row": number})
            continue
        language, text = definitions.get(kind, ("", ""))
        packets[number] = collector.connect(Connection(topic, kind, form, text, language))
    return packets


def _definitions(base: sqlite3.Connection) -> dict[str, tuple[Any, str]]:
    try:
        rows = base.execute("SELECT topic_type, encoding, encoded_message_definition FROM message_definitions").fetchall()
    except DAMAGE:
        return {}
    return {kind: (_LANGUAGES.get(encoding, ""), text) for kind, encoding, text in rows if isinstance(text, str)}


class _Rows:
    """Read the messages of the wanted topics in the order of their ids, continuing after rows that cannot be read.

    A row whose cell was overwritten by damage has no topic or stamp. Cells are next to each other on a page, so the damage may
    extend to the messages before and after it: these are left out too.
    """

    def __init__(self, base: sqlite3.Connection, collector: Collector, packets: Mapping[int, TopicPackets | None]) -> None:
        self.unwanted = [number for number, place in packets.items() if place is None]
        self.base = base
        self.collector = collector
        self.packets = {number: place for number, place in packets.items() if place is not None}
        # Exclude the unwanted topics instead of selecting the wanted ones, so that a damaged row of no known topic is noticed.
        marks = ",".join("?" for _ in self.unwanted)
        self.query = (
            "SELECT id, topic_id, timestamp, CAST(data AS BLOB) FROM messages WHERE id >= ? "  # noqa: S608 - marks only
            f"AND (topic_id NOT IN ({marks}) OR typeof(topic_id) <> 'integer') ORDER BY id"
        )
        self.last: tuple[int, TopicPackets | None] = (0, None)  # messages count from 1
        self.no_messages = 0

    def read(self) -> None:
        """Read all rows that can be read."""
        start: int | None = 0
        while start is not None:
            try:
                self._read_from(start)
            except DAMAGE as error:
                start = self._skip_damage(start, str(error) or "a row claims more bytes than the memory holds")
            else:
                start = None
        if self.no_messages:
            self.collector.damaged(f"{self.no_messages} rows of the table of messages", {"rows": self.no_messages})

    def _read_from(self, start: int) -> None:
        rows = self.base.execute(self.query, (start, *self.unwanted))
        if start:
            self._skip_a_message(rows)
        while not self._collect_rows(rows):
            self.no_messages += 1
            self._leave_out_last()
            self._skip_a_message(rows)

    def _collect_rows(self, rows: sqlite3.Cursor) -> bool:
        """Collect rows up to the last one (return True), or up to one that is no message (return False)."""
        add = {number: (p.stamps.append, p.payloads.append) for number, p in self.packets.items()}
        (number, _), topic, waiting = self.last, -1, 0
        try:
            for row, topic_id, stamp, data in rows:
                add_stamp, add_payload = add[topic_id]
                waiting += len(data)
                if waiting > SETTLE_BYTES:
                    self.collector.has_read(waiting)
                    waiting = 0
                add_stamp(stamp)
                add_payload(data)
                number, topic = row, topic_id
        except NO_MESSAGE:
            return False
        finally:
            self.last = (number, self.packets.get(topic))
        self.collector.has_read(waiting)
        return True

    def _skip_a_message(self, rows: sqlite3.Cursor) -> None:
        """Skip the rows up to and including the next one that is a message."""
        for _, topic, stamp, data in rows:
            if topic in self.packets and type(stamp) is int and type(data) is bytes:
                return
            self.no_messages += 1

    def _leave_out_last(self) -> None:
        _, packets = self.last
        if packets is not None:
            packets.leave_out_last()
            self.last = (self.last[0], None)

    def _skip_damage(self, start: int, reason: str) -> int | None:
        """Return the first id above `start` from which rows can be read again, or None; note which rows cannot be read."""
        self._leave_out_last()
        bad = max(self.last[0], start) + 1
        resume = self._first_readable(bad)
        if resume is None:
            self.collector.damaged(f"the table of messages from row {bad} on ({reason})", {"row": bad})
        else:
            self.collector.damaged(f"rows {bad} to {resume} of the table of messages ({reason})", {"row": bad, "to": resume})
        return resume

    def _first_readable(self, bad: int) -> int | None:
        """Return the first readable id above the unreadable id `bad`, or None: search by doubled steps, then by bisection."""
        step = 1
        while not self._is_readable(bad + step):
            step *= 2
            if bad + step > LAST_NS:
                return None
        low, high = bad + step // 2, bad + step
        while high - low > 1:
            middle = (low + high) // 2
            low, high = (low, middle) if self._is_readable(middle) else (middle, high)
        row = self.base.execute(self.query + " LIMIT 1", (high, *self.unwanted)).fetchone()
        return None if row is None else int(row[0])

    def _is_readable(self, start: int) -> bool:
        try:
            self.base.execute(self.query + " LIMIT 1", (start, *self.unwanted)).fetchone()
        except DAMAGE:
            return False
        return True
