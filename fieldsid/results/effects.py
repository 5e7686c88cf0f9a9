"""What `sysid effects` comes to."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from fieldsid.models.axis import Axis
from fieldsid.models.effect import Coefficient, Effect, with_variant
from fieldsid.records.keys import INLINE, Key, Result


@dataclass(frozen=True, slots=True)
class Form:
    """A shape of an effect that is not the textbook's."""

    says: Annotated[str, Key("What is different.")]
    axes: Annotated[tuple[Axis, ...], Key("The planes it is tried in.")]
    needs: Annotated[tuple[str, ...], Key("Signals the log must have.")]
    coefficients: Annotated[tuple[Coefficient, ...], Key("The numbers it takes besides.")]


@dataclass(frozen=True, slots=True)
class Described:
    """One physical effect."""

    effect: Annotated[Effect, INLINE]

    @property
    def forms(self) -> Annotated[tuple[Form, ...], Key()]:
        """Other shapes of it."""
        e = self.effect
        return tuple(
            Form(v.says, tuple(a for a in e.axes if a in v.axes), with_variant(e, v).needs, v.coefficients) for v in e.variants
        )


@dataclass(frozen=True, slots=True)
class Catalogue(Result):
    """The catalogue of effects."""

    SCHEMA = "fieldsid/effects/1"

    axis: Annotated[Axis | None, Key("The plane asked for; null for both.")]
    effects: Annotated[tuple[Described, ...], Key("Every effect.")]


@dataclass(frozen=True, slots=True)
class ShownEffect(Result):
    """One physical effect, as `sysid effects show` gives it."""

    SCHEMA = "fieldsid/effect/1"

    effect: Annotated[Described, INLINE]


@dataclass(frozen=True, slots=True)
class NewEffect(Result):
    """The file of an effect of one's own."""

    SCHEMA = "fieldsid/new-effect/1"

    name: Annotated[str, Key("Its name.")]
    axis: Annotated[Axis, Key("The plane it acts on.")]
    file: Annotated[str, Key("The file that was written.")]
