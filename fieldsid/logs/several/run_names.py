"""Names of runs: each log's own, made different by folder and suffix where several share one, and no data twice."""

from __future__ import annotations

import os
import re
from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from hashlib import sha256
from itertools import takewhile
from pathlib import Path

from fieldsid.errors import UsageError
from fieldsid.logs.run import Run

_BOUNDARY = re.compile(r"[-_. ]+")
"""What stands between the words of a file's name."""
_BESIDE_NUMBERS = re.compile(r"[-_ ]+")
"""The same without the point of a number: the 4 of `pulses_1.4` is no word."""
LONGEST_NAME = 20
"""Letters of a name beside which a table of numbers has room in 80 columns."""


def stem_of(path: Path) -> str:
    """Return the name of the run in a log: that of a folder, or of a file without its suffix: run7 of `run7.csv.gz`."""
    if str(path) == "-":
        return "stdin"
    name = path.name or path.resolve().name
    if os.path.isdir(path):  # noqa: PTH112 - says no where a folder is closed, and does not raise
        return name
    for packed in (".gz", ".zstd"):
        name = name.removesuffix(packed)
    stem, dot, suffix = name.rpartition(".")
    # The 4 of `pulses_1.4` is no suffix.
    return stem if dot and stem and suffix[:1].isalpha() else name


def _real(path: Path) -> Path:
    """Return the file that a path leads to; a link that leads round and round stays what it is."""
    return Path(os.path.realpath(path))


def names_apart(names: Sequence[str], paths: Sequence[Path]) -> list[str]:
    """Return the names of the runs of some files, those that several share with as many folders before them as it takes.

    Files of one folder differ by their suffix. No two of the names are the same.
    """
    alike: dict[str, list[int]] = defaultdict(list)
    for i, name in enumerate(names):
        alike[name].append(i)
    out = list(names)
    for name, places in alike.items():
        if len(places) > 1:
            for i, own in zip(places, _told_apart(name, [_real(paths[i]) for i in places]), strict=True):
                out[i] = own
    return _numbered(out)


def runs_apart(runs: Sequence[Run]) -> list[Run]:
    """Return runs with names that no two share, as those of their files; of several from one file with a number behind each."""
    of_file: dict[Path | int, list[int]] = defaultdict(list)
    for i, run in enumerate(runs):
        of_file[i if run.source is None else _real(run.source)].append(i)
    first = [runs[places[0]] for places in of_file.values()]
    named = names_apart([run.name for run in first], [run.source or Path("/", run.name) for run in first])
    out = list(runs)
    for name, places in zip(named, of_file.values(), strict=True):
        for k, i in enumerate(places):
            own = name if len(places) == 1 else f"{name}_{k + 1}"
            out[i] = runs[i] if runs[i].name == own else replace(runs[i], name=own)
    return out


def name_of_run(tables: Sequence[Path]) -> str:
    """Return what a run in several tables is called: what their names begin with, else their folder."""
    shared = shared_start([stem_of(path) for path in tables]).rstrip("-_. ")
    return shared or tables[0].resolve().parent.name


def shared_start(stems: Sequence[str], boundary: re.Pattern[str] = _BOUNDARY) -> str:
    """Return what names begin with, up to the end of a word in all of them: up to what matches `boundary`."""
    same = common_start(stems)
    ends = [m.end() for m in boundary.finditer(same)]
    return same[: ends[-1]] if ends else ""


def common_start(names: Sequence[str]) -> str:
    """Return the letters that all names begin with."""
    return "".join(letters[0] for letters in takewhile(lambda found: len(set(found)) == 1, zip(*names, strict=False)))


@dataclass(frozen=True, slots=True)
class ShortNames:
    """What long names of several runs begin and end with, which a table leaves out: nothing where they are short or one."""

    start: str
    end: str

    def of(self, name: str) -> str:
        """Return a name with three dots for what all begin and end with."""
        middle = name[len(self.start) : len(name) - len(self.end)]
        return f"{'...' if self.start else ''}{middle}{'...' if self.end else ''}"

    @property
    def says(self) -> str:
        """What the dots stand for, in words; empty where there are none."""
        parts = [f"{verb} with `{part}`" for verb, part in (("begin", self.start), ("end", self.end)) if part]
        return f"the names of all runs {' and '.join(parts)}" if parts else ""


def short_names(names: Sequence[str]) -> ShortNames:
    """Return what the names of runs have in common, up to the ends of words, where one of them is longer than LONGEST_NAME."""
    if len(set(names)) < 2 or max(map(len, names)) <= LONGEST_NAME:
        return ShortNames("", "")
    start = shared_start(names, _BESIDE_NUMBERS)
    end = shared_start([name[len(start) :][::-1] for name in names], _BESIDE_NUMBERS)[::-1]
    return ShortNames(start, end)


def _told_apart(name: str, paths: Sequence[Path]) -> list[str]:
    """Return the shortest labels that differ, or the longest there are."""
    labels = [name] * len(paths)
    for labels in _labels(name, paths):
        if len(set(labels)) == len(labels):
            break
    return labels


def _labels(name: str, paths: Sequence[Path]) -> Iterator[list[str]]:
    deepest = max(len(p.parent.parts) for p in paths)
    folders = [["_".join([*p.parent.parts[1:][-k:], name] if k else [name]) for p in paths] for k in range(deepest)]
    yield from folders[1:]
    for of in folders:
        yield ["_".join([label, *p.suffixes[-1:]]).replace("_.", "_") for label, p in zip(of, paths, strict=True)]


def _numbered(names: Sequence[str]) -> list[str]:
    """Return the names with a number behind each that an earlier one has already."""
    out: list[str] = []
    for name in names:
        own, n = name, 1
        while own in out:
            n += 1
            own = f"{name}_{n}"
        out.append(own)
    return out


def refuse_twice(runs: Sequence[Run], paths: Sequence[Path]) -> None:
    """Raise UsageError where two files hold the same data: a fit would count them twice, a check would have seen them."""
    if len(runs) < 2:
        return
    seen: dict[str, int] = {}
    for i, (run, path) in enumerate(zip(runs, paths, strict=True)):
        place = seen.setdefault(_data_of(run), i)
        if place == i:
            continue
        first = paths[place]
        if _real(first) == _real(path):
            raise UsageError(f"`{path}` is given twice", found=f"{len(runs)} logs", hint="give each log once")
        raise UsageError(
            f"`{path}` holds the same data as `{first}`: it is given twice",
            found=f"{len(run)} samples of {', '.join(run.signals)}, equal in each number",
            hint=f"leave `{path}` out",
        )


def _data_of(run: Run) -> str:
    """Return the SHA-256 of a run's time and signals, whatever file they came in."""
    digest = sha256(run.time.tobytes())
    for name in sorted(run.signals):
        digest.update(name.encode())
        digest.update(run.signals[name].tobytes())
    return digest.hexdigest()
