"""The vehicle as its vehicle.yaml describes it: fin limits and rate, sign conventions, signals, length, speeds."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from fieldsid.errors import VehicleError
from fieldsid.logs.run import SIGNALS
from fieldsid.registry import near
from fieldsid.strict import StrictModel, read_model, validated

SCHEMA = "fieldsid/vehicle/1"

Angle = Annotated[float, Field(gt=0.0, le=1.5708)]
Positive = Annotated[float, Field(gt=0.0)]


@dataclass(frozen=True, slots=True)
class Vehicle:
    """One vehicle: fin limits in rad, fin rate in rad/s, length in m, speeds in m/s; None where not stated.

    `positive_rudder` is the side a positive rudder turns to, `positive_elevator` where the nose goes under a
    positive elevator; None when not known. `signals` are the canonical names its logs hold.
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

    def fin_max_rad(self, axis: str) -> float | None:
        """Return the fin limit of an axis (`yaw` or `pitch`) in rad."""
        return self.rudder_max_rad if axis == "yaw" else self.elevator_max_rad

    @property
    def signal_limits(self) -> dict[str, float]:
        """The fin limits in rad by signal, without those that are not stated."""
        limits = {"rudder_rad": self.rudder_max_rad, "elevator_rad": self.elevator_max_rad}
        return {signal: limit for signal, limit in limits.items() if limit is not None}


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
    body = fields.model_dump(exclude={"schema_", "signals"})
    return Vehicle(**body, signals=tuple(fields.signals), source=source)
