"""The user's own effects: every YAML file in `effects/` of the folder a command is run in takes part in that command.

A model takes those it holds along: in another folder its own definitions are used, whatever is there by the same names.
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
    """Make the effects of the working folder known to this process, and no other's; one that cannot be used takes no part."""
    if "fieldsid.registry" in sys.modules:
        from fieldsid.registry import forget

        forget("fieldsid.effects")
    if not os.path.isdir(OWN_EFFECTS) or not _may_hold_effects():  # noqa: PTH112 - no import
        return
    from pathlib import Path

    from fieldsid.effects._user_folder import add_user_effects

    add_user_effects(Path(OWN_EFFECTS))


def read_model(path: Path) -> Model:
    """Return the model of a file whose effects are all known; raises ArtifactError, EffectError naming the file.

    Says on stderr where an effect of the model is another one than what is known here by its name.
    """
    from fieldsid.models.model import load_model

    model = load_model(path)
    check_effects([(path, model)])
    return model


def read_source(paths: Sequence[Path], laws: Sequence[str] = ()) -> ParameterSource:
    """Return the source of parameters that files give, the effects of its models all known; raises as `read_model` does."""
    from fieldsid.plant.parameter_source import load_parameter_source

    source = load_parameter_source(paths, laws=laws)
    check_effects(zip(source.paths, source.models, strict=False))  # a table has no models
    return source


def check_effects(models: Iterable[tuple[Path, Model]]) -> None:
    """Raise EffectError naming the file of a model whose effects are not all known; say which are another one than those here."""
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


def _may_hold_effects() -> bool:
    """Whether the folder has files that may be effects; one that cannot be looked into is asked again where its error is kept."""
    try:
        return any(n.endswith((".yaml", ".yml", ".py")) for n in os.listdir(OWN_EFFECTS))  # noqa: PTH208 - no import
    except OSError:
        return True
