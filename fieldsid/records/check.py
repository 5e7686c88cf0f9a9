"""Check a record against a shape: a value of another type, sign, range or word is refused, with the path of its keys.

A shape is a mapping of keys to shapes (a key that ends in `?` may be missing), a list with one shape for all items, a tuple of
shapes for a list of that length, or a function that checks one value. Keys that a shape does not name are ignored.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from typing import Any

from fieldsid.errors import shortened

LARGEST = 1e9
"""Largest number accepted: none of a vehicle in SI is larger, and powers of larger ones would overflow."""
LARGEST_SPEED_M_S = 50.0
"""Largest speed accepted: a larger number is in another unit."""
LARGEST_FIN_RAD = 1.5708
"""Largest fin limit accepted: a fin across the flow."""

AXES = ("yaw", "pitch")
SIDES = ("port", "starboard")

Shape = Any
"""A mapping, list or tuple of shapes, or a function of a value and its place that raises ShapeError."""


class ShapeError(ValueError):
    """A value that does not have the shape required at its place in a record; the message has both."""


def check(value: object, shape: Shape, place: str = "") -> None:
    """Raise ShapeError where a value at a place of a record does not have the shape."""
    if isinstance(shape, Mapping):
        _refuse(not isinstance(value, Mapping), value, place, "keys with values")
        for name, inner in shape.items():
            _check_key(value, str(name), inner, place)
    elif isinstance(shape, list):
        for i, item in enumerate(_items(value, place)):
            check(item, shape[0], f"{place}[{i}]")
    elif isinstance(shape, tuple):
        items = _items(value, place)
        _refuse(len(items) != len(shape), value, place, f"a list of {len(shape)}")
        for i, (item, inner) in enumerate(zip(items, shape, strict=True)):
            check(item, inner, f"{place}[{i}]")
    else:
        shape(value, place)


def _check_key(value: Any, name: str, inner: Shape, place: str) -> None:
    key, is_optional = name.removesuffix("?"), name.endswith("?")
    if key in value:
        check(value[key], inner, _path(place, key))
    elif not is_optional:
        raise ShapeError(f"`{_path(place, key)}` is missing")


def _path(place: str, key: str) -> str:
    return f"{place}.{key}" if place else key


def _items(value: object, place: str) -> list[Any]:
    if not isinstance(value, list):
        raise _wrong(value, place, "a list")
    return value


def finite_number(value: object, name: str, low: float = -LARGEST, high: float = LARGEST) -> float:
    """Return a value of a record as a number; raises ShapeError where it is not a finite number within the bounds."""
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value):
        raise _wrong(value, name, "a finite number")
    if not low <= value <= high:
        bounds = f"at least {low:g}" if high == LARGEST and low > -LARGEST else f"within {low:g} .. {high:g}"
        raise ShapeError(f"`{name}` is {value:g}, and must be {bounds}: it is no such number of a vehicle")
    return float(value)


def number(low: float = -LARGEST, high: float = LARGEST) -> Shape:
    """Return the shape of a finite number within bounds."""
    return lambda value, place: finite_number(value, place, low, high)


def above_zero(high: float = LARGEST) -> Shape:
    """Return the shape of a finite number above zero."""

    def look(value: object, place: str) -> None:
        if finite_number(value, place, high=high) <= 0.0:
            raise ShapeError(f"`{place}` is {shortened(value)}, which is not above zero")

    return look


def maybe(shape: Shape) -> Shape:
    """Return the shape of a value that may also be null, as which a number that could not be computed is written."""
    return lambda value, place: None if value is None else check(value, shape, place)


def each(shape: Shape) -> Shape:
    """Return the shape of a mapping whose keys are any words, each value of one shape."""

    def look(value: object, place: str) -> None:
        _refuse(not isinstance(value, Mapping), value, place, "keys with values")
        for key, item in value.items():  # type: ignore[attr-defined]
            check(item, shape, _path(place, str(key)))

    return look


def at_least_one(shape: Shape) -> Shape:
    """Return the shape of a list of one shape that is not empty."""

    def look(value: object, place: str) -> None:
        check(value, [shape], place)
        _refuse(not value, value, place, "a list with anything in it")

    return look


def times(count: int, shape: Shape) -> Shape:
    """Return the shape of a list of `count` items of one shape."""
    return lambda value, place: check(value, (shape,) * count, place)


def one_of(words: Collection[str]) -> Shape:
    """Return the shape of a text that is one of the words."""
    wanted = f"one of {', '.join(words)}"
    return lambda value, place: _refuse(not isinstance(value, str) or value not in words, value, place, wanted)


def anything(_value: object, _place: str) -> None:
    """Accept any value, which is checked where it is read."""


def text(value: object, place: str) -> None:
    """Raise ShapeError where a value is no text."""
    _refuse(not isinstance(value, str), value, place, "text")


def whole_number(value: object, place: str) -> None:
    """Raise ShapeError where a value is not a whole number, or is negative."""
    _refuse(isinstance(value, bool) or not isinstance(value, int) or value < 0, value, place, "a whole number, 0 or more")


def flag(value: object, place: str) -> None:
    """Raise ShapeError where a value is neither true nor false."""
    _refuse(not isinstance(value, bool), value, place, "true or false")


def _refuse(is_wrong: bool, value: object, place: str, wanted: str) -> None:  # noqa: FBT001 - the condition itself
    if is_wrong:
        raise _wrong(value, place, wanted)


def _wrong(value: object, place: str, wanted: str) -> ShapeError:
    return ShapeError(f"`{place or 'the record'}` is {shortened(value)}, not {wanted}")


SOURCE: Shape = {"path": text, "sha256": text}
"""A file that a record was made from."""
HEAD: Shape = {"inputs?": maybe([SOURCE]), "mapping?": maybe(SOURCE), "parent?": maybe(SOURCE)}
"""The head of every record, in addition to its schema."""
ERRORS: Shape = {"angle_rms_rad": maybe(number(0.0)), "rate_rms_rad_s": maybe(number(0.0))}
"""The error of a free run; null where a channel was not measured."""
BOTH_SIDES: Shape = {"train": ERRORS, "validation": ERRORS}
FLOOR: Shape = {"angle_rad": maybe(number(0.0)), "rate_rad_s": maybe(number(0.0))}
"""The noise floor to which errors are compared."""
