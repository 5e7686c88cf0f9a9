"""Spoil good files and put them through the doors: what ends in anything but an answer or a plain refusal is a crash.

By name, for a longer search:

    python tests/fuzz/fuzzing.py --count 100000 [--seed 1] [--keep FOLDER] [KIND ...]
"""

from __future__ import annotations

import argparse
import contextlib
import io
import shutil
import signal
import sys
import tempfile
import time
import traceback
import warnings
from dataclasses import dataclass
from pathlib import Path

if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import numpy as np
import typer
from fuzz.kinds import KINDS, Kind

from fieldsid.cli.failure import CLOSED
from fieldsid.errors import FieldsidError

LONGEST_S = 20
"""Processor time of one file, whatever else the machine does."""
STUCK_S = 300
"""Wall time after which a file is one that hangs, waiting for something."""
MEMORY = 6 << 30
"""Address space in bytes: a length that a file invents must not be believed."""


class TooLongError(Exception):
    """A file that is still being worked on after LONGEST_S of processor time, or after STUCK_S."""


@dataclass(frozen=True)
class Crash:
    """One spoilt file that was not answered: its kind and seed, and what was raised where."""

    kind: str
    seed: int
    error: str
    trace: str


def _ring(*_given) -> None:
    raise TooLongError(f"not done after {LONGEST_S} s of processor time or {STUCK_S} s in all")


def _set(processor_s: int, wall_s: int) -> None:
    signal.setitimer(signal.ITIMER_PROF, processor_s)
    signal.alarm(wall_s)


def fuzz(kind: Kind, seeds, folder: Path, keep: Path | None = None) -> list[Crash]:
    """Return the crashes of the spoilt files of one kind, one for each seed."""
    source = folder / "good"
    source.mkdir()
    made = kind.make(source)
    crashes = []
    before = {s: signal.signal(s, _ring) for s in (signal.SIGALRM, signal.SIGPROF)}
    try:
        for seed in seeds:
            crash = _attempt(kind, made, seed, folder, keep)
            crashes += [crash] if crash else []
    finally:
        _set(0, 0)
        for number, handler in before.items():
            signal.signal(number, handler)
    return crashes


def _attempt(kind: Kind, made: Path, seed: int, folder: Path, keep: Path | None) -> Crash | None:
    random = np.random.default_rng(seed)
    place = folder / "spoilt"
    shutil.rmtree(place, ignore_errors=True)
    place.mkdir()
    path = place / made.name
    (shutil.copytree if made.is_dir() else shutil.copy)(made, path)
    part = next(path.glob(kind.part)) if kind.part and path.is_dir() else path
    spoil = kind.spoilers[int(random.integers(0, len(kind.spoilers)))]
    part.write_bytes(spoil(part.read_bytes(), random))
    for door in kind.doors:
        try:
            _set(LONGEST_S, STUCK_S)
            with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()), warnings.catch_warnings():
                warnings.simplefilter("ignore")
                door(path)
            _set(0, 0)
        except (FieldsidError, typer.Exit):
            _set(0, 0)
        except Exception as error:  # noqa: BLE001 - any other error is what is looked for
            _set(0, 0)
            if isinstance(error, OSError) and error.errno in CLOSED:  # told as what it is, see cli/failure.py
                continue
            if keep is not None:
                target = keep / f"{kind.name}-{seed}"
                shutil.rmtree(target, ignore_errors=True)
                shutil.copytree(place, target)
            return Crash(kind.name, seed, f"{type(error).__name__}: {error}"[:200], traceback.format_exc())
    return None


def by_place(crashes) -> dict[str, list[Crash]]:
    """Group crashes by the last line of the package that they passed."""
    groups: dict[str, list[Crash]] = {}
    for crash in crashes:
        lines = [line.strip() for line in crash.trace.splitlines() if "/fieldsid/" in line and line.strip().startswith("File")]
        where = lines[-1].split("/fieldsid/", 1)[1] if lines else "?"
        groups.setdefault(f"{crash.kind}: {where}: {crash.error[:90]}", []).append(crash)
    return groups


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("kinds", nargs="*")
    parser.add_argument("--count", type=int, default=1000, help="spoilt files in all")
    parser.add_argument("--seconds", type=float, default=float("inf"), help="stop after so long")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--keep", type=Path)
    given = parser.parse_args()
    with contextlib.suppress(ImportError):
        import resource

        resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    kinds = [k for k in KINDS if not given.kinds or k.name in given.kinds]
    total, began = 0, time.monotonic()
    found: list[Crash] = []
    each = -(-given.count // len(kinds))
    for k, kind in enumerate(kinds):
        left = (given.seconds - (time.monotonic() - began)) / (len(kinds) - k)
        start = done = 0
        here, at = [], time.monotonic()
        while done < each and time.monotonic() - at < left:
            batch = min(50, each - done)
            with tempfile.TemporaryDirectory() as name:
                seeds = range(given.seed * 10**7 + start, given.seed * 10**7 + start + batch)
                here += fuzz(kind, seeds, Path(name), given.keep)
            start, done = start + batch, done + batch
        took = time.monotonic() - at
        print(f"{kind.name:14} {done:7} files {len(here):5} crashes {1e3 * took / max(done, 1):7.1f} ms each", flush=True)
        total, found = total + done, found + here
    for place, crashes in sorted(by_place(found).items(), key=lambda p: -len(p[1])):
        print(f"{len(crashes):5}  {place}  seed {crashes[0].seed}")
    print(f"{total} spoilt files, {len(found)} crashes")
    return bool(found)


if __name__ == "__main__":
    sys.exit(main())
