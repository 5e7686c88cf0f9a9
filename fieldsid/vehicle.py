"""The vehicle as its vehicle.yaml describes it: fins, their limits and rate, sign conventions, signals, length, speeds."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from fieldsid.errors import VehicleError
from fieldsid.logs.run import SIGNALS
from fieldsid.models.allocation import Fins
from fieldsid.registry import near
from fieldsid.strict import StrictModel, read_model, validated

SCHEMA = "fieldsid/vehicle/1"

Angle = Annotated[float, Field(gt=0.0, le=1.5708)]
Positive = Annotated[float, Field(gt=0.0)]
Finite = Annotated[float, Field(allow_inf_nan=False)]
Limit = Annotated[float, Field(gt=0.0, allow_inf_nan=False)]


@dataclass(frozen=True, slots=True)
class Vehicle:
    """One vehicle: fin limits in rad, fin rate in rad/s, length in m, speeds in m/s; None where not stated.

    `positive_rudder` is the side to which a positive rudder turns the vehicle, `positive_elevator` where a positive elevator
    moves the nose; None when not known. `signals` are the canonical names of the signals in its logs. `fins` describes a vehicle
    whose rudder or elevator is an allocation over several fins: the limits of rudder and elevator are then the largest angles
    that these fins can make, unless a smaller limit is stated.
    """

    name: str
    rudder_max_rad: float | None = None
    elevator_max_rad: float | None = None
    fin_rate_rad_s: float | None = None
    positive_rudder: Literal["port", "starboard"] | None = None
    positive_elevator: Literal["nose_down", "nose_up"] | None = None
    signals: tuple[str, ...] = ()
    length_m: float | None = None
    speed_min_m_s: float | None = None
    speed_max_m_s: float | None = None
    source: Path | None = None
    fins: Fins | None = None

    def fin_max_rad(self, axis: str) -> float | None:
        """Return the fin limit of an axis (`yaw` or `pitch`) in rad."""
        return self.rudder_max_rad if axis == "yaw" else self.elevator_max_rad

    @property
    def signal_limits(self) -> dict[str, float]:
        """The fin limits in rad by signal, without those that are not stated."""
        limits = {"rudder_rad": self.rudder_max_rad, "elevator_rad": self.elevator_max_rad}
        return {signal: limit for signal, limit in limits.items() if limit is not None}


class _Fins(StrictModel):
    """The key `fins` of vehicle.yaml."""

    names: Annotated[list[Annotated[str, Field(pattern=r"^[A-Za-z]\w*$")]], Field(min_length=1, max_length=64)]
    to_rudder: list[Finite] | None = None
    to_elevator: list[Finite] | None = None
    limits: Limit | list[Limit]
    unit: Annotated[str, Field(min_length=1)] = "rad"

    def fins(self) -> Fins:
        """Return the fins; a single limit holds for each of them."""
        limits = self.limits if isinstance(self.limits, list) else [self.limits] * len(self.names)
        return Fins(tuple(self.names), tuple(self.to_rudder or ()), tuple(self.to_elevator or ()), tuple(limits), self.unit)

    @model_validator(mode="after")
    def _are_fins(self) -> _Fins:
        inconsistency = self.fins().inconsistency()
        if inconsistency is not None:
            raise ValueError(inconsistency)
        return self


class _Fields(StrictModel):
    """The keys of vehicle.yaml."""

    schema_: Literal["fieldsid/vehicle/1"] = Field(default="fieldsid/vehicle/1", alias="schema")
    name: Annotated[str, Field(min_length=1)]
    rudder_max_rad: Angle | None = None
    elevator_max_rad: Angle | None = None
    fin_rate_rad_s: Positive | None = None
    positive_rudder: Literal["port", "starboard"] | None = None
    positive_elevator: Literal["nose_down", "nose_up"] | None = None
    signals: Annotated[list[str], Field(default_factory=list)]
    length_m: Positive | None = None
    speed_min_m_s: Annotated[float, Field(ge=0.0)] | None = None
    speed_max_m_s: Positive | None = None
    fins: _Fins | None = None

    @model_validator(mode="after")
    def _speeds_are_ordered(self) -> _Fields:
        low, high = self.speed_min_m_s, self.speed_max_m_s
        if low is not None and high is not None and low >= high:
            raise ValueError(f"speed_min_m_s {low:g} is not below speed_max_m_s {high:g}")
        return self


def load_vehicle(path: Path) -> Vehicle:
    """Read a vehicle.yaml.

    Raises ArtifactError when it cannot be read as YAML, VehicleError for an unknown key (with the near match),
    a wrong type or an impossible value.
    """
    return _vehicle(read_model(_Fields, path, error=VehicleError), f"`{path}`", path)


def vehicle_of(body: dict[str, Any], *, place: str = "the vehicle") -> Vehicle:
    """Return a vehicle from a mapping with the keys of vehicle.yaml; raises VehicleError."""
    return _vehicle(validated(_Fields, body, place=place, error=VehicleError), place, None)


def find_vehicle(folder: Path) -> Vehicle | None:
    """Return the vehicle of a trial folder, or None when it has no vehicle.yaml; raises VehicleError."""
    path = folder / "vehicle.yaml"
    return load_vehicle(path) if path.is_file() else None


def _vehicle(fields: _Fields, place: str, source: Path | None) -> Vehicle:
    unknown = [name for name in fields.signals if name not in SIGNALS]
    if unknown:
        raise VehicleError(
            f"{place}: `signals` names an unknown signal `{unknown[0]}`", found=unknown[0], hint=near(unknown[0], SIGNALS)
        )
    body = fields.model_dump(exclude={"schema_", "signals", "fins"})
    fins = None if fields.fins is None else fields.fins.fins()
    limits = {} if fins is None else _limits_of(fins, body, place)
    return Vehicle(**{**body, **limits}, signals=tuple(fields.signals), source=source, fins=fins)


def _limits_of(fins: Fins, body: Mapping[str, Any], place: str) -> dict[str, float]:
    """Return the limits of rudder and elevator not stated, as the fins reach them; raises VehicleError if more is stated."""
    limits = {}
    for key, axis in (("rudder_max_rad", "yaw"), ("elevator_max_rad", "pitch")):
        plane, stated = fins.of(axis), body[key]
        if plane is not None and stated is not None and not plane.follows(stated):
            raise VehicleError(
                f"{place}: `{key}` is more than the fins reach",
                found=f"{stated:g} rad, and {plane.reach:.4g} rad by `limits` of `fins`",
                hint=f"write `{key}: {math.floor(1e4 * plane.reach) / 1e4:g}`, or leave it out",
            )
        if plane is not None and stated is None:
            limits[key] = plane.reach
    return limits
