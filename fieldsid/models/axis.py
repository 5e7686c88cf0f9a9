"""The two axes and the names they use: yaw r' = -a22 r + b2 delta + C0, pitch q' = -c22 q - c23 theta + d2 delta + Cb."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum


class Axis(StrEnum):
    """The plane that is identified."""

    YAW = "yaw"
    PITCH = "pitch"


@dataclass(frozen=True, slots=True)
class AxisNames:
    """Canonical columns and parameter names of one axis; `stiffness` is None where the axis has none."""

    axis: Axis
    angle: str
    rate: str
    goal: str
    fin: str
    fin_measured: str
    cross: str
    other_angle: str
    other_rate: str
    damping: str
    stiffness: str | None
    authority: str
    trim: str
    trim_fin: str

    @property
    def base(self) -> tuple[str, ...]:
        """The names of the base parameters, in the order of every vector of them."""
        stiff = () if self.stiffness is None else (self.stiffness,)
        return (self.damping, *stiff, self.authority, self.trim)


NAMES = {
    Axis.YAW: AxisNames(
        Axis.YAW, "yaw_rad", "yaw_rate_rad_s", "yaw_goal_rad", "rudder_rad", "rudder_measured_rad", "sway_m_s",
        "pitch_rad", "pitch_rate_rad_s", "a22", None, "b2", "C0", "delta_r0",
    ),
    Axis.PITCH: AxisNames(
        Axis.PITCH, "pitch_rad", "pitch_rate_rad_s", "pitch_goal_rad", "elevator_rad", "elevator_measured_rad", "heave_m_s",
        "yaw_rad", "yaw_rate_rad_s", "c22", "c23", "d2", "Cb", "delta_s0",
    ),
}  # fmt: skip
