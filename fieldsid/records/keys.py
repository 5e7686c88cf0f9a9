"""The keys of a record: a field or property with a `Key` in its annotation is a key of the record's JSON.

It is the only definition of a record's keys: its JSON object, the rows of its tables and the JSON Schema of the guide are derived
from it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, is_dataclass
from functools import cache
from typing import Annotated, Any, ClassVar, Literal, get_type_hints

NULL = "null"
Number = Annotated[float, NULL]
"""A number that may not be known, NaN, which JSON has as null."""
Words = Annotated[str, NULL]
"""A text that may be empty, which JSON has as null."""
Interval = tuple[Number, Number]
"""Lower and upper end."""
Side = Literal["port", "starboard"]


@dataclass(frozen=True, slots=True)
class Key:
    """The meaning of a key in a sentence (for a property its docstring), and its name in JSON where that is not the field's.

    `of` is its type in JSON where that is not the field's. `times` is a factor for JSON, as for a share that is given in per
    cent. `is_inline`: the keys of the record in this field are written in place of this key. `is_optional`: left out where None.
    """

    says: str = ""
    name: str = ""
    of: Any = None
    times: float | None = None
    is_inline: bool = False
    is_optional: bool = False


INLINE = Key(is_inline=True)


class Result:
    """The result of a command: its JSON begins with the name and version of the object, and ends with its first lines."""

    __slots__ = ()
    SCHEMA: ClassVar[str]


@cache
def keys_of(kind: type) -> tuple[tuple[str, str, Any, Key], ...]:
    """Return attribute, name in JSON, type and key of each entry in the JSON of a class of records, properties last."""
    found = [pair for base in reversed(kind.__mro__) for pair in _fields(base)]
    for name in dict.fromkeys(n for base in reversed(kind.__mro__) for n in vars(base)):
        member = getattr(kind, name)
        if isinstance(member, property) and "Key(" in str(member.fget.__annotations__.get("return")):
            found.append((name, get_type_hints(member.fget, include_extras=True)["return"]))
    return tuple(_keys(found))


def _fields(kind: type) -> Iterator[tuple[str, Any]]:
    """Yield the fields of a class that have a key, with their types; the types of other fields may not exist at run time."""
    own = {n: h for n, h in vars(kind).get("__annotations__", {}).items() if "Key(" in str(h) or "INLINE" in str(h)}
    alone = type(kind.__name__, (), {"__annotations__": own, "__module__": kind.__module__})
    yield from get_type_hints(alone, include_extras=True).items()


def _keys(found: list[tuple[str, Any]]) -> Iterator[tuple[str, str, Any, Key]]:
    for attribute, hint in found:
        for key in getattr(hint, "__metadata__", ()):
            if isinstance(key, Key):
                yield attribute, key.name or attribute, hint, key


def body_of(record: Any) -> dict[str, Any]:
    """Return the mapping that is a record's JSON, with all records in it as mappings too."""
    body: dict[str, Any] = {"schema": record.SCHEMA} if isinstance(record, Result) else {}
    for attribute, name, hint, key in keys_of(record.__class__):
        value = getattr(record, attribute)
        if key.is_optional and value is None:
            continue
        if key.is_inline:
            body |= body_of(value)
        elif NULL in hint.__metadata__ and value == "":
            body[name] = None
        else:
            body[name] = opened(value) if key.times is None else key.times * value
    return body


def opened(value: Any) -> Any:
    """Return a value with every record in it as a mapping; other values are returned unchanged."""
    if isinstance(value, Mapping):
        return {k: opened(v) for k, v in value.items()}
    if isinstance(value, (list, tuple)):
        return [opened(v) for v in value]
    return body_of(value) if has_keys(value) else value


def has_keys(value: Any) -> bool:
    """Whether a value is a record with keys."""
    return is_dataclass(value) and not isinstance(value, type) and bool(keys_of(value.__class__))
