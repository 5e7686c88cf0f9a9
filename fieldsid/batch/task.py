"""The task for one log, and the name of its stored answer, which is the same while neither the log nor the settings change."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from fieldsid._version import __version__
from fieldsid.logs.load import MAPPING_FILE
from fieldsid.records.named_inputs import size_and_time

QUESTION = 1
"""Version of the task: increased where a row would come out differently."""


@dataclass(frozen=True, slots=True)
class Settings:
    """The settings for every log: the axis, the method, whether to diagnose, and the paths of vehicle and mapping."""

    axis: str
    method: str = "auto"
    diagnose: bool = True
    whole: bool = False
    mapping: str | None = None
    vehicle: str | None = None


@dataclass(frozen=True, slots=True)
class Task:
    """One log with the settings for it."""

    log: str
    settings: Settings

    @property
    def key(self) -> str:
        """The hash of what determines the answer: path, size and time of the log, version, settings, contents of their files."""
        found = Path(self.log).parent / MAPPING_FILE  # the default mapping of a log
        picked_up = next((str(p) for p in (Path(MAPPING_FILE), found) if p.is_file()), None)
        named = (self.settings.mapping or picked_up, self.settings.vehicle)
        contents = [Path(name).read_text(encoding="utf-8", errors="replace") if name else "" for name in named]
        parts = [
            QUESTION,
            __version__,
            str(Path(self.log).resolve()),
            *size_and_time(Path(self.log)),
            asdict(self.settings),
            contents,
        ]
        return hashlib.sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest()[:24]

    def plain(self) -> dict[str, Any]:
        """Return the task as plain values, which `task_of` reads."""
        return asdict(self)


def task_of(body: Mapping[str, Any]) -> Task:
    """Return the task of plain values."""
    return Task(body["log"], Settings(**body["settings"]))


def logs_in(paths: list[Path]) -> list[Path]:
    """Return the distinct logs of some paths: a folder that is not a bag stands for all files in and below it."""
    from fieldsid.logs.readers.bags.stores import is_bag

    found: dict[str, Path] = {}
    for path in paths:
        for log in _logs_below(path) if path.is_dir() and not is_bag(path) else [path]:
            found.setdefault(str(log.resolve()), log)
    return list(found.values())


def _logs_below(folder: Path) -> list[Path]:
    """Return the files and bags in and below a folder, without hidden ones."""
    from fieldsid.logs.readers.bags.stores import is_bag

    out: list[Path] = []
    for path in sorted(folder.iterdir()):
        if path.name.startswith("."):
            continue
        if path.is_dir() and not is_bag(path):
            out += _logs_below(path)
        else:
            out.append(path)
    return out
