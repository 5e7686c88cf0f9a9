"""The view of a record without one of its own: its keys and values, as of one row of another record's table."""

from __future__ import annotations

from typing import Any

from fieldsid.display import Frames, View
from fieldsid.page import Page
from fieldsid.records.keys import body_of
from fieldsid.views._words import cell, fact_block, table


def line(row: Any) -> str:
    """Return all names and values."""
    return ", ".join(f"{name} {cell(value)}" for name, value in body_of(row).items())


def page(row: Any) -> Page:
    """Return all names and values, one below the other."""
    return Page(type(row).__name__, (), (fact_block("Values", body_of(row)),))


def frames(row: Any) -> Frames:
    """Return the record in one row."""
    return {"row": lambda: table([body_of(row)])}


VIEW = View("row", line, page, frames, line)
