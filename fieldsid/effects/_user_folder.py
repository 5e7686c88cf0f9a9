"""The user's effects of a folder made known, and the effects that a model holds held against those that are known here."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path

from fieldsid.effects import add_effects, all_effects
from fieldsid.effects._user_file import load_user_effect, names_asked, user_effect_files
from fieldsid.errors import EffectError
from fieldsid.logs.run import Note
from fieldsid.models.definition import Definition
from fieldsid.models.effect import REGISTRY, Effect
from fieldsid.records.reading import yaml_mapping
from fieldsid.registry import refuse


def add_user_effects(folder: Path) -> None:
    """Make the effects of a folder's YAML files known by name for the rest of the process.

    A file that cannot be used takes no part, and neither of two that give one name: `registry.refused` tells why, and
    `pick_effect` raises it where such an effect is asked for.
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
                raise _named_alike(same)
            add_effects(same)
        except EffectError as error:
            refuse(REGISTRY, name, error)


def differences(own: Mapping[str, Definition]) -> tuple[Note, ...]:
    """Return what to say of a model's own effects that are known here by the same names, but as something else."""
    known = all_effects()
    return tuple(note for name, d in own.items() if name in known and (note := _difference(name, d, known[name])) is not None)


def _difference(name: str, definition: Definition, here: Effect) -> Note | None:
    """Return what to say of one: YAML is compared by what it says, code by its file's SHA-256."""
    there = here.definition
    if definition.is_code:
        if there is None or not there.is_code or there.sha256 == definition.sha256:
            return None
        said = f"effect `{name}` is code that has changed since the model was made: {here.origin} is used as it is now"
        return Note("effect_changed", said, {"effect": name, "here": here.origin, "model": definition.place})
    if there is not None and not there.is_code and _says(there) == _says(definition):
        return None
    said = f"effect `{name}` here ({here.origin}) is another one than the model's, of {definition.place}: the model's is used"
    return Note("effect_differs", said, {"effect": name, "here": here.origin, "model": definition.place})


def _says(definition: Definition) -> Mapping[str, object]:
    return yaml_mapping(definition.text, Path(definition.file))


def _read(path: Path) -> Effect | None:
    """Return the effect of a file, None where it cannot be used: why is kept by the names it may be asked for by."""
    try:
        return load_user_effect(path)
    except EffectError as error:
        for name in names_asked(path):
            refuse(REGISTRY, name, error)
        return None


def _named_alike(effects: Sequence[Effect]) -> EffectError:
    return EffectError(
        f"{len(effects)} files give an effect named {effects[0].name!r}",
        found=" and ".join(e.origin for e in effects),
        hint="rename all but one of them",
    )
