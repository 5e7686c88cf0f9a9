"""What a name in somebody's log probably means: words of columns, topics and fields to canonical signals."""

from __future__ import annotations

import re
from collections.abc import Mapping
from types import MappingProxyType

from fieldsid.logs.mapping.canonical_names import TIME, canonical

COMMANDED = frozenset({
    "cmd", "command", "commanded", "setpoint", "sp", "desired", "des", "target", "tgt", "reference", "ref", "demand", "demanded",
    "goal", "next", "ordered", "wanted",
})  # fmt: skip
MEASURED = frozenset({"measured", "meas", "feedback", "fb", "actual", "state", "states", "encoder", "position"})

LATITUDE, LONGITUDE = "latitude", "longitude"
"""Not signals: together they give x and y."""
OF_ANOTHER = frozenset({
    "error", "err", "cov", "covariance", "std", "sigma", "variance", "var", "bias", "limit", "lim", "max", "min", "quality",
    "valid", "flag", "gain", "gains", "temp", "temperature", "sound", "wind", "air", "variation", "status", "mode", "enabled",
    "count",
})  # fmt: skip
"""Words that make a name one of something else than the signal it also names."""
OF_SPEED = frozenset({"v", "vel", "velocity", "speed", "acceleration", "accel", "acc"})
"""Words of a speed or acceleration north or east, which is no place."""
OF_ANOTHER_THERE: Mapping[str, frozenset[str]] = MappingProxyType(
    {"depth_m": frozenset({"rate", "water", "bottom", "column", "total"}), "roll_rad": frozenset({"fin", "rate"}),
     "yaw_rad": frozenset({"rate", "fin"}), "pitch_rad": frozenset({"rate", "fin"}), "surge_m_s": frozenset({"motor", "rate"}),
     "rudder_rad": frozenset({"roll"}), "x_m": OF_SPEED, "y_m": OF_SPEED}
)  # fmt: skip
OVER_GROUND = frozenset({"gps", "gnss", "course", "cog", "sog", "ground", "track"})
"""Words of a course or a speed over ground, which current and sideslip keep from being the vehicle's own; and of a receiver
that hears nothing under water, beside a position that was estimated."""
GLIDER = MappingProxyType({"m": "measured", "c": "commanded"})
"""What the first letter of a glider's sensor says, as in `m_fin` and `c_fin`."""

PHRASES: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        TIME: ("time", "timestamp", "stamp", "utc", "seconds", "datetime", "epoch", "zeit", "uhrzeit", "datenum", "elapsed"),
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
            "angular velocity z",
        ),
        "pitch_rate_rad_s": ("pitch rate", "pitchrate", "gyro y", "gy", "omega y", "wy", "thetadot"),
        "roll_rate_rad_s": ("roll rate", "rollrate", "gyro x", "gx", "omega x", "wx", "phidot"),
        "yaw_rad": ("yaw", "heading", "hdg", "psi", "compass"),
        "pitch_rad": ("pitch", "theta"),
        "roll_rad": ("roll", "phi"),
        "depth_m": ("depth",),
        "surge_m_s": (
            "surge",
            "speed",
            "vehicle speed",
            "water speed",
            "velocity x",
            "vel x",
            "vx",
            "dvl u",
            "dvl x",
            "stw",
            "sog",
        ),
        "sway_m_s": ("sway", "velocity y", "vel y", "vy", "dvl v", "dvl y"),
        "heave_m_s": ("heave", "velocity z", "vel z", "vz", "dvl w", "dvl z"),
        LATITUDE: ("latitude", "lat"),
        LONGITUDE: ("longitude", "long", "lon", "lng"),
        "x_m": ("north", "northing", "pos x", "position x", "utm y"),
        "y_m": ("east", "easting", "pos y", "position y", "utm x"),
        "rudder_rad": ("rudder", "rud", "delta r", "deltar", "fin yaw", "fin", "drud", "delr"),
        "elevator_rad": (
            "elevator",
            "elev",
            "stern plane",
            "sternplane",
            "sternplanes",
            "delta s",
            "deltas",
            "delta e",
            "fin pitch",
            "delv",
        ),
        "thrust": ("thrust", "thruster", "motor", "motor speed"),
        "propeller_rpm": ("rpm", "propeller", "prop"),
    }
)
"""Words, all of which a name must hold, for each signal; more words weigh more."""

LETTERS: Mapping[str, str] = MappingProxyType(
    {"t": TIME, "r": "yaw_rate_rad_s", "q": "pitch_rate_rad_s", "p": "roll_rate_rad_s", "u": "surge_m_s", "v": "sway_m_s",
     "w": "heave_m_s", "x": "x_m", "y": "y_m", "z": "depth_m", "n": "propeller_rpm", "the": "pitch_rad", "delta": "rudder_rad"}
)  # fmt: skip
"""The field's symbols, taken only when a name has no other meaning."""
GREEK = frozenset({"phi", "theta", "psi"})
MOST_BESIDE_GREEK = 2
"""Words beside a Greek letter up to which it is the symbol; with more it is an abbreviation, as in `PHI_HOST_PORT_DB`."""

_UNIT = re.compile(r"[\[(](?!\d+[\])])[^\])]*[\])]")
"""A unit in brackets; digits alone are the place of a part among others, as in `u(2)`."""
_SUFFIX = re.compile(r"_(rad|deg|rad_s|deg_s|m_s|m|s|ms|us|ns|kn|ft|rpm|km_h|dps)$")
_WORD = re.compile(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])|\d+")
_OF_GLIDER = re.compile(r"^[mc]_[a-z]")
_FINS = {"rudder_rad": "rudder_measured_rad", "elevator_rad": "elevator_measured_rad"}
_GOALS = {"yaw_rad": "yaw_goal_rad", "pitch_rad": "pitch_goal_rad"}


def words_of(name: str) -> list[str]:
    """Return the lower-case words of a name, its unit left out: `/auv/yawRate_deg_s` gives auv, yaw, rate."""
    bare = _SUFFIX.sub("", _UNIT.sub("", name.strip()))
    glider = GLIDER.get(name[:1]) if _OF_GLIDER.match(name) else None
    return ([glider] if glider else []) + [w.lower() for w in _WORD.findall(bare[2:] if glider else bare)]


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
    own = words_of(re.split(r"[/ .]", name.strip())[-1])
    if best is not None and best[1] == 2 and GREEK & set(own) and len(own) > MOST_BESIDE_GREEK + 1:
        return None
    if best is None or OF_ANOTHER & set(words) or OF_ANOTHER_THERE.get(best[0], frozenset()) & set(words):
        return None
    return _of_use(best[0], best[1], set(words))


def _of_use(signal: str, sure: int, words: set[str]) -> tuple[str, int] | None:
    """Return a signal as what it was wanted to be or what it was, and how sure its words make it."""
    if signal in _FINS and MEASURED & words and not COMMANDED & words:
        return _FINS[signal], sure
    if COMMANDED & words and signal in _GOALS:
        return _GOALS[signal], sure + ("next" not in words)
    if COMMANDED & words and signal not in (*_FINS, "thrust", "propeller_rpm", TIME):
        return None
    if signal in ("yaw_rad", "surge_m_s"):
        sure += ("true" in words) - ("magnetic" in words)
    if signal in ("yaw_rad", "surge_m_s", LATITUDE, LONGITUDE):
        sure = 1 if OVER_GROUND & words else sure
    return signal, sure
