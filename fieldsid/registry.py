"""Registries that are folders: one file with one object of the right name is the whole registration."""

from __future__ import annotations

import difflib
import pkgutil
from collections.abc import Mapping
from functools import cache
from importlib import import_module
from importlib.metadata import entry_points
from types import MappingProxyType
from typing import Any

from fieldsid.errors import FieldsidError, UsageError

_added: dict[str, dict[str, Any]] = {}


def add(package: str, item: Any) -> None:
    """Make a member known by its name for the rest of the process; one added before under that name is replaced."""
    _added.setdefault(package, {})[item.name] = item


def forget(package: str) -> None:
    """Forget the members of a registry that were added in this process."""
    _added.pop(package, None)


def members(package: str, attribute: str) -> Mapping[str, Any]:
    """Return all members of a registry by name: the package's own, entry points', and those added with `add`."""
    return MappingProxyType({**_installed(package, attribute), **_added.get(package, {})})


@cache
def _installed(package: str, attribute: str) -> Mapping[str, Any]:
    """Return the objects named `attribute` of a package's modules, by name, then those of entry points.

    A module whose name starts with an underscore is a helper and is passed over. Entry points of the group
    named like the package add members from outside. Raises FieldsidError where a file's name and its
    object's name differ, or where two members share one name.
    """
    found: dict[str, Any] = {}
    for info in pkgutil.iter_modules(import_module(package).__path__):
        if info.name.startswith("_"):
            continue
        module = import_module(f"{package}.{info.name}")
        found[info.name] = _named(getattr(module, attribute, None), attribute, info.name)
    for point in entry_points(group=package):
        if point.name in found:
            raise FieldsidError(
                f"two members of `{package}` are named {point.name!r}",
                found=f"the second comes from `{point.value}`",
                hint="rename the entry point",
            )
        found[point.name] = _named(point.load(), attribute, point.name)
    return MappingProxyType(found)


def pick(package: str, attribute: str, name: str) -> Any:
    """Return one member by name; raises UsageError naming the near matches."""
    known = members(package, attribute)
    if name in known:
        return known[name]
    raise UsageError(
        f"there is no {attribute.lower()} named {name!r}",
        found=", ".join(sorted(known)),
        hint=near(name, known),
    )


def near(word: str, known: Mapping[str, Any] | list[str] | tuple[str, ...]) -> str:
    """Return a sentence naming what a mistyped word may have meant."""
    close = difflib.get_close_matches(word, list(known), n=3, cutoff=0.5)
    if not close:
        return f"choose one of: {', '.join(sorted(known))}"
    return "did you mean " + " or ".join(f"`{c}`" for c in close) + "?"


def _named(item: Any, attribute: str, name: str) -> Any:
    if item is None or getattr(item, "name", None) != name:
        raise FieldsidError(
            f"registry file {name!r} does not hold `{attribute}` with that name",
            found=f"{attribute} = {getattr(item, 'name', None)!r}",
            hint=f"define {attribute} = ...(name={name!r}, ...)",
        )
    return item
