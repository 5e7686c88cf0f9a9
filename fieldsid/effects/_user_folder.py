"""Registration of the user's effects in a folder, and comparison of a model's definitions with the effects registered here."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path

from fieldsid.effects import add_effects, all_effects
from fieldsid.effects._user_file import load_user_effect, possible_names, user_effect_files
from fieldsid.errors import EffectError
from fieldsid.logs.run import Note
from fieldsid.models.definition import Definition
from fieldsid.models.effect import REGISTRY, Effect
from fieldsid.records.reading import yaml_mapping
from fieldsid.registry import refuse


def add_user_effects(folder: Path) -> None:
    """Register the effects of a folder's YAML files by name for the rest of the process.

    A file that cannot be used is left out, and so are files that define effects of the same name: `registry.refused` says why,
    and `pick_effect` raises that error for such an effect.
    """
    try:
        read = {path: _read(path) for path in user_effect_files(folder)}
    except EffectError as error:
        refuse(REGISTRY, folder.name, error)
        return
    effects = [e for e in read.values() if e is not None]
    for name, count in Counter(e.name for e in effects).items():
        same = [e for e in effects if e.name == name]
        try:
            if count > 1:
                raise _same_name_error(same)
            add_effects(same)
        except EffectError as error:
            refuse(REGISTRY, name, error)


def differences(own: Mapping[str, Definition]) -> tuple[Note, ...]:
    """Return a note for each definition of a model that differs from the effect registered here under the same name."""
    known = all_effects()
    return tuple(note for name, d in own.items() if name in known and (note := _difference(name, d, known[name])) is not None)


def _difference(name: str, definition: Definition, here: Effect) -> Note | None:
    """Return the note for one effect, None where it does not differ: YAML is compared by content, code by the file's SHA-256."""
    registered = here.definition
    if definition.is_code:
        if registered is None or not registered.is_code or registered.sha256 == definition.sha256:
            return None
        message = f"effect `{name}` is code that has changed since the model was made: {here.origin} is used as it is now"
        return Note("effect_changed", message, {"effect": name, "here": here.origin, "model": definition.place})
    if registered is not None and not registered.is_code and _content(registered) == _content(definition):
        return None
    message = f"effect `{name}` here ({here.origin}) is another one than the model's, of {definition.place}: the model's is used"
    return Note("effect_differs", message, {"effect": name, "here": here.origin, "model": definition.place})


def _content(definition: Definition) -> Mapping[str, object]:
    return yaml_mapping(definition.text, Path(definition.file))


def _read(path: Path) -> Effect | None:
    """Return the effect of a file, None where it cannot be used: the registry keeps the error under its possible names."""
    try:
        return load_user_effect(path)
    except EffectError as error:
        for name in possible_names(path):
            refuse(REGISTRY, name, error)
        return None


def _same_name_error(effects: Sequence[Effect]) -> EffectError:
    return EffectError(
        f"{len(effects)} files give an effect named {effects[0].name!r}",
        found=" and ".join(e.origin for e in effects),
        hint="rename all but one of them",
    )
