"""Figures by their names. It imports nothing heavy."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from typing import Any


def sketch(module: str, *of: Any, draw: str = "figure") -> Callable[[], Any]:
    """Return a function that draws a picture of a module of `fieldsid.figures`, which loads matplotlib when it is called."""

    def drawn() -> Any:
        picture = getattr(import_module(f"fieldsid.figures.{module}"), draw)(*of)
        return import_module("fieldsid.figures.drawn").rendered(picture)

    return drawn
