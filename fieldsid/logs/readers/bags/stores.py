"""Read the files of a bag in sequence."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from fieldsid.errors import LogError
from fieldsid.logs.readers._unpacked import UnpackedSize
from fieldsid.logs.readers.bags.containers import db3, mcap, ros1
from fieldsid.logs.readers.bags.containers.metadata import check_against_metadata
from fieldsid.logs.readers.bags.packets import Collector, Connection, Settle, TopicPackets, keep_all
from fieldsid.logs.run import Note
from fieldsid.logs.unknown_file import COPY_AGAIN, head_of

Scan = Callable[[Path, Collector], None]
SCANS: Mapping[bytes, Scan] = {ros1.MAGIC: ros1.scan, mcap.MAGIC: mcap.scan, db3.MAGIC: db3.scan}
SUFFIXES = (".mcap", ".db3", ".bag")
PACKED = (".mcap.zstd", ".db3.zstd")
ZSTD = b"\x28\xb5\x2f\xfd"


def is_bag(path: Path) -> bool:
    """Whether a file starts like a bag, or a folder has files of one."""
    if path.is_dir():
        return bool(_parts(path))
    return path.name.endswith(PACKED) or _scan_of(path) is not None


def collected(
    path: Path,
    wanted: Collection[str] | None,
    settle: Settle = keep_all,
    progress: Callable[[float], None] = lambda _: None,
) -> Collector:
    """Return the connections and packets of the wanted topics (all when None) of a bag, in the order of its files."""

    def unpacked_first(connection: Connection, packets: TopicPackets) -> None:
        if packets.payloads[-1].startswith(ZSTD):
            _unpack_messages(packets, collector)
        settle(connection, packets)

    collector = Collector(wanted, unpacked_first, progress)
    parts = _parts(path) if path.is_dir() else [path]
    collector.size = sum(part.stat().st_size for part in parts)
    collector.unpacked = UnpackedSize(path, collector.size)
    for part in parts:
        with _plain_part(part, collector) as plain:
            collector.file = plain.name
            (_scan_of(plain) or _unknown)(plain, collector)
    collector.settle()
    progress(1.0)
    collector.note_further_places()
    check_against_metadata(path, collector)
    return collector


def _unknown(path: Path, collector: Collector) -> None:
    start = head_of(path)[:16]
    raise LogError(f"`{path}` is not a bag", found=f"it starts with {start!r}", hint=COPY_AGAIN)


def _scan_of(path: Path) -> Scan | None:
    head = head_of(path)
    return next((scan for magic, scan in SCANS.items() if head.startswith(magic)), None)


def _parts(folder: Path) -> list[Path]:
    """Return the files of a bag's folder in the order in which they were recorded."""
    found = [p for p in folder.iterdir() if p.is_file() and p.name.endswith((*SUFFIXES, *PACKED)) and p.stat().st_size > 0]
    return sorted(found, key=lambda p: (len(p.name), p.name))


@contextmanager
def _plain_part(part: Path, collector: Collector) -> Iterator[Path]:
    """Yield a file of a bag; a compressed file is first unpacked into a temporary folder.

    Raises LogError where nothing can be unpacked.
    """
    if part.suffix != ".zstd":
        yield part
        return
    from fieldsid.logs.readers.bags.containers.decompress import unpack_file

    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder) / part.stem
        cause = unpack_file(part, copy)
        if cause is not None:
            message = f"{part.name} is {cause}: {copy.stat().st_size} unpacked bytes were read"
            collector.notes.append(Note("truncated", message, {"bytes": copy.stat().st_size}))
        if not copy.stat().st_size:
            raise LogError(f"`{part}` cannot be unpacked", found="damaged zstd data", hint=COPY_AGAIN)
        yield copy


def _unpack_messages(packets: TopicPackets, collector: Collector) -> None:
    """Unpack messages that the recorder compressed one by one; an uncompressed message never starts like zstd data."""
    from fieldsid.logs.readers.bags.containers.decompress import unpacked

    plain = [unpacked(p, "zstd") if p.startswith(ZSTD) else p for p in packets.payloads]
    if None in plain:
        collector.damaged(f"{plain.count(None)} compressed messages on {packets.topic}", {"topic": packets.topic})
    collector.unpacked.add(sum(len(p) for p in plain if p is not None))
    packets.payloads[:] = [p or b"" for p in plain]
