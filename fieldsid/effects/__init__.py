"""The catalogue of physical effects: one file per effect, found by the registry; a user's own are added by name."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from fieldsid.effects._user_file import travelled
from fieldsid.errors import EffectError, UsageError
from fieldsid.models.axis import Axis
from fieldsid.models.effect import REGISTRY, Effect, effect_named, shared_name
from fieldsid.registry import add, forget, members


def all_effects(axis: Axis | None = None) -> dict[str, Effect]:
    """Return every known effect by name, or those of one axis: built in, plug-ins (entry points), the user's own."""
    return {n: e for n, e in members(REGISTRY, "EFFECT").items() if axis is None or axis in e.axes}


def pick_effect(name: str) -> Effect:
    """Return one effect by name; raises UsageError naming the near matches, EffectError where the file of that name is broken."""
    try:
        return effect_named(name)
    except UsageError as error:
        raise UsageError(error.what, found=error.found, hint=f"{error.hint} See `sysid effects list`") from error


def define(text: str, file: str) -> Effect:
    """Return the effect that a model's own definition gives, see `models.definition`; raises EffectError."""
    return travelled(text, file)


def add_effects(effects: Iterable[Effect]) -> None:
    """Make a user's own effects known by name for the rest of the process.

    Adding the same file again replaces it. Raises EffectError where the name is taken by another effect, or
    a coefficient's name on the same axis: a model keeps all coefficients in one table.
    """
    for effect in effects:
        refuse_clash(effect, all_effects().values())
        add(REGISTRY, effect)


def forget_effects() -> None:
    """Forget the user's own effects, so that only the built-in ones and the plug-ins are known."""
    forget(REGISTRY)


def refuse_clash(effect: Effect, others: Iterable[Effect]) -> None:
    """Raise EffectError where an effect has the name of another one, or a coefficient's name that keeps them out of one model."""
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


def apart_from(effects: Iterable[Effect], held: Sequence[Effect]) -> tuple[list[Effect], dict[str, str]]:
    """Return effects that can be in one model, those that it holds for their namesakes, and why each other one cannot."""
    own, kept, clashes = {e.name: e for e in held}, list(held), {}
    order = list(effects)
    for effect in order:
        taken = next(((other.name, name) for other in kept if (name := shared_name(effect, other))), None)
        if taken:
            clashes[effect.name] = f"`{effect.name}` has a coefficient `{taken[1]}`, as effect `{taken[0]}` has"
        elif effect.name not in own:
            kept.append(effect)
    places = {e.name: i for i, e in enumerate(order)}
    return sorted(kept, key=lambda e: places.get(e.name, len(places))), clashes
