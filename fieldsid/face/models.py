"""Models from what a user passes: files, patterns, models, and records that contain one."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from os import PathLike
from typing import TYPE_CHECKING, Any, TypeAlias

from fieldsid.errors import UsageError
from fieldsid.face.runs import files_of
from fieldsid.models.model import Model, load_model

if TYPE_CHECKING:
    from fieldsid.diagnosis import Diagnosis
    from fieldsid.extension.extend import Extension
    from fieldsid.fitting.fit import Fit
    from fieldsid.plant.laws.axis_laws import Laws
    from fieldsid.plant.parameter_source import ParameterSource

OneModel: TypeAlias = "Model | Fit | Extension | Diagnosis | str | PathLike[str]"
AnyModel: TypeAlias = "OneModel | Sequence[Model] | Sequence[Fit]"
Models: TypeAlias = "OneModel | Laws | ParameterSource | Iterable[OneModel]"


def model_of(given: AnyModel) -> Model:
    """Return the model of a file, a record or a sequence of one; raises UsageError for several, ArtifactError for a bad file."""
    models = list(_models(given))
    if len(models) == 1:
        return models[0]
    found = f"{len(models)} models"
    raise UsageError("this takes one model", found=found, hint="take one of them, `[0]`, or fit the runs together, `joint=True`")


def source_of(given: Models, law: str | Sequence[str] = ()) -> ParameterSource:
    """Return the source of parameters over speed that models, a table of parameters, a fit file or laws give.

    law: the user's laws, `NAME=c0[,c1]`, as with `--law`. Raises UsageError, DataError and ArtifactError.
    """
    from fieldsid.plant.laws.axis_laws import Laws
    from fieldsid.plant.parameter_source import ParameterSource, load_parameter_source, source_of_laws, source_of_models

    user_laws = (law,) if isinstance(law, str) else tuple(law)
    if isinstance(given, ParameterSource):
        return given
    items = [given] if isinstance(given, (str, PathLike, Model)) or not isinstance(given, Iterable) else list(given)
    if len(items) == 1 and isinstance(items[0], Laws):
        return source_of_laws(items[0], laws=user_laws)
    named = [item for item in items if isinstance(item, (str, PathLike))]
    if len(named) == len(items):
        return load_parameter_source([path for item in named for path in files_of(item, "model")], laws=user_laws)
    models = [model for item in items for model in _models(item)]
    return source_of_models(models, [_name(m, i) for i, m in enumerate(models)], laws=user_laws)


def _models(given: Any) -> Iterator[Model]:
    if isinstance(given, (str, PathLike)):
        yield from (load_model(path) for path in files_of(given, "model"))
    elif isinstance(given, Model):
        yield given
    elif isinstance(model := getattr(given, "model", None), Model):
        yield model
    elif isinstance(given, Iterable):
        for item in given:
            yield from _models(item)
    else:
        raise UsageError("that is no model", found=type(given).__name__, hint="give a model, a fit, or the file of a model")


def _name(model: Model, index: int) -> str:
    return "+".join(model.runs) or f"model {index + 1}"
