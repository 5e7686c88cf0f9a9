"""Names of runs, made distinct by folder and suffix where several logs share one, and the refusal of data given twice."""

from __future__ import annotations

import os
import re
from collections import Counter, defaultdict
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from hashlib import sha256
from itertools import chain, count, takewhile
from pathlib import Path

from fieldsid.errors import UsageError
from fieldsid.logs.run import Run

_BOUNDARY = re.compile(r"[-_. ]+")
"""Separators between the words of a file name."""
_BOUNDARY_WITHOUT_POINT = re.compile(r"[-_ ]+")
"""The separators without the point, since the 4 of `pulses_1.4` is not a word."""
LONGEST_NAME = 20
"""Largest length of a name that leaves space for a table of numbers in 80 columns."""


def stem_of(path: Path) -> str:
    """Return the name of the run in a log: that of the folder, or of the file without its suffix (run7 for `run7.csv.gz`)."""
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
    """Return the file that a path leads to, with links resolved; a circular link is returned as it is."""
    return Path(os.path.realpath(path))


def names_apart(names: Sequence[str], paths: Sequence[Path]) -> list[str]:
    """Return distinct names of the runs of some files; a shared name is preceded by as many folders as are needed.

    Files of one folder differ by their suffix.
    """
    out = list(names)
    for name in dict.fromkeys(name for name, number in Counter(names).items() if number > 1):
        places = [i for i, known in enumerate(names) if known == name]
        labels = list(_labels(name, [_real(paths[i]) for i in places]))
        for i, label in zip(places, next((found for found in labels if len(set(found)) == len(found)), labels[-1]), strict=True):
            out[i] = label
    for i, name in enumerate(out):
        numbered = (f"{name}_{n}" for n in count(2))
        out[i] = next(label for label in chain([name], numbered) if label not in out[:i])
    return out


def runs_apart(runs: Sequence[Run]) -> list[Run]:
    """Return runs with distinct names, as those of their files; several runs of one file have a number appended."""
    of_file: dict[Path | int, list[int]] = defaultdict(list)
    for i, run in enumerate(runs):
        of_file[i if run.source is None else _real(run.source)].append(i)
    first = [runs[places[0]] for places in of_file.values()]
    named = names_apart([run.name for run in first], [run.source or Path("/", run.name) for run in first])
    out = list(runs)
    for name, places in zip(named, of_file.values(), strict=True):
        for k, i in enumerate(places):
            label_of_run = name if len(places) == 1 else f"{name}_{k + 1}"
            out[i] = runs[i] if runs[i].name == label_of_run else replace(runs[i], name=label_of_run)
    return out


def name_of_run(tables: Sequence[Path]) -> str:
    """Return the name of a run in several tables: the common start of their names, else their folder."""
    shared = shared_start([stem_of(path) for path in tables]).rstrip("-_. ")
    return shared or tables[0].resolve().parent.name


def shared_start(stems: Sequence[str], boundary: re.Pattern[str] = _BOUNDARY) -> str:
    """Return the common start of names, up to and including the last match of `boundary` in it."""
    same = common_start(stems)
    ends = [m.end() for m in boundary.finditer(same)]
    return same[: ends[-1]] if ends else ""


def common_start(names: Sequence[str]) -> str:
    """Return the longest common start of names."""
    return "".join(letters[0] for letters in takewhile(lambda found: len(set(found)) == 1, zip(*names, strict=False)))


@dataclass(frozen=True, slots=True)
class ShortNames:
    """The common start and end of long names, which a table leaves out; empty where the names are short or there is only one."""

    start: str
    end: str

    def of(self, name: str) -> str:
        """Return a name with three dots in place of the common start and end."""
        return f"{'...' if self.start else ''}{self.middle(name)}{'...' if self.end else ''}"

    def middle(self, name: str) -> str:
        """Return what is between the common start and end of a name."""
        return name[len(self.start) : len(name) - len(self.end)]

    @property
    def says(self) -> str:
        """The meaning of the dots, in words; empty where there are none."""
        parts = [f"{verb} with `{part}`" for verb, part in (("begin", self.start), ("end", self.end)) if part]
        return f"the names of all runs {' and '.join(parts)}" if parts else ""


def short_names(names: Sequence[str]) -> ShortNames:
    """Return the common start and end of names, in complete words, where one of them is longer than LONGEST_NAME."""
    if len(set(names)) < 2 or max(map(len, names)) <= LONGEST_NAME:
        return ShortNames("", "")
    return shared_ends(names, partial(shared_start, boundary=_BOUNDARY_WITHOUT_POINT))


def shared_ends(names: Sequence[str], start_of: Callable[[Sequence[str]], str] = common_start) -> ShortNames:
    """Return the common start and end of names, each as `start_of` finds it from its side."""
    start = start_of(names)
    return ShortNames(start, start_of([name[len(start) :][::-1] for name in names])[::-1])


def _labels(name: str, paths: Sequence[Path]) -> Iterator[list[str]]:
    """Yield labels of files that share a name, from the shortest to the longest: with folders before it, and the suffix after."""
    deepest = max(len(p.parent.parts) for p in paths)
    folders = [["_".join([*p.parent.parts[1:][-k:], name] if k else [name]) for p in paths] for k in range(deepest)]
    yield from folders[1:]
    for of in folders:
        yield ["_".join([label, *p.suffixes[-1:]]).replace("_.", "_") for label, p in zip(of, paths, strict=True)]


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
