"""What a name in somebody's log probably means: words of columns, topics and fields to canonical signals."""

from __future__ import annotations

import re
from collections.abc import Mapping
from types import MappingProxyType

from fieldsid.logs.names import TIME, canonical

COMMANDED = frozenset({"cmd", "command", "commanded", "setpoint", "sp", "desired", "target", "reference", "ref", "demand"})
MEASURED = frozenset({"measured", "meas", "feedback", "fb", "actual", "state", "states", "encoder", "position"})

PHRASES: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        TIME: ("time", "timestamp", "stamp", "utc", "seconds", "datetime", "epoch"),
        "yaw_rate_rad_s": (
            "yaw rate",
            "yawrate",
            "heading rate",
            "turn rate",
            "rate turn",
            "gyro z",
            "gz",
            "omega z",
            "wz",
            "psidot",
        ),
        "pitch_rate_rad_s": ("pitch rate", "pitchrate", "gyro y", "gy", "omega y", "wy", "thetadot"),
        "roll_rate_rad_s": ("roll rate", "rollrate", "gyro x", "gx", "omega x", "wx", "phidot"),
        "yaw_rad": ("yaw", "heading", "hdg", "psi", "compass"),
        "pitch_rad": ("pitch", "theta"),
        "roll_rad": ("roll", "phi"),
        "depth_m": ("depth",),
        "surge_m_s": ("surge", "speed", "velocity x", "vel x", "vx", "stw"),
        "sway_m_s": ("sway", "velocity y", "vel y", "vy"),
        "heave_m_s": ("heave", "velocity z", "vel z", "vz"),
        "x_m": ("north", "northing", "pos x", "position x"),
        "y_m": ("east", "easting", "pos y", "position y"),
        "rudder_rad": ("rudder", "rud", "delta r", "deltar"),
        "elevator_rad": ("elevator", "elev", "stern plane", "sternplane", "sternplanes", "delta s", "deltas", "delta e"),
        "thrust": ("thrust", "thruster"),
        "propeller_rpm": ("rpm", "propeller", "prop"),
    }
)
"""Words, all of which a name must hold, for each signal; more words weigh more."""

LETTERS: Mapping[str, str] = MappingProxyType(
    {"t": TIME, "r": "yaw_rate_rad_s", "q": "pitch_rate_rad_s", "p": "roll_rate_rad_s", "u": "surge_m_s", "v": "sway_m_s",
     "w": "heave_m_s", "x": "x_m", "y": "y_m", "z": "depth_m", "n": "propeller_rpm"}
)  # fmt: skip
"""The field's symbols, believed only when a name is nothing else."""

_UNIT = re.compile(r"[\[(][^\])]*[\])]")
_SUFFIX = re.compile(r"_(rad|deg|rad_s|deg_s|m_s|m|s|ms|us|ns|kn|ft|rpm|km_h|dps)$")
_WORD = re.compile(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])|\d+")
_FINS = {"rudder_rad": "rudder_measured_rad", "elevator_rad": "elevator_measured_rad"}


def words_of(name: str) -> list[str]:
    """Return the lower-case words of a name, its unit left out: `/auv/yawRate_deg_s` gives auv, yaw, rate."""
    bare = _SUFFIX.sub("", _UNIT.sub("", name.strip()))
    return [w.lower() for w in _WORD.findall(bare)]


def meaning_of(name: str) -> tuple[str, int] | None:
    """Return the signal a name probably means and how sure that is (words matched), or None."""
    said = canonical(name)
    if said is not None:
        return said.signal, 9
    words = words_of(name)
    if len(words) == 1 and words[0] in LETTERS:
        return LETTERS[words[0]], 1
    best: tuple[str, int] | None = None
    for signal, phrases in PHRASES.items():
        for phrase in phrases:
            parts = phrase.split()
            if all(p in words for p in parts) and (best is None or 2 * len(parts) > best[1]):
                best = (signal, 2 * len(parts))
    if best is None:
        return None
    signal = best[0]
    if signal in _FINS and MEASURED & set(words) and not COMMANDED & set(words):
        signal = _FINS[signal]
    elif COMMANDED & set(words) and signal not in (*_FINS, "thrust", "propeller_rpm"):
        return None
    return signal, best[1]
