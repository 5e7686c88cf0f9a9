"""Registries that are folders: a member is registered by one file with one object of the right name."""

from __future__ import annotations

import difflib
import pkgutil
import re
import sys
import traceback
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib import import_module, metadata
from importlib.metadata import EntryPoint, entry_points
from types import MappingProxyType
from typing import Any

from fieldsid.errors import FieldsidError, UsageError

MIN_LIKENESS, MIN_OWN_LIKENESS = 0.5, 1.0 / 3.0
"""Least similarity (0 to 1) of a suggested name: of the full names, and of the names without their common last words."""
SUGGESTED = 3
"""Names that a hint offers at most."""

_added: dict[str, dict[str, Any]] = {}
_refused: dict[str, dict[str, FieldsidError]] = {}
"""The errors of members that could not be added in this process, by name."""
_unfit: dict[str, dict[str, FieldsidError]] = {}
"""The errors of entry points that could not be loaded, by name; kept until the process ends."""


@dataclass(frozen=True, slots=True)
class Outside:
    """The origin of an entry point: its value, the distribution with its version, the file; empty where not known."""

    value: str
    distribution: str
    file: str


def add(package: str, item: Any) -> None:
    """Register a member by its name for the rest of the process; an earlier one of that name is replaced."""
    _added.setdefault(package, {})[item.name] = item


def refuse(package: str, name: str, error: FieldsidError) -> None:
    """Record the error of a member that could not be added; `pick` raises it for that name."""
    _refused.setdefault(package, {})[name] = error


def refusal(package: str, name: str) -> FieldsidError | None:
    """Return the error of the member of a name, None where none of that name was refused or failed to load."""
    return _refused.get(package, {}).get(name) or _unfit.get(package, {}).get(name)


def refused() -> tuple[FieldsidError, ...]:
    """Return the errors of all registries read so far: of refused members, and of entry points that failed to load."""
    found = [error for why in (_refused, _unfit) for errors in why.values() for error in errors.values()]
    return tuple({id(error): error for error in found}.values())


def forget(package: str) -> None:
    """Forget the members of a registry that were added in this process, and those refused."""
    _added.pop(package, None)
    _refused.pop(package, None)


def members(package: str, attribute: str) -> Mapping[str, Any]:
    """Return all members of a registry by name: the package's own, entry points', and those added with `add`."""
    return MappingProxyType({**_installed(package, attribute), **_added.get(package, {})})


@cache
def _installed(package: str, attribute: str) -> Mapping[str, Any]:
    """Return the objects named `attribute` of a package's modules, by name, then those of entry points.

    Modules whose name starts with an underscore and subfolders are helpers and are skipped. Entry points of the group named like
    the package add members from outside; one that cannot be loaded, or whose name is taken, is left out: see `refused`. Raises
    FieldsidError where a file of the package and its object are named differently.
    """
    found: dict[str, Any] = {}
    for info in pkgutil.iter_modules(import_module(package).__path__):
        if info.ispkg or info.name.startswith("_"):
            continue
        module = import_module(f"{package}.{info.name}")
        found[info.name] = _checked_name(getattr(module, attribute, None), attribute, info.name)
    kind = type(next(iter(found.values()))) if found else object
    return MappingProxyType({**found, **_entry_point_members(package, attribute, kind, frozenset(found))})


def _entry_point_members(package: str, attribute: str, kind: type, taken: frozenset[str]) -> dict[str, Any]:
    """Return the members of entry points by name; record the errors of those that cannot be loaded."""
    unfit = _unfit[package] = {}
    found: dict[str, Any] = {}
    points = sorted(entry_points(group=package), key=lambda point: (point.name, point.value))
    count = Counter(point.name for point in points)
    for point in points:
        try:
            if point.name in taken or count[point.name] > 1:
                raise _taken_name(package, point, points)
            found[point.name] = _load_entry_point(point, attribute, kind)
        except FieldsidError as error:
            unfit.setdefault(point.name, error)
    return found


def _taken_name(package: str, point: EntryPoint, points: Sequence[EntryPoint]) -> FieldsidError:
    others = [other.value for other in points if other.name == point.name and other.value != point.value]
    return FieldsidError(
        f"the entry point `{point.name} = {point.value}`: the name {point.name!r} is taken in `{package}`",
        found=f"another one at {', '.join(f'`{o}`' for o in others) or f'`{package}.{point.name}`'}",
        hint="rename one of them, or uninstall its package",
    )


def _load_entry_point(point: EntryPoint, attribute: str, kind: type) -> Any:
    """Return the object of an entry point, with its origin recorded; raises FieldsidError for any error of its code."""
    place = f"the entry point `{point.name} = {point.value}`"
    try:
        item = _checked_name(point.load(), attribute, point.name)
    except FieldsidError as error:
        raise FieldsidError(f"{place}: {error.what}", found=error.found, hint=error.hint) from error
    except (Exception, SystemExit) as error:  # foreign code may raise anything
        raise FieldsidError(
            f"{place} cannot be loaded",
            found=f"{_place_of(error) or _distribution(point)}: {type(error).__name__}: {error}",
            hint=f"mend it, or uninstall {_distribution(point)}",
        ) from error
    if not isinstance(item, kind):
        raise FieldsidError(
            f"{place} leads to no {kind.__name__}",
            found=type(item).__name__,
            hint=f"let it lead to an object of `{kind.__module__}.{kind.__name__}`",
        )
    placed = getattr(item, "placed", None)
    file = getattr(sys.modules.get(point.module), "__file__", None) or ""
    return item if placed is None else placed(Outside(point.value, _distribution(point), file))


def _place_of(error: BaseException) -> str:
    """Return the file and line that an error comes from; empty where it comes from importing itself."""
    if isinstance(error, SyntaxError) and error.filename:
        return f"{error.filename}:{error.lineno}"
    last = traceback.extract_tb(error.__traceback__)[-1]
    return "" if last.filename.startswith("<") or last.filename == metadata.__file__ else f"{last.filename}:{last.lineno}"


def _distribution(point: EntryPoint) -> str:
    return "an unknown package" if point.dist is None else f"{point.dist.name} {point.dist.version}"


def pick(package: str, attribute: str, name: str) -> Any:
    """Return one member by name; raises UsageError naming near matches, or the error of the member of that name."""
    known = members(package, attribute)
    if name in known:
        return known[name]
    if (why := refusal(package, name)) is not None:
        raise why
    raise UsageError(
        f"there is no {attribute.lower()} named {name!r}",
        found=", ".join(sorted(known)),
        hint=near(name, known),
    )


def define(package: str, text: str, file: str) -> Any:
    """Return the member of a registry that a text defines, by the `define` of the package; `file` is its original path."""
    return import_module(package).define(text, file)


def near(word: str, known: Mapping[str, Any] | list[str] | tuple[str, ...]) -> str:
    """Return a sentence with the names that a mistyped word may have meant."""
    close = similar(word, known)
    if not close:
        return f"choose one of: {', '.join(sorted(known))}"
    return "did you mean " + " or ".join(f"`{c}`" for c in close) + "?"


def similar(word: str, known: Iterable[str]) -> list[str]:
    """Return the names that a mistyped word may have meant, the nearest first."""
    close = difflib.get_close_matches(word, list(known), n=SUGGESTED, cutoff=MIN_LIKENESS)
    return [name for name in close if _likeness_without_ending(word, name) >= MIN_OWN_LIKENESS]


def _likeness_without_ending(word: str, other: str) -> float:
    """Return the similarity (0 to 1) of two names without their common last words, such as a unit."""
    ours, theirs = (re.split(r"[^A-Za-z0-9]+", name) for name in (word, other))
    while min(len(ours), len(theirs)) > 1 and ours[-1] == theirs[-1]:
        ours.pop()
        theirs.pop()
    return difflib.SequenceMatcher(None, "_".join(ours), "_".join(theirs)).ratio()


def _checked_name(item: Any, attribute: str, name: str) -> Any:
    if item is None or getattr(item, "name", None) != name:
        raise FieldsidError(
            f"registry file {name!r} does not hold `{attribute}` with that name",
            found=f"{attribute} = {getattr(item, 'name', None)!r}",
            hint=f"define {attribute} = ...(name={name!r}, ...)",
        )
    return item
