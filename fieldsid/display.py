"""Display of records: one line in a console, all of it in a notebook, as tables and as figures.

A record inherits one of three classes: `Brief` (a short repr made of its fields), `Displayed` (one line, summary, HTML and pandas
tables) or `Plotted` (figures too). The classes contain no text, tables or drawings: when a method is called, it takes the view
named like the record's class from the registry `fieldsid.views`. The methods are thus written once, editors and mypy see them on
every record, the module of a record imports neither pandas nor matplotlib, and one new file gives a record a view. A decorator
would hide the methods from mypy; methods in each record would be repeated twenty times, and their figures would reverse the
direction of the imports.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any, Generic, TypeAlias, TypeVar

from fieldsid.errors import UsageError
from fieldsid.page import Page, cut, html_of, text_of
from fieldsid.registry import members, near

if TYPE_CHECKING:
    from pandas import DataFrame

T = TypeVar("T")
Frames: TypeAlias = "Mapping[str, Callable[[], DataFrame]]"
Figures: TypeAlias = Mapping[str, Callable[[], Any]]
"""The functions that make the tables and the figures of a record, by the names of its parts."""
LONGEST = 399
"""Most characters of a repr, so that a list of records stays readable."""
MOST_ITEMS, LONGEST_TEXT = 3, 60


def _no_figures(_record: Any) -> Figures:
    return {}


def _no_system(_record: Any, _speed: float | None) -> Any:
    raise UsageError("only a model and a schedule are linear systems")


def _cannot_read(_table: DataFrame, _name: str) -> Any:
    raise UsageError("only a run is read from a table")


@dataclass(frozen=True, slots=True)
class View(Generic[T]):
    """The view of the records of one class; `name` is that of the class in snake case, `turn_row` for TurnRow.

    `line` returns the main result in one line, `page` everything in words, with angles in the given unit or in rad. `frames` and
    `figures` return functions for tables and matplotlib figures by the name of a part; the first is the default. `label`
    distinguishes records of one class. `read` makes a record from a table, `system` python-control systems at a speed.
    """

    name: str
    line: Callable[[T], str]
    page: Callable[..., Page]
    frames: Callable[[T], Frames]
    label: Callable[[T], str] = str
    figures: Callable[[T], Figures] = _no_figures
    read: Callable[[DataFrame, str], T] = _cannot_read
    system: Callable[[T, float | None], Any] = _no_system


def view_of(kind: type) -> View[Any]:
    """Return the view of a class of records; where it has none of its own, that of a row of a table."""
    views: Mapping[str, View[Any]] = members("fieldsid.views", "VIEW")
    return views.get(re.sub(r"(?<=[a-z])(?=[A-Z])", "_", kind.__name__).lower(), views["row"])


def page_of(record: Any, *more: Any) -> Page:
    """Return the page of a record; `more` are further arguments of its view, the unit of angles first."""
    return view_of(type(record)).page(record, *more)


def line_of(record: Any) -> str:
    """Return the main result of a record in one line."""
    return view_of(type(record)).line(record)


class Brief:
    """A record with a short repr: arrays are shown by their shape, long fields by their beginning."""

    __slots__ = ()

    def __repr__(self) -> str:
        shown = (f"{f.name}={_short(getattr(self, f.name))}" for f in fields(self) if f.repr)  # type: ignore[arg-type]
        return cut(f"{type(self).__name__}({', '.join(shown)})", LONGEST)


class Displayed(Brief):
    """A record with its main result in one line, and all of it as a summary, as HTML and as pandas tables."""

    __slots__ = ()

    def __repr__(self) -> str:
        return cut(f"<{type(self).__name__} {line_of(self)}>", LONGEST)

    def summary(self) -> str:
        """Return the whole record as text in fixed blocks: warnings first, then statistics, then its tables."""
        return text_of(page_of(self))

    def _repr_html_(self) -> str:
        return html_of(page_of(self))

    def to_frame(self, part: str = "") -> DataFrame:
        """Return a part of the record as a pandas table, without a name its first; raises UsageError naming the parts."""
        table: DataFrame = _part(view_of(type(self)).frames(self), part, f"{type(self).__name__}.to_frame")
        return table


class InControl:
    """A record that is a linear system at each speed."""

    __slots__ = ()

    def to_control(self, speed: float | None = None) -> Any:
        """Return python-control's StateSpace at a speed (m/s), its signals named as a run's columns.

        A model is fin to angle and rate, without a speed at its law's own; a schedule reference, angle and rate to fin, without
        a speed a mapping of the rows' by speed. `control.interconnect` of both is the closed loop. Raises FieldsidError where
        python-control is not installed.
        """
        return view_of(type(self)).system(self, speed)


class Plotted(Displayed):
    """A record that has figures."""

    __slots__ = ()

    def plot(self, part: str = "") -> Any:
        """Return a matplotlib Figure of the record, of several the one of that name; raises UsageError naming them."""
        return _part(view_of(type(self)).figures(self), part, f"{type(self).__name__}.plot")


def _part(parts: Mapping[str, Callable[[], Any]], name: str, of: str) -> Any:
    chosen = parts.get(name or next(iter(parts)))
    if chosen is None:
        raise UsageError(f"`{of}` has no part {name!r}", found=", ".join(parts), hint=near(name, list(parts)))
    return chosen()


def _short(value: Any) -> str:
    """Return one field's value in a few words."""
    if isinstance(value, float):
        return f"{value:.4g}"
    if hasattr(value, "shape") and hasattr(value, "dtype"):
        return f"{value.dtype}{list(value.shape)}"
    if isinstance(value, (str, Path)):
        return repr(cut(str(value), LONGEST_TEXT))
    if isinstance(value, Mapping):
        return f"{{{_few([f'{cut(str(k), LONGEST_TEXT)}: {_short(v)}' for k, v in value.items()])}}}"
    if isinstance(value, (tuple, list)):
        return f"({_few([_short(v) for v in value[: MOST_ITEMS + 1]], len(value))}{',' if len(value) == 1 else ''})"
    return cut(repr(value), LONGEST_TEXT) if isinstance(value, Brief) else repr(value)


def _few(shown: list[str], count: int | None = None) -> str:
    """Return the first of some words and how many more there are."""
    more = (len(shown) if count is None else count) - MOST_ITEMS
    return ", ".join([*shown[:MOST_ITEMS], *([f"... {more} more"] if more > 0 else [])])
