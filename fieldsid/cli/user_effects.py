"""The user's own effects: a command knows every effect that is defined in `effects/` of the folder it is run in.

A model file contains the definitions of its user effects: in another folder they are used, and not those of the same name there.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pathlib import Path

    from fieldsid.models.model import Model
    from fieldsid.plant.parameter_source import ParameterSource

OWN_EFFECTS = "effects"


def load_own_effects() -> None:
    """Register the effects of the working folder, and forget those of another; one that cannot be used is left out."""
    if "fieldsid.registry" in sys.modules:
        from fieldsid.registry import forget

        forget("fieldsid.effects")
    if not os.path.isdir(OWN_EFFECTS) or not _may_contain_effects():  # noqa: PTH112 - no import
        return
    from pathlib import Path

    from fieldsid.effects._user_folder import add_user_effects

    add_user_effects(Path(OWN_EFFECTS))


def read_model(path: Path) -> Model:
    """Return the model of a file; raises ArtifactError, and EffectError naming the file where an effect of it is not known.

    Warns on stderr where the model's definition of an effect differs from that of the same name here.
    """
    from fieldsid.models.model import load_model

    model = load_model(path)
    check_effects([(path, model)])
    return model


def read_source(paths: Sequence[Path], laws: Sequence[str] = ()) -> ParameterSource:
    """Return the source of parameters that files give; raises and warns as `read_model` does for the effects of its models."""
    from fieldsid.plant.parameter_source import load_parameter_source

    source = load_parameter_source(paths, laws=laws)
    check_effects(zip(source.paths, source.models, strict=False))  # a table has no models
    return source


def check_effects(models: Iterable[tuple[Path, Model]]) -> None:
    """Raise EffectError naming the file of a model with an unknown effect; warn of effects that are defined otherwise here."""
    from fieldsid.cli.console import warn
    from fieldsid.dynamics.free_run import effects_of
    from fieldsid.errors import EffectError

    for path, model in models:
        if not model.effects:
            continue
        try:
            effects_of(model)
        except EffectError as error:
            raise EffectError(f"`{path}`: {error.what}", found=error.found, hint=error.hint) from error
        if model.own:
            from fieldsid.effects._user_folder import differences

            warn(differences(model.own), of=str(path))


def _may_contain_effects() -> bool:
    """Whether the folder has files that may define effects; True where it cannot be listed: reading it reports the error."""
    try:
        return any(n.endswith((".yaml", ".yml", ".py")) for n in os.listdir(OWN_EFFECTS))  # noqa: PTH208 - no import
    except OSError:
        return True
