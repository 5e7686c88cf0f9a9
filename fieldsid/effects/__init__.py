"""The catalogue of physical effects: one file per effect, found by the registry; a user's own are added by name."""

from __future__ import annotations

from collections.abc import Iterable

from fieldsid.errors import EffectError, UsageError
from fieldsid.models.axis import Axis
from fieldsid.models.effect import Effect
from fieldsid.registry import add, forget, members, near

PACKAGE = "fieldsid.effects"


def all_effects(axis: Axis | None = None) -> dict[str, Effect]:
    """Return every known effect by name, or those of one axis: built in, plug-ins (entry points), the user's own."""
    return {n: e for n, e in members(PACKAGE, "EFFECT").items() if axis is None or axis in e.axes}


def pick_effect(name: str) -> Effect:
    """Return one effect by name; raises UsageError naming the near matches."""
    known = all_effects()
    if name in known:
        return known[name]
    raise UsageError(
        f"there is no effect named {name!r}", found=", ".join(sorted(known)), hint=f"{near(name, known)} See `sysid effects list`"
    )


def add_effects(effects: Iterable[Effect]) -> None:
    """Make a user's own effects known by name for the rest of the process.

    Adding the same file again replaces it. Raises EffectError where the name is taken by another effect, or
    a coefficient's name on the same axis: a model keeps all coefficients in one table.
    """
    for effect in effects:
        _refuse_clash(effect)
        add(PACKAGE, effect)


def forget_effects() -> None:
    """Forget the user's own effects, so that only the built-in ones and the plug-ins are known."""
    forget(PACKAGE)


def _refuse_clash(effect: Effect) -> None:
    for other in all_effects().values():
        if other.name == effect.name and other.origin != effect.origin:
            raise EffectError(
                f"the name {effect.name!r} is taken", found=f"{other.origin} and {effect.origin}", hint="rename yours"
            )
        if other.name == effect.name or not set(other.axes) & set(effect.axes):
            continue
        taken = other.names & effect.names
        if taken:
            name = min(taken)
            raise EffectError(
                f"coefficient {name!r} of effect {effect.name!r} is a name of effect {other.name!r}",
                found=effect.origin,
                hint=f"call it `{effect.name}_{name}`",
            )
