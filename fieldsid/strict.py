"""Validation of YAML records: an unknown key is refused with near matches, a wrong type with its place."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from types import UnionType
from typing import Any, TypeVar, Union, get_args, get_origin

from pydantic import BaseModel, ConfigDict, ValidationError

from fieldsid.errors import FieldsidError, shortened
from fieldsid.records.reading import read_yaml
from fieldsid.registry import near


class StrictModel(BaseModel):
    """Base of all hand-written files: frozen, without unknown keys, and without text in place of a number."""

    model_config = ConfigDict(frozen=True, strict=True, extra="forbid", arbitrary_types_allowed=True)


_PLAIN = frozenset({"int", "str", "float", "bool"})
_KEYS = frozenset({"extra_forbidden", "missing"})

M = TypeVar("M", bound=StrictModel)


def validated(model: type[M], body: Mapping[str, Any], *, place: str, error: type[FieldsidError]) -> M:
    """Return `body` as a `model`; raises `error` naming the place, the value and the near match or the type wanted."""
    try:
        return model.model_validate(dict(body))
    except ValidationError as failure:
        raise _explained(model, failure, place, error) from failure


def read_model(model: type[M], path: Path, *, error: type[FieldsidError]) -> M:
    """Read a YAML file as a `model`; raises ArtifactError for bad YAML and `error` for a body that does not fit."""
    body = read_yaml(path)
    wanted, schema = model.model_fields.get("schema_"), str(body.get("schema", ""))
    if wanted is not None and schema.startswith("fieldsid/") and schema != wanted.default:
        raise error(
            f"`{path}` is another kind of file", found=f"schema: {schema}", hint=f"give one with `schema: {wanted.default}`"
        )
    return validated(model, body, place=f"`{path}`", error=error)


def _explained(model: type[StrictModel], failure: ValidationError, place: str, error: type[FieldsidError]) -> FieldsidError:
    first = _most_telling(failure)
    *steps, last = first["loc"] or ("",)
    where = ".".join(
        [str(s) for s in steps if not _is_branch(s)] + ([str(last)] if first["type"] in _KEYS or not _is_branch(last) else [])
    )
    if first["type"] == "extra_forbidden":
        key = str(first["loc"][-1])
        return error(
            f"{place} has an unknown key `{where}`",
            found=f"{key}: {shortened(first['input'])}",
            hint=near(key, _known_keys(model, first["loc"][:-1])),
        )
    if first["type"] == "missing":
        return error(
            f"{place} lacks `{where}`",
            found="no such key",
            hint=f"add a line `{first['loc'][-1]}: ...`; `sysid init NAME` writes an example",
        )
    value = first["input"]
    return error(
        f"{place}: `{where or 'the file'}` is not valid: {_lower(first['msg'])}",
        found=f"{shortened(value)} ({type(value).__name__})",
        hint=f"correct `{where or 'the file'}`; `sysid init NAME` writes an example",
    )


def _most_telling(failure: ValidationError) -> Any:
    """Return the error to report: an unknown key if there is one, as it explains the other errors."""
    errors = failure.errors(include_url=False)
    return next((e for e in errors if e["type"] == "extra_forbidden"), errors[0])


def _is_branch(step: object) -> bool:
    """Whether a step of a location is pydantic's name of a union member, not a key of the file."""
    return isinstance(step, str) and (step in _PLAIN or "[" in step or step.startswith(("_", "constrained-")))


def _known_keys(model: type[StrictModel], steps: tuple[Any, ...]) -> list[str]:
    current: type[BaseModel] = model
    for step in steps:
        info = current.model_fields.get(str(step))
        inner = None if info is None else _model_in(info.annotation)
        current = inner or current
    return [field.alias or name for name, field in current.model_fields.items()]


def _model_in(annotation: Any) -> type[BaseModel] | None:
    """Return the first model class inside an annotation such as `dict[str, Source]` or `Frame | None`."""
    if isinstance(annotation, type) and get_origin(annotation) is None:
        return annotation if issubclass(annotation, BaseModel) else None
    if get_origin(annotation) in (Union, UnionType, dict, list, tuple, Mapping):
        return next((m for m in map(_model_in, get_args(annotation)) if m is not None), None)
    return None


def _lower(text: str) -> str:
    return (
        (text[:1].lower() + text[1:])
        .replace("a valid dictionary", "a mapping of `key: value` lines")
        .replace("a valid list", "a list")
    )
