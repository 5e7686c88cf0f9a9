"""The view of a record that is one row of another record's table: one line, and all fields as names and values."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

from fieldsid.display import Frames, View
from fieldsid.page import Page
from fieldsid.records.keys import body_of
from fieldsid.views._words import fact_block, table

R = TypeVar("R")


def row_view(name: str, line: Callable[[R], str]) -> View[R]:
    """Return the view of a row from the line that says what matters."""

    def page(row: R) -> Page:
        return Page(line(row), (), (fact_block("Values", body_of(row)),))

    def frames(row: R) -> Frames:
        return {"row": lambda: table([body_of(row)])}

    return View(name, line, page, frames, line)
