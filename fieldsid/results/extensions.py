"""What `sysid extend` and `sysid history` come to."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

from fieldsid.extension.extend import Extension, Gain
from fieldsid.extension.lineage import Generation, Parent
from fieldsid.models.axis import Axis
from fieldsid.records.keys import INLINE, Key, Number, Result
from fieldsid.results.result import OfLogs


@dataclass(frozen=True, slots=True)
class LeftOver:
    """What a model leaves, over the noise floor."""

    fitted: Annotated[Number, Key("On the runs it was fitted to.")]
    unseen: Annotated[Number, Key("On runs that were not fitted; null where there are none.")]
    more_than_noise: Annotated[bool, Key("Whether either is more than the sensors' noise.")]


@dataclass(frozen=True, slots=True, kw_only=True)
class Extended(OfLogs):
    """A model with an effect more."""

    SCHEMA = "fieldsid/extend/1"

    found: Annotated[Extension, INLINE]
    kept: Annotated[bool, Key("Whether the model was written: it pays, or `--keep`.")]
    kept_by: Annotated[str | None, Key("What it was kept for: `unseen`, `evidence` or `--keep`; null where it was not.")]
    model: Annotated[str, Key("The file that was written; the parent where nothing was kept.")]
    effects: Annotated[tuple[str, ...], Key("The effects in that model.")]
    parent: Annotated[Parent, Key("The model it was made from.")]
    left: Annotated[LeftOver, Key("What the model as it now is leaves.")]
    next: Annotated[str, Key("The command that goes on from there.")]


@dataclass(frozen=True, slots=True, kw_only=True)
class Undone(Result):
    """An extension taken back with `--undo`."""

    SCHEMA = "fieldsid/extend/1"

    gain: Annotated[Gain | None, Key(is_inline=True, is_optional=True)]
    kept: Annotated[Literal[False], Key("Always false.")] = False
    undone: Annotated[str, Key("The file that was taken back; it stays where it is.")]
    model: Annotated[str, Key("The parent.")]
    effects: Annotated[tuple[str, ...], Key("The parent's effects.")]
    parent: Annotated[Parent, Key("The parent.")]


@dataclass(frozen=True, slots=True)
class History(Result):
    """How a model came about."""

    SCHEMA = "fieldsid/history/1"

    model: Annotated[str, Key("Its file.")]
    axis: Annotated[Axis, Key("The plane.")]
    generations: Annotated[tuple[Generation, ...], Key("From the first model to this one.")]
    intact: Annotated[bool, Key("Whether every file of the line and its data are as they were.")]
    figure: Annotated[str | None, Key("The figure that was drawn.")]
