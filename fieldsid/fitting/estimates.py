"""The estimates of a model: every parameter with its standard error, its 95 % interval and its unit."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf
from typing import Annotated

from fieldsid.dynamics.at_bound import bounds_of
from fieldsid.fitting.fin_offset import offset_of
from fieldsid.models.model import Model
from fieldsid.records.keys import Key, Number
from fieldsid.rounding import TWO_SIDED_95


@dataclass(frozen=True, slots=True)
class Estimate:
    """A parameter's value and standard error in its unit; the error is NaN where it was not estimated."""

    name: str
    value: Annotated[float, Key("The estimate, in the unit below.")]
    std_error: Annotated[Number, Key("Its standard error, corrected for coloured residuals.")]
    unit: Annotated[str, Key("Its unit.")]
    bounds: tuple[float, float] = (-inf, inf)

    @property
    def interval95(self) -> Annotated[tuple[float, float], Key()]:
        """The 95 % interval under a normal error: value -+ 1.96 standard errors, within the bounds of a coefficient."""
        half, (low, high) = TWO_SIDED_95 * self.std_error, self.bounds
        return self.value - min(half, self.value - low), self.value + min(half, high - self.value)


def estimates(model: Model) -> tuple[Estimate, ...]:
    """Return the estimates of a model at the reference speed of its law: parameters, those of the law, and the fin offset."""
    bounds, free = bounds_of(model), (-inf, inf)
    parameters = [
        Estimate(n, v, model.std_error(n), model.units.get(n, ""), bounds.get(n, free)) for n, v in model.values.items()
    ]
    law = [
        Estimate(n, _number(known["value"]), _number(known["std_error"]), "1/s^2" if "@" in n else "1")
        for n, known in dict(model.info.get("law_parameters", {})).items()
    ]
    offset = offset_of(model)
    return (*parameters, *law, Estimate(offset.name, offset.value, offset.std_error, "rad"))


def _number(value: float | None) -> float:
    """Return a number, NaN for None, which JSON has instead of NaN."""
    return float("nan") if value is None else value
