"""The catalogue of physical effects: one file per effect, found by the registry; a user's own are added by name."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from fieldsid.effects._user_file import effect_of_definition
from fieldsid.errors import EffectError, UsageError
from fieldsid.models.axis import Axis
from fieldsid.models.effect import REGISTRY, Effect, effect_named, shared_name
from fieldsid.registry import add, forget, members


def all_effects(axis: Axis | None = None) -> dict[str, Effect]:
    """Return the known effects of an axis, or of both, by name: built in, of plug-ins (entry points), and the user's own."""
    return {n: e for n, e in members(REGISTRY, "EFFECT").items() if axis is None or axis in e.axes}


def pick_effect(name: str) -> Effect:
    """Return one effect by name; raises UsageError naming the near matches, EffectError where the file of that name is broken."""
    try:
        return effect_named(name)
    except UsageError as error:
        raise UsageError(error.what, found=error.found, hint=f"{error.hint} See `sysid effects list`") from error


def define(text: str, file: str) -> Effect:
    """Return the effect of a definition that a model keeps, see models/definition.py; raises EffectError."""
    return effect_of_definition(text, file)


def add_effects(effects: Iterable[Effect]) -> None:
    """Register a user's own effects by name for the rest of the process.

    Adding the same file again replaces its effect. Raises EffectError where another effect has the same name, or an effect of the
    same axis has a coefficient of the same name: a model keeps all coefficients in one table.
    """
    for effect in effects:
        refuse_clash(effect, all_effects().values())
        add(REGISTRY, effect)


def forget_effects() -> None:
    """Remove the user's own effects from the registry; the built-in ones and those of plug-ins stay."""
    forget(REGISTRY)


def refuse_clash(effect: Effect, others: Iterable[Effect]) -> None:
    """Raise EffectError where another effect has the same name, or one of the same axis a coefficient of the same name."""
    for other in others:
        if other.name == effect.name and other.origin != effect.origin:
            raise EffectError(
                f"`{effect.origin}`: the name {effect.name!r} is taken",
                found=f"{other.origin} and {effect.origin}",
                hint=f"rename yours; until then `{effect.name}` stands for the other one",
            )
        if name := shared_name(effect, other):
            raise EffectError(
                f"coefficient {name!r} of effect {effect.name!r} is a name of effect {other.name!r}",
                found=effect.origin,
                hint=f"call it `{effect.name}_{name}`",
            )


def apart_from(effects: Iterable[Effect], of_model: Sequence[Effect]) -> tuple[list[Effect], dict[str, str]]:
    """Return the effects that can be together in one model, in their order, and by name why each of the others cannot.

    An effect of the model replaces the one of the same name.
    """
    names, compatible, clashes = {e.name for e in of_model}, list(of_model), {}
    order = list(effects)
    for effect in order:
        taken = next(((other.name, name) for other in compatible if (name := shared_name(effect, other))), None)
        if taken:
            clashes[effect.name] = f"`{effect.name}` has a coefficient `{taken[1]}`, as effect `{taken[0]}` has"
        elif effect.name not in names:
            compatible.append(effect)
    places = {e.name: i for i, e in enumerate(order)}
    return sorted(compatible, key=lambda e: places.get(e.name, len(places))), clashes
