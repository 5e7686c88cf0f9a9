"""What `sysid diagnose` comes to."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from fieldsid.diagnosis.records import Diagnosis
from fieldsid.extension.extend import Gain
from fieldsid.records.keys import INLINE, Key
from fieldsid.results.result import OfLogs


@dataclass(frozen=True, slots=True)
class Applied:
    """One of the named effects added with `--apply`."""

    gain: Annotated[Gain, INLINE]
    effect: Annotated[str, Key("The effect.")]
    model: Annotated[str, Key("The file of the model with it.")]
    pays: Annotated[bool, Key("Whether the error on unseen runs falls by it.")]


@dataclass(frozen=True, slots=True, kw_only=True)
class Diagnosed(OfLogs):
    """Which physical effect the model lacks."""

    SCHEMA = "fieldsid/diagnose/1"

    found: Annotated[Diagnosis, INLINE]
    runs: Annotated[tuple[str, ...], Key("Runs that were fitted.")]
    validation_runs: Annotated[tuple[str, ...], Key("Runs it was judged by.")]
    model: Annotated[str | None, Key("The model given with `--model`.")]
    applied: Annotated[tuple[Applied, ...], Key("With `--apply`: the named effects, added one at a time.")] = ()
    known: Annotated[tuple[str, ...], Key("Its effects, which are part of the base.")]
    file: Annotated[str | None, Key("The file that was written.")] = None
    figure: Annotated[str | None, Key("The figure that was drawn.")] = None
