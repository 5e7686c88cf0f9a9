"""Read logs of Slocum gliders, .dbd and related formats, by dbdreader (extra `slocum`): each sensor at its times of writing."""

from __future__ import annotations

import re
from pathlib import Path
from shutil import copy
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from fieldsid.errors import LogError
from fieldsid.logs.reader import ReadOptions
from fieldsid.logs.readers._topics import DATA, Means, Topic, Topics, library, topic_of, topic_reader
from fieldsid.logs.run import Note
from fieldsid.logs.unknown_file import COPY_AGAIN, head_of, is_glider_log, unreadable

END = b"X"
SIZES = {1, 2, 4, 8}
"""Possible numbers of bytes of a sensor's value."""
MEANS: Means = {
    f"m_heading.{DATA}": ("yaw_rad", {"unit": "rad"}),
    f"m_pitch.{DATA}": ("pitch_rad", {"unit": "rad"}),
    f"m_roll.{DATA}": ("roll_rad", {"unit": "rad"}),
    f"m_depth.{DATA}": ("depth_m", {"unit": "m"}),
    f"m_fin.{DATA}": ("rudder_measured_rad", {"unit": "rad"}),
    f"c_heading.{DATA}": ("yaw_goal_rad", {"unit": "rad"}),
    f"c_pitch.{DATA}": ("pitch_goal_rad", {"unit": "rad"}),
    f"c_fin.{DATA}": ("rudder_rad", {"unit": "rad"}),
}
"""Signals by the glider's sensors: heading from north, pitch positive up, fin as rudder; `c_` is commanded, `m_` measured."""
_TAGS = re.compile(rb"num_ascii_tags:\s*(\d+)")
_CACHE = re.compile(rb"sensor_list_crc:\s*(\w+)")
_FACTORED = re.compile(rb"sensor_list_factored:\s*1")
_FAILURES = (ValueError, KeyError, IndexError, TypeError, OSError, UnicodeDecodeError)


def sniff(path: Path) -> bool:
    """Whether a file has the head of a glider's binary log."""
    return is_glider_log(head_of(path))


def _topics(path: Path, options: ReadOptions, wanted: frozenset[str]) -> Topics:
    """Return the wanted sensors, or all sensors if one of them is missing; raises LogError, also without dbdreader."""
    dbdreader = library("dbdreader", path, "a Slocum glider's log", "slocum")
    _refuse_cut_head(path)
    cache = _cache_of(path)
    try:
        # dbdreader writes the list of sensors that is inside a log to its cache folder, which must not be the folder of the log.
        # It looks for the file of an external list by a lower-case name, while gliders write upper-case names.
        with TemporaryDirectory() as cache_folder:
            if cache is not None:
                copy(cache, Path(cache_folder) / cache.name.lower())
            log = dbdreader.DBD(str(path), cacheDir=cache_folder)
            log.close()  # it opens the file again to read it
            _refuse_other_lengths(path, log)
            found = _sensors(log, sorted(wanted.intersection(log.parameterNames)))
            if not wanted or any(found.get(name) is None for name in wanted):
                found = _sensors(log, log.parameterNames)
    except (*_FAILURES, dbdreader.DbdError) as error:
        raise unreadable(path, "a Slocum glider's log that cannot be read", error) from error
    return Topics(found, MEANS, _cut(path))


def _refuse_cut_head(path: Path) -> None:
    """Raise LogError where the head has fewer lines than it states: dbdreader would search for them in an endless loop."""
    head = head_of(path)
    tags = _TAGS.search(head)
    lines = head.count(b"\n")
    if tags is None or lines < int(tags[1]) or head.count(b"\n", 0, tags.start()) >= int(tags[1]):
        counted = tags[1].decode() if tags else "no number"
        found = f"{lines} lines in its first {len(head)} bytes, of which {counted} are to be its head"
        raise LogError(f"`{path}` is a Slocum glider's log that cannot be read", found=found, hint=COPY_AGAIN)


def _refuse_other_lengths(path: Path, log: Any) -> None:
    """Raise LogError where the head's counts differ from its list of sensors: the compiled part of dbdreader trusts them."""
    count, sizes, names = log.headerInfo["sensors_per_cycle"], log.byteSizes, log.parameterNames
    fits = len(sizes) == count > 0 and log.n_state_bytes == -(-count // 4) and len(set(names)) == count
    if not fits or not set(sizes) <= SIZES:
        found = (
            f"{len(sizes)} sensors of {sorted(set(sizes))} bytes where {count} with {log.n_state_bytes} bytes of state are stated"
        )
        raise LogError(f"`{path}` is a Slocum glider's log whose list of sensors is damaged", found=found, hint=COPY_AGAIN)


def _sensors(log: Any, names: list[str]) -> dict[str, Topic | None]:
    """Return sensors by name, read in one pass through the file, because a glider has two thousand of them."""
    read = log.get(*names) if len(names) > 1 else [log.get(*names)] if names else []
    return {
        name: topic_of(np.asarray(time, dtype=np.float64), {DATA: np.asarray(values, dtype=np.float64)}, log.parameterUnits[name])
        for name, (time, values) in zip(names, read, strict=True)
    }


def _cut(path: Path) -> tuple[Note, ...]:
    """Return the note that a log is cut off, because it does not end with the mark that the glider writes last."""
    with path.open("rb") as stream:
        stream.seek(-1, 2)
        is_whole = stream.read(1) == END
    return () if is_whole else (Note("truncated", "the log is cut off: it does not end with the glider's mark", {}),)


def _cache_of(path: Path) -> Path | None:
    """Return the file of the list of sensors that a log refers to, None where the log contains it; raises LogError without it."""
    head = head_of(path)
    found = _CACHE.search(head)
    if found is None or not _FACTORED.search(head):
        return None
    crc = found[1].decode()
    folders = (path.parent, *(place / name for place in (path.parent, path.parent.parent) for name in ("cache", "cac")))
    names = {f"{crc}{suffix}".lower() for suffix in (".cac", ".ccc")}
    for folder in (f for f in folders if f.is_dir()):
        for file in sorted(folder.iterdir()):
            if file.name.lower() in names:
                return file
    raise LogError(
        f"`{path}` leaves the list of its sensors to a file that is not there",
        found=f"no `{crc}.cac` in {', '.join(f'`{f}`' for f in folders)}",
        hint="copy it from the glider's or the dock server's cache folder beside the log",
    )


READER = topic_reader(
    "slocum",
    "Slocum glider log: .dbd, .ebd and their kin, with the extra `slocum`",
    (".dbd", ".ebd", ".mbd", ".nbd", ".sbd", ".tbd"),
    "Slocum glider log",
    sniff,
    _topics,
)
