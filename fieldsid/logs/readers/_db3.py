"""ROS 2 SQLite files (.db3), read row by row: a cut-off or malformed file gives the rows before the damage."""

from __future__ import annotations

import shutil
import sqlite3
import tempfile
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any
from urllib.parse import quote

from fieldsid.errors import LogError
from fieldsid.logs.readers._packets import Catch, Link, Slot

MAGIC = b"SQLite format 3\x00"
DAMAGE = (sqlite3.DatabaseError, MemoryError, UnicodeDecodeError)
"""What SQLite raises on a damaged file: it believes a damaged length and finds no memory, and quotes damaged text."""
_LANGUAGES = {"ros2msg": "msg", "ros2idl": "idl"}


def scan(path: Path, catch: Catch) -> None:
    """Read every message of a file into `catch`; raises LogError when not even the list of topics can be read."""
    with _opened(path) as base:
        if _pages_left(path) is not None:
            catch.truncated("pages are missing", path.stat().st_size)
        slots = _links(path, base, catch)
        wanted = {number: slot for number, slot in slots.items() if slot is not None}
        if wanted:
            _rows(path, base, catch, wanted)


@contextmanager
def _opened(path: Path) -> Iterator[sqlite3.Connection]:
    """Open for reading without touching the file.

    What a crash left in the write-ahead log is read in a copy. A file that was cut is read in a copy of its whole
    pages, which says so itself: SQLite takes a missing page for zeros, and zeros are no data.
    """
    log = path.with_name(path.name + "-wal")
    with tempfile.TemporaryDirectory() as folder:
        address = f"file:{quote(str(path.resolve()))}?immutable=1"
        if log.is_file() and log.stat().st_size > 0:
            shutil.copy(log, Path(folder) / log.name)
            address = f"file:{quote(shutil.copy(path, folder))}"
        elif (pages := _pages_left(path)) is not None:
            address = f"file:{quote(str(_shortened(path, Path(folder), *pages)))}?immutable=1"
        with closing(sqlite3.connect(address, uri=True)) as base:
            yield base


def _pages_left(path: Path) -> tuple[int, int] | None:
    """Return the page size and the whole pages of a file that is shorter than its head says; None for a whole one."""
    with path.open("rb") as stream:
        head = stream.read(100)
    size = int.from_bytes(head[16:18], "big")
    size = 65536 if size == 1 else size
    stated = int.from_bytes(head[28:32], "big")
    if len(head) < 100 or size < 512:
        return None
    left, rest = divmod(path.stat().st_size, size)
    return (size, left) if rest or left < stated else None


def _shortened(path: Path, folder: Path, size: int, pages: int) -> Path:
    """Return a copy of the first pages whose head states that there are no more."""
    copy = folder / path.name
    with path.open("rb") as source, copy.open("wb") as target:
        for _ in range(pages):
            target.write(source.read(size))
        target.seek(28)
        target.write(pages.to_bytes(4, "big"))
    return copy


def _links(path: Path, base: sqlite3.Connection, catch: Catch) -> dict[int, Slot | None]:
    try:
        topics = base.execute("SELECT id, name, type, serialization_format FROM topics ORDER BY id").fetchall()
    except DAMAGE as error:
        raise LogError(
            f"`{path}` is not a readable ROS 2 bag: {_said(error)}",
            found=f"{path.stat().st_size} bytes",
            hint="copy it from the vehicle again",
        ) from error
    definitions = _definitions(base)
    slots: dict[int, Slot | None] = {}
    for number, topic, kind, form in topics:
        language, text = definitions.get(kind, ("", ""))
        slots[number] = catch.link(Link(topic, kind, "cdr" if form == "cdr" else "other", text, language))
    return slots


def _definitions(base: sqlite3.Connection) -> dict[str, tuple[Any, str]]:
    try:
        rows = base.execute("SELECT topic_type, encoding, encoded_message_definition FROM message_definitions").fetchall()
    except DAMAGE:
        return {}
    return {kind: (_LANGUAGES.get(encoding, ""), text) for kind, encoding, text in rows}


def _rows(path: Path, base: sqlite3.Connection, catch: Catch, slots: dict[int, Slot]) -> None:
    marks = ",".join("?" for _ in slots)
    query = f"SELECT topic_id, timestamp, data FROM messages WHERE topic_id IN ({marks}) ORDER BY id"  # noqa: S608 - marks only
    try:
        for number, stamp, data in base.execute(query, tuple(slots)):
            slots[number].take(stamp, data)
    except DAMAGE as error:
        if not catch.notes:
            catch.truncated(_said(error), path.stat().st_size)


def _said(error: BaseException) -> str:
    return str(error) or "a row claims more bytes than the memory holds"
