"""What is asked of one log, and the name its answer is kept under: the same while neither the log nor the question changes."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from fieldsid._version import __version__
from fieldsid.logs.load import MAPPING_FILE

QUESTION = 1
"""Version of what is asked: raised where a row would come out differently."""


@dataclass(frozen=True, slots=True)
class Settings:
    """What is asked of every log: the axis, the method, whether the missing effect is sought, and the files that say more."""

    axis: str
    method: str = "auto"
    diagnose: bool = True
    whole: bool = False
    mapping: str | None = None
    vehicle: str | None = None


@dataclass(frozen=True, slots=True)
class Task:
    """One log and what is asked of it."""

    log: str
    settings: Settings

    @property
    def key(self) -> str:
        """What tells this task from others: the log's place, size and change, the question, and the files that say more."""
        found = Path(self.log).parent / MAPPING_FILE  # what a log is read with where no mapping is named
        picked_up = next((str(p) for p in (Path(MAPPING_FILE), found) if p.is_file()), None)
        named = (self.settings.mapping or picked_up, self.settings.vehicle)
        said = [Path(name).read_text(encoding="utf-8", errors="replace") if name else "" for name in named]
        parts = [QUESTION, __version__, str(Path(self.log).resolve()), *_stamp(Path(self.log)), asdict(self.settings), said]
        return hashlib.sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest()[:24]

    def plain(self) -> dict[str, Any]:
        """Return the task as plain values, which `task_of` reads."""
        return asdict(self)


def task_of(body: Mapping[str, Any]) -> Task:
    """Return the task of plain values."""
    return Task(body["log"], Settings(**body["settings"]))


def logs_in(paths: list[Path]) -> list[Path]:
    """Return the logs that paths name, each once: a folder that is no bag stands for all files in and below it."""
    from fieldsid.logs.readers.bags.stores import is_bag

    found: dict[str, Path] = {}
    for path in paths:
        for log in _below(path) if path.is_dir() and not is_bag(path) else [path]:
            found.setdefault(str(log.resolve()), log)
    return list(found.values())


def _below(folder: Path) -> list[Path]:
    """Return the files and bags in a folder, hidden ones left out."""
    from fieldsid.logs.readers.bags.stores import is_bag

    out: list[Path] = []
    for path in sorted(folder.iterdir()):
        if path.name.startswith("."):
            continue
        if path.is_dir() and not is_bag(path):
            out += _below(path)
        else:
            out.append(path)
    return out


def _stamp(path: Path) -> tuple[int, int]:
    files = [p for p in path.rglob("*") if p.is_file()] if path.is_dir() else [path]
    found = [p.stat() for p in files if p.exists()]
    return sum(s.st_size for s in found), max((s.st_mtime_ns for s in found), default=0)
