"""The meaning of names in logs, as rules: a signal, its phrases, and the words that exclude it.

A phrase matches a name that contains all its words; more words weigh more. A rule may limit the numbers of the column: a `TH` of
up to 360 is a true heading, one within the pitch of a vehicle a theta.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from fieldsid.logs.run import FINS, GOALS, MEASURED_FIN

TIME = "time_s"
LATITUDE, LONGITUDE = "latitude", "longitude"
"""Names that are not signals; together they give x and y."""
Span = tuple[float, float]
"""The smallest and the largest number of a column."""


def word_set(text: str) -> frozenset[str]:
    """Return the words of a text."""
    return frozenset(text.split())


COMMANDED = word_set(
    "cmd command commanded setpoint set sp desired des target tgt reference ref demand demanded goal next order ordered wanted"
)
MEASURED = word_set("measured meas feedback fb actual state states encoder position pos")
OF_ANOTHER = word_set(
    "error err cov covariance std sigma variance var bias limit lim max min quality valid flag gain gains temp temperature sound "
    "wind ws air variation status mode enabled count id"
)
"""Words that show that a name is not the signal it also contains, such as its error or its limit."""
COMPASS = word_set("heading hdg hdt hdm compass")
"""Words of a heading that is counted clockwise from north, by its name."""
OVER_GROUND = word_set("gps gnss course cog sog vtg ground track")
"""Words of a course or a speed over ground, from which heading and speed through water differ by current and sideslip; and of a
satellite receiver, which has no fix under water, so that an estimated position is preferred."""
OF_SPEED = word_set("v vel velocity speed acceleration accel acc")
"""Words of a speed or acceleration north or east, which is not a position."""
OTHERS = word_set(
    "angle signal raw filtered est estimate estimated sensor compass stick servo true magnetic joint vehicle boat glider"
)
"""Words that do not identify a signal, but are written in one with those that do, as in `rudderangle`."""


@dataclass(frozen=True, slots=True)
class Rule:
    """A signal and the phrases, separated by commas, that mean it; `alone` where the name may contain no other word.

    The largest magnitude in the column must be at least `over`, and at most `upto`.
    """

    signal: str
    phrases: str
    unless: frozenset[str] = frozenset()
    over: float = 0.0
    upto: float = math.inf
    alone: bool = False

    def holds(self, span: Span) -> bool:
        """Return whether the smallest and the largest number of a column may be those of the signal."""
        return self.over <= max(map(abs, span)) <= self.upto


STEEPEST_DEG = 360.0
"""Upper bound of a pitch or roll in any unit: a larger number is something else, such as a port or an error code."""
_TURN = word_set("rate fin")

RULES = (
    Rule(TIME, "time, timestamp, stamp, ts, utc, seconds, datetime, epoch, zeit, uhrzeit, datenum, elapsed"),
    Rule(
        "yaw_rate_rad_s",
        "yaw rate, yaw rt, heading rate, head rate, hdg rate, turn rate, rate turn, rot, gyro z, gyr z, gyroscope z, gz, "
        "omega z, wz, psidot, psi dot, yaw dot, yaw speed, yaw velocity, yaw vel, angular velocity z, ang vel z",
    ),
    Rule(
        "pitch_rate_rad_s",
        "pitch rate, gyro y, gyr y, gyroscope y, gy, omega y, wy, thetadot, theta dot, pitch dot, pitch speed, pitch velocity, "
        "angular velocity y, ang vel y",
    ),
    Rule(
        "roll_rate_rad_s",
        "roll rate, gyro x, gyr x, gyroscope x, gx, omega x, wx, phidot, phi dot, roll dot, roll speed, roll velocity, "
        "angular velocity x, ang vel x",
    ),
    Rule("yaw_rad", "yaw, heading, hdg, hdt, hdm, psi, compass", _TURN),
    Rule("yaw_rad", "head", _TURN | word_set("water loss pump")),
    Rule("pitch_rad", "pitch, theta", _TURN, upto=STEEPEST_DEG),
    Rule("roll_rad", "roll, phi", _TURN, upto=STEEPEST_DEG),
    Rule("depth_m", "depth", word_set("rate water bottom column total")),
    Rule(
        "surge_m_s",
        "surge, speed, spd, vehicle speed, water speed, velocity x, vel x, vx, dvl u, dvl x, stw, sog",
        word_set("motor rate"),
    ),
    Rule("sway_m_s", "sway, velocity y, vel y, vy, dvl v, dvl y"),
    Rule("heave_m_s", "heave, velocity z, vel z, vz, dvl w, dvl z"),
    Rule(LATITUDE, "latitude, lat", upto=90.0),
    Rule(LONGITUDE, "longitude, long, lon, lng", upto=360.0),
    Rule("x_m", "north, northing, pos x, position x, utm y", OF_SPEED),
    Rule("y_m", "east, easting, pos y, position y, utm x", OF_SPEED),
    Rule("rudder_rad", "rudder, rud, rdr, delta r, deltar, fin yaw, fin, drud, delr", word_set("roll")),
    Rule("elevator_rad", "elevator, elev, stern plane, sternplane, sternplanes, delta s, deltas, delta e, fin pitch, delv"),
    Rule("thrust", "thrust, thruster, throttle, motor, motor speed"),
    Rule("propeller_rpm", "rpm, propeller, prop"),
    *(
        Rule(signal, letters, alone=True)
        for signal, letters in (
            (TIME, "t"), ("yaw_rate_rad_s", "r, rz"), ("pitch_rate_rad_s", "q, ry"), ("roll_rate_rad_s", "p, rx"),
            ("surge_m_s", "u, velocity, vel"),
            ("sway_m_s", "v"), ("heave_m_s", "w"), ("x_m", "x"), ("y_m", "y"), ("depth_m", "z"), ("propeller_rpm", "n"),
            ("rudder_rad", "delta"),
        )
    ),
    Rule("pitch_rad", "the", alone=True),
    Rule("yaw_rad", "th", over=90.0, alone=True),
    Rule("pitch_rad", "th", upto=90.0, alone=True),
)  # fmt: skip
"""The meaning of names. Symbols of the field, such as r or u, match only where a name has no other word."""

AS_COMMANDED: Mapping[str, str] = MappingProxyType(
    {s: s for s in ("rudder_rad", "elevator_rad", "thrust", "propeller_rpm", TIME)}
    | {"yaw_rad": "yaw_goal_rad", "pitch_rad": "pitch_goal_rad"}
)
"""The signal that the command of a signal is; a command of any other is none."""
GROUNDED = frozenset({"yaw_rad", "surge_m_s", LATITUDE, LONGITUDE})
"""Signals that differ from the vehicle's heading, speed or position where their name says over ground."""
GLIDER: Mapping[str, str] = MappingProxyType({"m": "measured", "c": "commanded"})
"""The meaning of the first letter of a glider's sensor, as in `m_fin` and `c_fin`."""
CONTROL: Mapping[str, str] = MappingProxyType({"e": "error", "r": "reference", "u": "command"})
"""The meaning of a letter before a name in a log of control: `e_speed` is an error, `r_speed` a reference; a `u_rudder` commands
the rudder, and a `u_yaw` is the output of a controller in yaw."""
GREEK = word_set("phi theta psi")


def is_abbreviation(words: list[str]) -> bool:
    """Return whether a Greek letter is no symbol, but an abbreviation, by its number of words: `PHI_HOST_PORT_DB`."""
    return bool(GREEK & set(words)) and len(words) > 3


_TURNS = ("roll_rate_rad_s", "pitch_rate_rad_s", "yaw_rate_rad_s")
VECTORS: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        "angular_velocity": _TURNS, "angular": _TURNS, "linear": ("surge_m_s", "sway_m_s", "heave_m_s"),
        "position": ("x_m", "y_m", "depth_m"), "vector": ("roll_rad", "pitch_rad", "yaw_rad"),
    }
)  # fmt: skip
"""The signals of x, y and z of vectors in standard messages; those of a `vector` only where its topic has Euler angles."""
EULER = word_set("rpy euler attitude orientation angles")

SYMBOLS = frozenset((rule.signal, phrase) for rule in RULES if rule.alone for phrase in rule.phrases.split(", "))
"""The symbol of each signal, with the signal: the `u` of `u_surge` repeats its name."""
PHRASES = tuple((rule, tuple(phrase.split())) for rule in RULES for phrase in rule.phrases.split(", "))
"""Each rule with each of its phrases, split into words."""
KNOWN = (
    frozenset(word for _, phrase in PHRASES for word in phrase if len(word) > 2)
    | COMMANDED | MEASURED | OF_ANOTHER | OVER_GROUND | OTHERS | OF_SPEED | _TURN
)  # fmt: skip
"""Words that are separated where they are written as one."""


def part_of(path: str) -> str | None:
    """Return the signal of one component of a vector in a standard message, such as `twist.twist.angular.z`; None for another."""
    parent, _, last = path.rpartition(".")
    vector = VECTORS.get(re.split(r"[. ]", parent)[-1])
    return None if vector is None or last not in ("x", "y", "z") else vector["xyz".index(last)]


def weight(rule: Rule, phrase: tuple[str, ...], words: list[str]) -> int:
    """Return the weight of a phrase in a name: 2 per word where the name contains all words, 1 for a rule that matches alone."""
    if rule.alone:
        return int(words == list(phrase))
    return 2 * len(phrase) if all(p in words for p in phrase) else 0


def as_command_or_measurement(signal: str, sure: int, words: set[str]) -> tuple[str, int] | None:
    """Return the signal, its command or its measurement, by the words of a name, and its score; None where it is no signal."""
    if COMMANDED & words:
        return (
            (AS_COMMANDED[signal], sure + (AS_COMMANDED[signal] in GOALS.union(FINS) and "next" not in words))
            if signal in AS_COMMANDED
            else None
        )
    if signal in GROUNDED and OVER_GROUND & words:
        return signal, 1
    sure += (("true" in words) - ("magnetic" in words)) * (signal in ("yaw_rad", "surge_m_s"))
    return MEASURED_FIN.get(signal, signal) if MEASURED & words else signal, sure
