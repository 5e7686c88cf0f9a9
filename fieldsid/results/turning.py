"""What `sysid fit` and `sysid turn-radius` come to."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from fieldsid.plant.laws.axis_laws import Laws
from fieldsid.records.keys import INLINE, Key, Result
from fieldsid.results.result import OfLogs
from fieldsid.turning.prediction import TurnPrediction


@dataclass(frozen=True, slots=True, kw_only=True)
class FittedLaws(Result):
    """Parameters against speed."""

    SCHEMA = "fieldsid/fit/1"

    laws: Annotated[Laws, INLINE]
    file: Annotated[str | None, Key("The file that was written.")] = None
    figure: Annotated[str | None, Key("The figure that was drawn.")] = None


@dataclass(frozen=True, slots=True, kw_only=True)
class TurnRadius(OfLogs):
    """The turning radius over speed."""

    SCHEMA = "fieldsid/turn-radius/1"

    prediction: Annotated[TurnPrediction, INLINE]
    figures: Annotated[tuple[str, ...], Key("The figures that were drawn.")] = ()
