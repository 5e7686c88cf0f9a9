"""Pilots of the six-degree-of-freedom vehicle: autopilot, open-loop programs, the zig-zag rule, a steady turn."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from truth.hull import STEADY, Hull
from truth.vehicle import QUIET, STOCK, Controller, Fins, Measured, fly_vehicle


@dataclass(slots=True)
class Autopilot:
    """PD control of heading, and of depth through pitch, with the signs of the REMUS.

    heading None: the rudder stays at its trim. depth None: the pitch is controlled to `pitch`.
    """

    heading: float | None = 0.0
    depth: float | None = 5.0
    pitch: float = 0.0
    kp: float = 0.8
    kd: float = 1.0
    trim_rudder: float = 0.0
    trim_elevator: float = 0.0
    pitch_kp: float = 1.0
    pitch_kd: float = 0.8
    depth_gain: float = 0.15
    largest_pitch: float = 0.35

    def __call__(self, _t: float, seen: Measured) -> tuple[float, float]:
        """Return rudder and elevator (rad) for one sample: positive rudder turns to port, positive elevator noses down."""
        wanted = self.pitch
        if self.depth is not None:
            wanted = float(np.clip(self.depth_gain * (seen.depth - self.depth), -self.largest_pitch, self.largest_pitch))
        elevator = self.trim_elevator + self.pitch_kp * (seen.pitch - wanted) + self.pitch_kd * seen.pitch_rate
        if self.heading is None:
            return self.trim_rudder, elevator
        rudder = self.trim_rudder + self.kp * (seen.yaw - self.heading) + self.kd * seen.yaw_rate
        return rudder, elevator


def excited(pilot: Autopilot, axis: str, times, fins, *, keep_course: bool = False) -> Controller:
    """Return a pilot who leaves one fin to an open-loop program: `fins` (n,) held constant from `times` (n,) on.

    The pilot steers where fins is NaN. keep_course: keep the heading at the end of the program, not the initial one.
    """
    times, fins = np.asarray(times), np.asarray(fins)

    def steer(t, seen):
        rudder, elevator = pilot(t, seen)
        i = int(np.searchsorted(times, t + 1e-9)) - 1
        program = fins[i] if i >= 0 else np.nan
        if np.isfinite(program):
            pilot.heading = seen.yaw if keep_course else pilot.heading
            return (float(program), elevator) if axis == "yaw" else (rudder, float(program))
        return rudder, elevator

    return steer


def zigzagging(pilot: Autopilot, axis: str, *, fin: float, angle: float, start: float = 2.0, end: float = 56.0) -> Controller:
    """Return a pilot who follows the zig-zag rule on one axis between two times.

    The fin is reversed when the heading (pitch) differs by `angle` from that at the start.
    """
    state = {"fin": -fin, "from": None}  # positive fin turns to negative angles on this vehicle

    def steer(t, seen):
        rudder, elevator = pilot(t, seen)
        if not start <= t < end:
            return rudder, elevator
        now = seen.yaw if axis == "yaw" else seen.pitch
        state["from"] = now if state["from"] is None else state["from"]
        if (now - state["from"]) * np.sign(state["fin"]) < -angle:
            state["fin"] = -state["fin"]
        return (state["fin"], elevator) if axis == "yaw" else (rudder, state["fin"])

    return steer


def steady_turn(rudder: float, *, speed: float = 1.54, hull: Hull = STEADY, fins: Fins = STOCK, settle: float = 90.0):
    """Return radius (m), speed (m/s), yaw rate (rad/s) and drift angle (rad) of the steady turn at constant rudder and depth."""
    level = Autopilot(heading=None, depth=5.0)

    def hold(t, seen):
        return (rudder, level(t, seen)[1])

    truth = fly_vehicle(hold, settle + 30.0, speed=speed, hull=hull, fins=fins, sensors=QUIET).truth
    late = truth["time_s"] > settle
    u, v, r = (float(np.mean(truth[name][late])) for name in ("surge_m_s", "sway_m_s", "yaw_rate_rad_s"))
    speed = float(np.hypot(u, v))
    return {"radius_m": speed / abs(r), "speed_m_s": speed, "rate_rad_s": r, "drift_rad": float(np.arctan2(v, u))}
