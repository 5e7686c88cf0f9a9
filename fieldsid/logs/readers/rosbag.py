"""ROS 1 and ROS 2 bags: .bag, .mcap and .db3, as a file or as the folder that ROS 2 writes.

Only the mapped topics are decoded, and of them only the mapped fields: see _layout.py.
"""

from __future__ import annotations

import tempfile
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from fieldsid.errors import LogError
from fieldsid.logs.channels import ChannelMap, TableForm
from fieldsid.logs.reader import Inventory, RawLog, Reader, ReadOptions
from fieldsid.logs.readers import _db3, _mcap, _ros1
from fieldsid.logs.readers._packets import ENOUGH, Catch, Slot

SCANS = {_ros1.MAGIC: _ros1.scan, _mcap.MAGIC: _mcap.scan, _db3.MAGIC: _db3.scan}
STORES = (".mcap", ".db3", ".bag")
LAST_NS = (1 << 63) - 1
"""Largest stamp that is a signed 64-bit number."""
ZSTD = b"\x28\xb5\x2f\xfd"


def sniff(path: Path) -> bool:
    """Whether a file starts like a bag, or a folder holds one."""
    if path.is_dir():
        return bool(_parts(path))
    return path.name.endswith((".mcap.zstd", ".db3.zstd")) or _scan_of(path) is not None


def inventory(path: Path, options: ReadOptions, form: TableForm) -> Inventory:
    """Return topics with type, count, rate and the first values of every number inside."""
    from fieldsid.logs.readers._contents import contents_of

    catch = caught(path, None, keep=1)
    return contents_of(path, catch, options)


def read(path: Path, mapping: ChannelMap, options: ReadOptions) -> RawLog:
    """Return the mapped signals; raises MappingError for an unknown topic or field, LogError for an empty bag."""
    from fieldsid.logs.readers._signals import signals_of

    topics = {s.topic for s in mapping.sources.values() if s.topic is not None}
    catch = caught(path, topics)
    return signals_of(path, catch, mapping, options)


def own_map(path: Path, options: ReadOptions) -> ChannelMap | None:
    """Return None: a bag's topics have no canonical names."""
    return None


def caught(path: Path, wanted: Collection[str] | None, *, keep: int = ENOUGH) -> Catch:
    """Return the packets of the wanted topics (all when None) of a bag, in the order of their receive stamps."""
    catch = Catch(wanted, keep)
    with _plain_parts(path) as parts:
        for part in parts:
            scan = _scan_of(part)
            if scan is None:
                raise LogError(
                    f"`{part}` is not a bag", found=f"{part.stat().st_size} bytes", hint="copy it from the vehicle again"
                )
            scan(part, catch)
    for slot in catch.slots.values():
        if slot.payloads and slot.payloads[0].startswith(ZSTD):
            _unpack_messages(slot, catch)
        _drop_impossible_stamps(slot, catch)
        _sort(slot)
    return catch


def _scan_of(path: Path) -> Any:
    with path.open("rb") as stream:
        head = stream.read(16)
    return next((scan for magic, scan in SCANS.items() if head.startswith(magic)), None)


def _parts(folder: Path) -> list[Path]:
    """Return the stores in a bag folder, in the order the recorder split them."""
    suffixes = (*STORES, ".mcap.zstd", ".db3.zstd")
    found = [p for p in folder.iterdir() if p.is_file() and p.name.endswith(suffixes) and p.stat().st_size > 0]
    return sorted(found, key=lambda p: (len(p.name), p.name))


@contextmanager
def _plain_parts(path: Path) -> Iterator[list[Path]]:
    """Yield the stores of a bag; those compressed as whole files are unpacked into a temporary folder."""
    with tempfile.TemporaryDirectory() as folder:
        yield [_plain(part, Path(folder)) for part in (_parts(path) if path.is_dir() else [path])]


def _plain(part: Path, folder: Path) -> Path:
    if part.suffix != ".zstd":
        return part
    from fieldsid.logs.readers._unpack import unzstd

    plain = unzstd(part.read_bytes())
    if plain is None:
        raise LogError(f"`{part}` cannot be unpacked", found="damaged zstd data", hint="copy it from the vehicle again")
    copy = folder / part.stem
    copy.write_bytes(plain)
    return copy


def _unpack_messages(slot: Slot, catch: Catch) -> None:
    """Unpack a topic whose messages the recorder compressed one by one; no plain message starts like zstd data."""
    from fieldsid.logs.readers._unpack import unzstd

    plain = [unzstd(p) for p in slot.payloads]
    if None in plain:
        catch.damaged("a compressed message", 0)
        if len(slot.stamps) == len(plain):
            slot.stamps = [s for s, p in zip(slot.stamps, plain, strict=True) if p is not None]
    slot.payloads = [p for p in plain if p is not None]


def _drop_impossible_stamps(slot: Slot, catch: Catch) -> None:
    """Leave out packets whose stamp is no time in nanoseconds: only damage makes one."""
    if not slot.stamps or max(slot.stamps) <= LAST_NS:
        return
    good = [i for i, s in enumerate(slot.stamps) if s <= LAST_NS]
    catch.damaged("a stamp", 0)
    slot.payloads = [slot.payloads[i] for i in good if i < len(slot.payloads)]
    slot.stamps = [slot.stamps[i] for i in good]


def _sort(slot: Slot) -> None:
    """Put packets into the order they were received in; a recorder with several threads may write them otherwise."""
    stamps = np.asarray(slot.stamps, dtype=np.int64)
    if stamps.size < 2 or bool((np.diff(stamps) >= 0).all()):
        return
    order = np.argsort(stamps, kind="stable")
    slot.stamps = stamps[order].tolist()
    if len(slot.payloads) == stamps.size:
        slot.payloads = [slot.payloads[i] for i in order]


READER = Reader(
    name="rosbag",
    says="ROS 1 bag, ROS 2 mcap or db3, a file or a folder",
    suffixes=(".bag", ".mcap", ".db3"),
    sniff=sniff,
    inventory=inventory,
    read=read,
    own_map=own_map,
)
