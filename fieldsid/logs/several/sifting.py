"""Of several logs those that can be used: one that cannot never stops the others."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import TypeVar

from fieldsid.errors import DataError, EffectError, FieldsidError, LogError, MappingError, ModelError

T = TypeVar("T")
R = TypeVar("R")
Refused = Callable[[T, FieldsidError], None]
"""A function that is called with each item that cannot be used, and its error."""

OF_ONE_LOG = (LogError, MappingError, DataError, ModelError, EffectError)
"""Errors that lie in one log; any other lies in what was asked, and stops all."""


def attempt(work: Callable[[T], R], item: T) -> R | FieldsidError:
    """Return what some work makes of one item, or why that item cannot be used."""
    try:
        return work(item)
    except OF_ONE_LOG as error:
        return error


def sifted(items: Sequence[T], made: Iterable[R | FieldsidError], refused: Refused[T] | None = None) -> list[tuple[T, R]]:
    """Return the items that can be used with what was made of each, see `attempt`.

    refused is called with each other one; without it the first error is raised. Raises DataError where none of
    several is left, and the error itself where the only one cannot be used.
    """
    kept: list[tuple[T, R]] = []
    hints: set[str] = set()
    for item, outcome in zip(items, made, strict=True):
        if not isinstance(outcome, FieldsidError):
            kept.append((item, outcome))
        elif refused is None or len(items) == 1:
            raise outcome
        else:
            refused(item, outcome)
            hints.add(outcome.hint)
    if items and not kept:
        hint = hints.pop() if len(hints) == 1 else ""
        raise DataError("no log is left that can be used", found="each was skipped for the reason above", hint=hint)
    return kept
