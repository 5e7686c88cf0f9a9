"""The JSON Schema of a record, from the types and keys that its class declares; see `fieldsid.records.keys`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import is_dataclass, replace
from enum import Enum
from inspect import cleandoc
from pathlib import Path
from types import UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from fieldsid.cli.headlines.headline import Headline
from fieldsid.records.keys import NULL, Key, Result, keys_of

HEADLINE = {"$ref": "#/$defs/Headline", "description": "The first lines of the same result as text."}
UNTOLD = ("fieldsid/live/1", "fieldsid/guide/1")
"""Objects that have no first lines: a look at an estimate under way, and a page."""
PLAIN = {float: "number", int: "integer", str: "string", Path: "string", bool: "boolean", type(None): "null", dict: "object"}


def schema_of_results(kinds: Sequence[type[Result]]) -> dict[str, Any]:
    """Return the schema of what a command prints: one of these objects."""
    defs: dict[str, Any] = {}
    made = [object_of(kind, defs) for kind in kinds]
    for kind, schema in zip(kinds, made, strict=True):
        if kind.SCHEMA not in UNTOLD:
            schema_of(Headline, defs)
            schema["properties"]["headline"] = HEADLINE
            schema["required"].append("headline")
    if len(made) == 1:
        return {"$defs": dict(sorted(defs.items())), **made[0]}
    own = {kind.__name__: schema for kind, schema in zip(kinds, made, strict=True)}
    return {"$defs": dict(sorted((defs | own).items())), "anyOf": [{"$ref": f"#/$defs/{name}"} for name in own]}


def object_of(kind: type, defs: dict[str, Any]) -> dict[str, Any]:
    """Return the schema of a class of records; those of the records in it go into `defs`."""
    properties: dict[str, Any] = {}
    optional: dict[str, bool] = {}
    if issubclass(kind, Result):
        says = f"Always `{kind.SCHEMA}`: the name and version of this object."
        properties["schema"] = {"const": kind.SCHEMA, "description": says, "type": "string"}
    for name, attribute, hint, key in _flat(kind):
        says = key.says or cleandoc(getattr(attribute, "__doc__", "") or "")
        properties[name] = {**schema_of(key.of or _there(hint, key), defs, NULL in hint.__metadata__), "description": says}
        optional[name] = key.is_optional
    required = [n for n in properties if not optional.get(n)]
    says = cleandoc(kind.__doc__ or "").partition("\n\n")[0].replace("\n", " ")
    return {"description": says, "properties": properties, "required": required, "type": "object"}


def schema_of(hint: Any, defs: dict[str, Any], may_be_null: bool = False) -> dict[str, Any]:  # noqa: PLR0911 - one return a type
    """Return the schema of a type."""
    if get_origin(hint) is Annotated:
        return schema_of(get_args(hint)[0], defs, may_be_null or NULL in hint.__metadata__)
    if may_be_null:
        return schema_of(hint | None, defs)
    origin, inner = get_origin(hint), get_args(hint)
    if origin in (Union, UnionType):
        either = [schema_of(t, defs) for t in inner]
        plain = all(set(e) == {"type"} for e in either)
        return {"type": [e["type"] for e in either]} if plain else {"anyOf": either}
    if origin is Literal or (isinstance(hint, type) and issubclass(hint, Enum)):
        words = list(inner) or [m.value for m in hint]
        of = {"type": PLAIN[type(words[0])]}
        return {"const": words[0], **of} if len(words) == 1 else {"enum": words, **of}
    if isinstance(origin, type) and issubclass(origin, Mapping):
        names = schema_of(inner[0], defs)
        keys = {"propertyNames": names} if "enum" in names else {}
        return {"type": "object", "additionalProperties": schema_of(inner[1], defs) or True, **keys}
    if isinstance(origin, type) and issubclass(origin, Sequence):
        count = len(inner) if origin is tuple and ... not in inner else None
        ends = {} if count is None else {"minItems": count, "maxItems": count}
        return {"type": "array", "items": schema_of(inner[0], defs), **ends}
    if is_dataclass(hint):
        if hint.__name__ not in defs:
            defs[hint.__name__] = {}
            defs[hint.__name__] = object_of(hint, defs)
        return {"$ref": f"#/$defs/{hint.__name__}"}
    return {} if hint is Any else {"type": PLAIN[hint]}


def _flat(kind: type) -> Iterator[tuple[str, Any, Any, Key]]:
    """Yield name, attribute of the class, type and key of all that an object has, those of records inline in it too."""
    for attribute, name, hint, key in keys_of(kind):
        if key.is_inline:
            (kind_inside,) = (t for t in get_args(get_args(hint)[0]) or get_args(hint)[:1] if t is not type(None))
            yield from ((n, a, h, replace(k, is_optional=k.is_optional or key.is_optional)) for n, a, h, k in _flat(kind_inside))
        else:
            yield name, getattr(kind, attribute, None), hint, key


def _there(hint: Any, key: Key) -> Any:
    """Return the type of a value where it is not left out: never None of one that is then."""
    plain = get_args(hint)[0]
    if not key.is_optional or get_origin(plain) not in (Union, UnionType):
        return hint
    return Union[tuple(t for t in get_args(plain) if t is not type(None))]  # noqa: UP007
