"""The safety envelope: limits of heading, track, depth, pitch, roll and fin, and the excursions of a flight."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from math import degrees
from typing import Annotated

import numpy as np

from fieldsid.angles import said
from fieldsid.errors import UsageError
from fieldsid.logs.convert.units import GRAVITY
from fieldsid.maneuvers import AMPLITUDE_HIGH, Limits
from fieldsid.models.axis import Axis
from fieldsid.numerics.arrays import ROUNDING_SHARE, BoolArray, FloatArray
from fieldsid.records.keys import Key, Number

LARGEST_FIN = AMPLITUDE_HIGH
LARGEST_SPEED = 15.0
MOST_TURNS = 4.0
"""Largest heading limit in full turns: a larger number was meant in degrees."""
LEAST_FIN = 0.01
"""Smallest fin limit, rad: the size of trims and of the play in a linkage."""
ACCEPTED_SHARE = 0.05
"""Default share of the draws of the prior that may leave the envelope."""
NOT_LIMITED = "NOT LIMITED"
_NO_LIMIT = ", or leave it out where there is no limit"
OPTIONS: Mapping[str, tuple[str, str, float, str]] = {
    "fin": ("--fin-max", "rad", LARGEST_FIN, "write `--fin-max 15deg`, or leave it out: the vehicle's own limit, else 0.26 rad"),
    "fin_rate": ("--fin-rate", "rad/s", np.inf, "write `--fin-rate 60deg`, or leave it out: the vehicle's own, else no limit"),
    "heading": (
        "--max-heading", "rad", MOST_TURNS * 2.0 * np.pi,
        "write `--max-heading 60deg`, or `--max-heading none` where there is no limit",
    ),
    "track": ("--max-track", "m", np.inf, f"write `--max-track 20`{_NO_LIMIT}"),
    "pitch": ("--max-pitch", "rad", np.pi / 2, "write `--max-pitch 30deg`, or `--max-pitch none` where there is no limit"),
    "roll": ("--max-roll", "rad", np.pi / 2, f"write `--max-roll 20deg`{_NO_LIMIT}"),
    "area_length": ("--area", "m long", np.inf, f"write `--area 200x60`{_NO_LIMIT}"),
    "area_width": ("--area", "m wide", np.inf, f"write `--area 200x60`{_NO_LIMIT}"),
    "share": ("--risk", "", 0.5, f"no maneuver is without risk: write `--risk 0.01`, or leave it out for {ACCEPTED_SHARE:g}"),
}  # fmt: skip
"""For each limit: the option, its unit, the largest accepted value, and the hint for a value that is refused."""
SET_BY = {"depth": "--depth-band", "along": "--area", "across": "--area"} | {
    name: option for name, (option, *_) in OPTIONS.items()
}
"""The option of `sysid plan` that sets the limit of an excursion."""


@dataclass(frozen=True, slots=True)
class Envelope:
    """Limits of a leg about straight and level; None for no limit.

    heading, pitch, roll (rad) and track (m) are largest deviations to either side; `depth_low` and `depth_high` (m) are the
    limits of the depth, with the leg in their middle; `area_length` (m) is along the leg from the start of its run-up,
    `area_width` (m) across it, half to either side. `fin` (rad) and `fin_rate` (rad/s) limit every command. `share` is the
    accepted probability of leaving any of them.
    """

    fin: Annotated[float, Key("Largest fin angle, that of its trim included, rad.")]
    fin_rate: Annotated[Number, Key("Fastest fin, rad/s.")] = np.inf
    heading: Annotated[float | None, Key("Largest deviation of heading, rad.")] = None
    track: Annotated[float | None, Key("Largest distance from the leg's line, m.")] = None
    depth_low: Annotated[float | None, Key("Shallowest, m.")] = None
    depth_high: Annotated[float | None, Key("Deepest, m.")] = None
    pitch: Annotated[float | None, Key("Largest pitch, rad.")] = None
    roll: Annotated[float | None, Key("Largest roll, rad.")] = None
    area_length: Annotated[float | None, Key("Room along the leg, m.")] = None
    area_width: Annotated[float | None, Key("Room across it, m.")] = None
    share: Annotated[float, Key("Accepted probability of leaving them.")] = ACCEPTED_SHARE

    def __post_init__(self) -> None:
        for name in OPTIONS:
            if (value := getattr(self, name)) is not None:
                _refuse_meaningless(name, value)
        if self.fin < LEAST_FIN:
            raise UsageError(
                f"a fin of {degrees(self.fin):.2g} deg at most turns no vehicle",
                found=f"--fin-max {self.fin:.3g} rad, least {degrees(LEAST_FIN):.2g} deg",
                hint=OPTIONS["fin"][-1],
            )
        low, high = self.depth_low, self.depth_high
        if low is not None and high is not None and not 0 <= low < high:
            raise UsageError(
                f"the depth band {low:g}..{high:g} m is empty or above the surface",
                found=f"{low:g}:{high:g}",
                hint="give shallowest and deepest in metres, for example `--depth-band 1:5`",
            )

    @property
    def limits(self) -> Limits:
        """The limits of every fin command."""
        return Limits(self.fin, self.fin_rate)

    def depth_room(self) -> float | None:
        """Return the largest deviation of the depth from the middle of its band, m."""
        if self.depth_low is None or self.depth_high is None:
            return None
        return 0.5 * (self.depth_high - self.depth_low)

    def excursion_limits(self) -> dict[str, float]:
        """Return the limits by the names of the excursions; those without a limit are left out."""
        limits = {
            "heading": self.heading, "track": self.track, "depth": self.depth_room(), "pitch": self.pitch,
            "roll": self.roll, "along": self.area_length,
            "across": None if self.area_width is None else 0.5 * self.area_width,
        }  # fmt: skip
        return {k: v for k, v in limits.items() if v is not None}

    def widening(self) -> str:
        """Return the hint to widen a limit, with the options of `sysid plan` that set one."""
        options = dict.fromkeys(f"`{SET_BY[name]}`" for name in self.excursion_limits())
        return f"widen {' or '.join(options)}" if options else "allow more fin: `--fin-max`"


@dataclass(frozen=True, slots=True)
class Excursion:
    """The excursions of one flight in rad and m, zero for quantities that the axis does not change.

    along is the largest distance ahead of the start of the run-up, behind that back of it, across that to a side.
    """

    heading: Annotated[float, Key("Deviation of heading, rad.")]
    track: Annotated[float, Key("Distance from the line, m.")]
    depth: Annotated[float, Key("Change of depth, m.")]
    pitch: Annotated[float, Key("Pitch, rad.")]
    roll: Annotated[float, Key("Roll, rad.")]
    along: Annotated[float, Key("Length needed, m.")]
    behind: Annotated[float, Key("Way beyond the end of the area, m.")]
    across: Annotated[float, Key("Width needed, m.")]


def track_of(axis: Axis, angle: FloatArray, speed: float, step: float) -> tuple[FloatArray, FloatArray]:
    """Return the distances along and across the leg (n, m) in m for angles (n, m) `step` s apart; across is depth for pitch.

    Both are zero at the first angle. The speed is assumed constant in the turn.
    """
    along, side = np.zeros(angle.shape), np.zeros(angle.shape)
    for way, part in ((along, np.cos(angle)), (side, np.sin(angle))):
        np.cumsum(0.5 * speed * step * (part[1:] + part[:-1]), axis=0, out=way[1:])
    return along, side if axis is Axis.YAW else -side


def excursions_of(
    axis: Axis, angle: FloatArray, rate: FloatArray, *, speed: float, step: float, run_up: float, roll_gain: FloatArray | float
) -> dict[str, FloatArray]:
    """Return the excursions of flights, (m,) each by the names of `Excursion`, from angles and rates (n, m) `step` s apart.

    run_up is the distance (m) flown before them. Roll is that of a neutrally buoyant hull in a steady turn, u r / g, times
    `roll_gain`: the centripetal force acts at the centre of mass, the hydrodynamic one at the axis of the hull.
    """
    along, side = track_of(axis, angle, speed, step)
    largest, off, fastest = (np.max(np.abs(part), axis=0) for part in (angle, side, rate))
    of_axis = (
        {"heading": largest, "track": off, "roll": roll_gain * speed * fastest / GRAVITY, "across": off}
        if axis is Axis.YAW
        else {"depth": off, "pitch": largest}
    )
    ahead, behind = run_up + np.max(along, axis=0), np.maximum(0.0, -run_up - np.min(along, axis=0))
    zeros = dict.fromkeys((f.name for f in fields(Excursion)), np.zeros_like(largest))
    return zeros | of_axis | {"along": ahead, "behind": behind}


def used(excursions: Mapping[str, FloatArray], envelope: Envelope) -> FloatArray:
    """Return the largest excursion of flights over its limit, (m,); above 1 also behind the start, where the area begins."""
    shares = [excursions[name] / limit for name, limit in envelope.excursion_limits().items()]
    if envelope.area_length is not None:
        behind = excursions["behind"]
        shares.append(np.where(behind > 0.0, 1.0 + behind / envelope.area_length, 0.0))
    return np.asarray(np.max([np.zeros_like(excursions["along"]), *shares], axis=0))


def outside(excursions: Mapping[str, FloatArray], envelope: Envelope) -> BoolArray:
    """Return a mask (m,) of the flights that leave the envelope; one that just reaches a limit does not."""
    return np.asarray(used(excursions, envelope) > 1.0 + ROUNDING_SHARE)


def check_speeds(speeds: tuple[float, ...], low: float | None, high: float | None) -> None:
    """Raise UsageError for speeds that are not positive, above LARGEST_SPEED, or outside the vehicle's range."""
    if not speeds:
        raise UsageError("no speeds are given", found="an empty list", hint="for example `--speeds 1.0,1.4,1.8`")
    for speed in speeds:
        if not (np.isfinite(speed) and 0 < speed <= LARGEST_SPEED):
            raise UsageError(
                f"a speed of {speed:g} m/s cannot be right",
                found=f"--speeds {','.join(f'{s:g}' for s in speeds)}",
                hint=f"give speeds in m/s, above 0 and at most {LARGEST_SPEED:g}",
            )
        if (low is not None and speed < low) or (high is not None and speed > high):
            raise UsageError(
                f"{speed:g} m/s is outside the vehicle's speeds",
                found=f"{'any' if low is None else f'{low:g}'} .. {'any' if high is None else f'{high:g}'} m/s in vehicle.yaml",
                hint="change `--speeds`, or `speed_min_m_s` and `speed_max_m_s` in vehicle.yaml",
            )


def check_room(envelope: Envelope, speeds: tuple[float, ...], run_up_s: float, shortest_s: float) -> None:
    """Raise UsageError when the area is too short for run-up and the shortest useful maneuver at some speed."""
    if envelope.area_length is None:
        return
    for speed in speeds:
        need = speed * (run_up_s + shortest_s)
        if need <= envelope.area_length:
            continue
        possible = np.floor(100.0 * envelope.area_length / (run_up_s + shortest_s)) / 100.0
        raise UsageError(
            f"the area is {envelope.area_length:g} m long; {speed:g} m/s needs {need:.0f} m "
            f"({speed * run_up_s:.0f} m of run-up, {speed * shortest_s:.0f} m of maneuver)",
            found=f"--area {envelope.area_length:g}x{envelope.area_width or 0:g}",
            hint=f"fly at most {possible:g} m/s there, or give `--area {np.ceil(need):.0f}x{envelope.area_width or 50:g}`",
        )


def _refuse_meaningless(name: str, value: float) -> None:
    """Raise UsageError for a limit that is not above zero or exceeds the largest accepted value."""
    option, unit, most, hint = OPTIONS[name]
    stated = f"{option} {value:.4g} {unit}".rstrip()
    if not value > 0.0:
        raise UsageError(f"`{option}` must be above zero", found=stated, hint=hint)
    if value > most:
        may_be_degrees = unit == "rad" and value > 2.0 * most and np.radians(value) <= most
        hint = f"write `{value:g}deg` if it is in degrees" if may_be_degrees else f"at most {most:.4g} {unit}".rstrip()
        raise UsageError(f"`{stated}` cannot be right", found=f"{name} = {value:g}, most {most:g}", hint=hint)


def limits_said(envelope: Envelope) -> dict[str, str]:
    """Return every limit in words, angles in deg and rad, NOT_LIMITED without one."""
    low, high, length, width = envelope.depth_low, envelope.depth_high, envelope.area_length, envelope.area_width
    fin_rate = envelope.fin_rate if np.isfinite(envelope.fin_rate) else None

    def angle(value: float | None, per: str = "") -> str:
        return NOT_LIMITED if value is None else f"{said(value)}{per}"

    return {
        "fin": angle(envelope.fin, ", trim included"),
        "fin rate": angle(fin_rate, " per s"),
        "heading": angle(envelope.heading),
        "track": NOT_LIMITED if envelope.track is None else f"{envelope.track:g} m to either side",
        "pitch": angle(envelope.pitch),
        "roll": angle(envelope.roll),
        "depth": NOT_LIMITED if low is None or high is None else f"{low:g} to {high:g} m",
        "area": NOT_LIMITED if length is None or width is None else f"{length:g} m along, {0.5 * width:g} m to either side",
    }
