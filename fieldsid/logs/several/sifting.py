"""The selection of the usable logs of several: one that cannot be used does not stop the others."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import TypeVar

from fieldsid.errors import DataError, EffectError, FieldsidError, LogError, MappingError, ModelError

T = TypeVar("T")
R = TypeVar("R")
Refused = Callable[[T, FieldsidError], None]
"""A function that is called with each item that cannot be used, and its error."""

OF_ONE_LOG = (LogError, MappingError, DataError, ModelError, EffectError)
"""Errors that concern one log; any other concerns the command and stops it."""


def attempt(work: Callable[[T], R], item: T) -> R | FieldsidError:
    """Return the result of `work` on one item, or the error that makes the item unusable."""
    try:
        return work(item)
    except OF_ONE_LOG as error:
        return error


def sifted(items: Sequence[T], made: Iterable[R | FieldsidError], refused: Refused[T] | None = None) -> list[tuple[T, R]]:
    """Return the usable items with the result of each; `made` holds a result or an error for each item, see `attempt`.

    `refused` is called with each other item and its error; without it the first error is raised. Raises DataError where none of
    several items is usable, and the item's own error where there is only one.
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
