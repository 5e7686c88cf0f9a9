"""Convert the world and body frames of logs to north-east-down (NED) and forward-starboard-down (FRD).

ROS logs are east-north-up and forward-left-up (REP 103). With E -> N, N -> E, U -> -D: yaw_ned = pi/2 - yaw_enu,
x and y change places, depth = -z. With left -> -starboard, up -> -down: pitch, pitch rate, yaw rate, sway and
heave change sign. Angles are the z-y-x sequence of Fossen (2011), section 2.2.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from fieldsid.numerics.arrays import FloatArray

World = Literal["NED", "ENU"]
Body = Literal["FRD", "FLU"]

TURNED_BY_BODY = frozenset({"pitch_rad", "pitch_goal_rad", "pitch_rate_rad_s", "yaw_rate_rad_s", "sway_m_s", "heave_m_s"})
"""Signals that change sign between forward-left-up and forward-starboard-down."""

LONGEST = 1e3
"""Largest norm, and inverse of the smallest, at which four numbers are taken for a quaternion that is not normalised."""

SWAPPED_BY_WORLD = {"x_m": "y_m", "y_m": "x_m"}
"""Signals that change places between east-north-up and north-east-down."""


@dataclass(frozen=True, slots=True)
class Frame:
    """The frames a log is written in: the world's axes and the body's."""

    world: World = "NED"
    body: Body = "FRD"


def heading_of_enu(yaw_rad: FloatArray) -> FloatArray:
    """Return the heading (n,) clockwise from north of an angle counterclockwise from east, or the reverse: pi/2 - angle."""
    return np.asarray(0.5 * math.pi - yaw_rad)


def to_ned_frd(signal: str, values: FloatArray, frame: Frame, *, is_height: bool = False) -> tuple[str, FloatArray]:
    """Return the name and values (n,) of one signal in NED and FRD.

    is_height: the number mapped to `depth_m` is a z coordinate, which points up in ENU.
    """
    if signal in TURNED_BY_BODY:
        return signal, -values if frame.body == "FLU" else values
    if frame.world == "NED":
        return signal, values
    if signal in ("yaw_rad", "yaw_goal_rad"):
        return signal, heading_of_enu(values)
    if signal == "depth_m" and is_height:
        return signal, -values
    return SWAPPED_BY_WORLD.get(signal, signal), values


def angles_of_quaternion(xyzw: FloatArray, frame: Frame) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return yaw, pitch and roll (n,) in rad, NED and FRD, of body-to-world quaternions (n, 4) in the log's frame.

    Quaternions are normalised first; one of zero norm (no estimate) or of an implausible norm gives NaN.
    """
    with np.errstate(over="ignore"):
        length = np.linalg.norm(xyzw, axis=1)
    usable = (length > 1.0 / LONGEST) & (length < LONGEST)
    x, y, z, w = (np.where(usable[:, None], xyzw, np.nan) / np.where(usable, length, 1.0)[:, None]).T
    forward = np.stack([1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)])
    side_z = 2 * (y * z + w * x)
    up_z = 1 - 2 * (x * x + y * y)
    if frame.world == "ENU":
        forward = np.stack([forward[1], forward[0], -forward[2]])
        side_z, up_z = -side_z, -up_z
    if frame.body == "FLU":
        side_z, up_z = -side_z, -up_z
    yaw = np.arctan2(forward[1], forward[0])
    pitch = np.arctan2(-forward[2], np.hypot(forward[0], forward[1]))
    return yaw, pitch, np.arctan2(side_z, up_z)


def unwrapped(angle_rad: FloatArray) -> FloatArray:
    """Return an angle (n,) without jumps of a turn; gaps stay NaN, and steps below half a turn are not changed."""
    seen = np.isfinite(angle_rad)
    result = np.array(angle_rad, dtype=np.float64)
    result[seen] = np.unwrap(result[seen])
    return result


def about_level(angle_rad: FloatArray) -> FloatArray:
    """Return a wrapped roll or pitch (n,), such as 359 deg for -1 or -179 next to 180, unwrapped and centred about level.

    An angle with values beyond a turn is not wrapped and is returned unchanged.
    """
    seen = np.isfinite(angle_rad)
    if not seen.any() or np.abs(angle_rad[seen]).max() > 2.0 * math.pi:
        return angle_rad
    result = unwrapped(angle_rad)
    return np.asarray(result - 2.0 * math.pi * np.round(np.median(result[seen]) / (2.0 * math.pi)))


EQUATOR_M = 6378137.0
ECCENTRICITY_2 = 6.69437999014e-3


def north_and_east(degrees: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return x and y (n,) in m from the first fix, of latitudes and longitudes (n, 2) in deg; NaN where there is no fix.

    Exactly zero and zero, or angles outside of the globe, are no fix. Uses the radii of curvature of WGS 84 at the first fix.
    """
    latitude, longitude = degrees.T
    bad = (np.abs(latitude) > 90.0) | (np.abs(longitude) > 360.0) | ((latitude == 0.0) & (longitude == 0.0))
    angles = np.radians(np.where(bad[:, None] | np.isnan(degrees), np.nan, degrees))
    seen = np.isfinite(angles).all(axis=1)
    if not seen.any():
        return np.full(len(degrees), np.nan), np.full(len(degrees), np.nan)
    start = angles[seen][0]
    flattened = 1.0 - ECCENTRICITY_2 * np.sin(start[0]) ** 2
    meridian = EQUATOR_M * (1.0 - ECCENTRICITY_2) / flattened**1.5
    parallel = EQUATOR_M / np.sqrt(flattened) * np.cos(start[0])
    east = np.remainder(angles[:, 1] - start[1] + np.pi, 2.0 * np.pi) - np.pi
    return meridian * (angles[:, 0] - start[0]), parallel * np.where(seen, east, np.nan)
