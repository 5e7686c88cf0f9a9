"""A record that is one row of another's table: its own words in a line, all of its plain record as names and values."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, Protocol, TypeVar

from fieldsid.display import View
from fieldsid.page import Page
from fieldsid.views._words import fact_block, table

if TYPE_CHECKING:
    from pandas import DataFrame


class HasRecord(Protocol):
    """What a row can say of itself."""

    def record(self) -> dict[str, Any]:
        """Return the row by its fields' names with units."""


R = TypeVar("R", bound=HasRecord)


def row_view(name: str, line: Callable[[R], str]) -> View[R]:
    """Return the view of a row from the line that says what matters."""

    def page(row: R) -> Page:
        return Page(line(row), (), (fact_block("Values", row.record()),))

    def frames(row: R) -> Mapping[str, Callable[[], DataFrame]]:
        return {"row": lambda: table([row.record()])}

    return View(name, line, page, frames, line)
