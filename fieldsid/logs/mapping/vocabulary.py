"""What names in logs mean, as rules: a signal, phrases of which a name holds all words, words beside which it is another thing.

More words weigh more. A rule whose numbers say more than its words has a `holds`, which its column's least and largest must
pass: a `TH` that goes round is a true heading, one between the tilts of a vehicle a theta.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

from fieldsid.logs.run import GOALS

TIME = "time_s"
LATITUDE, LONGITUDE = "latitude", "longitude"
"""Not signals: together they give x and y."""
Span = tuple[float, float]
"""The least and the largest number of a column."""


def word_set(text: str) -> frozenset[str]:
    """Return the words of a text."""
    return frozenset(text.split())


COMMANDED = word_set(
    "cmd command commanded setpoint sp desired des target tgt reference ref demand demanded goal next ordered wanted"
)
MEASURED = word_set("measured meas feedback fb actual state states encoder position")
OF_ANOTHER = word_set(
    "error err cov covariance std sigma variance var bias limit lim max min quality valid flag gain gains temp temperature sound "
    "wind ws air variation status mode enabled count id"
)
"""Words that make a name one of something else than the signal it also names."""
COMPASS = word_set("heading hdg compass")
"""Words of a heading that is one by its name: from north, clockwise."""
OVER_GROUND = word_set("gps gnss course cog sog vtg ground track")
"""Words of a course or a speed over ground, which current and sideslip keep from being the vehicle's own; and of a receiver
that hears nothing under water, beside a position that was estimated."""
OF_SPEED = word_set("v vel velocity speed acceleration accel acc")
"""Words of a speed or acceleration north or east, which is no place."""
OTHERS = word_set(
    "angle signal raw filtered est estimate estimated sensor compass stick servo true magnetic joint vehicle boat glider"
)
"""Words that say nothing of the signal, and stand glued to those that do, as in `rudderangle`."""


def anything(span: Span) -> bool:
    """Whether a rule without a predicate holds."""
    return True


def within(limit: float) -> Callable[[Span], bool]:
    """Return the predicate that no number is larger than a limit in size."""
    return lambda span: max(map(abs, span)) <= limit


def beyond(limit: float) -> Callable[[Span], bool]:
    """Return the predicate that some number is larger than a limit in size."""
    return lambda span: max(map(abs, span)) > limit


@dataclass(frozen=True, slots=True)
class Rule:
    """A signal and the phrases, parted by commas, that mean it; `alone` where the name may hold no other word."""

    signal: str
    phrases: str
    unless: frozenset[str] = frozenset()
    holds: Callable[[Span], bool] = anything
    alone: bool = False


STEEPEST_DEG = 360.0
"""A pitch or roll is less in any unit: a larger number is none, as the port or the error code that a constant may be."""
_TILT = within(STEEPEST_DEG)
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
    Rule("yaw_rad", "yaw, heading, hdg, psi, compass", _TURN),
    Rule("yaw_rad", "head", _TURN | word_set("water loss pump")),
    Rule("pitch_rad", "pitch, theta", _TURN, _TILT),
    Rule("roll_rad", "roll, phi", _TURN, _TILT),
    Rule("depth_m", "depth", word_set("rate water bottom column total")),
    Rule(
        "surge_m_s",
        "surge, speed, spd, vehicle speed, water speed, velocity x, vel x, vx, dvl u, dvl x, stw, sog",
        word_set("motor rate"),
    ),
    Rule("sway_m_s", "sway, velocity y, vel y, vy, dvl v, dvl y"),
    Rule("heave_m_s", "heave, velocity z, vel z, vz, dvl w, dvl z"),
    Rule(LATITUDE, "latitude, lat", holds=within(90.0)),
    Rule(LONGITUDE, "longitude, long, lon, lng", holds=within(360.0)),
    Rule("x_m", "north, northing, pos x, position x, utm y", OF_SPEED),
    Rule("y_m", "east, easting, pos y, position y, utm x", OF_SPEED),
    Rule("rudder_rad", "rudder, rud, delta r, deltar, fin yaw, fin, drud, delr", word_set("roll")),
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
    Rule("yaw_rad", "th", holds=beyond(90.0), alone=True),
    Rule("pitch_rad", "th", holds=within(90.0), alone=True),
)  # fmt: skip
"""What names mean. The field's symbols are taken only where a name has no other word."""

WANTED: Mapping[str, str] = MappingProxyType(
    {s: s for s in ("rudder_rad", "elevator_rad", "thrust", "propeller_rpm", TIME)}
    | {"yaw_rad": "yaw_goal_rad", "pitch_rad": "pitch_goal_rad"}
)
SEEN: Mapping[str, str] = MappingProxyType({"rudder_rad": "rudder_measured_rad", "elevator_rad": "elevator_measured_rad"})
"""What signals are that were commanded, all others of which are none, and what they are that were measured."""
GROUNDED = frozenset({"yaw_rad", "surge_m_s", LATITUDE, LONGITUDE})
"""Signals that are the vehicle's own only where they are not over ground."""
GLIDER: Mapping[str, str] = MappingProxyType({"m": "measured", "c": "commanded"})
"""What the first letter of a glider's sensor says, as in `m_fin` and `c_fin`."""
GREEK = word_set("phi theta psi")
MOST_BESIDE_GREEK = 2
"""Words beside a Greek letter up to which it is the symbol; with more it is an abbreviation, as in `PHI_HOST_PORT_DB`."""


def is_abbreviation(words: list[str]) -> bool:
    """Whether a Greek letter among words is no symbol."""
    return bool(GREEK & set(words)) and len(words) > MOST_BESIDE_GREEK + 1


_TURNS = ("roll_rate_rad_s", "pitch_rate_rad_s", "yaw_rate_rad_s")
VECTORS: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        "angular_velocity": _TURNS, "angular": _TURNS, "linear": ("surge_m_s", "sway_m_s", "heave_m_s"),
        "position": ("x_m", "y_m", "depth_m"), "vector": ("roll_rad", "pitch_rad", "yaw_rad"),
    }
)  # fmt: skip
"""What the x, y and z are of vectors in standard messages; those of a `vector` where its topic is one of Euler's angles."""
EULER = word_set("rpy euler attitude orientation angles")

PHRASES = tuple((rule, tuple(phrase.split())) for rule in RULES for phrase in rule.phrases.split(", "))
"""Each phrase by its words, with its rule."""
KNOWN = (
    frozenset(word for _, phrase in PHRASES for word in phrase if len(word) > 2)
    | COMMANDED | MEASURED | OF_ANOTHER | OVER_GROUND | OTHERS | OF_SPEED | _TURN
)  # fmt: skip
"""Words that are told apart where they are written as one."""


def part_of(path: str) -> str | None:
    """Return the signal of one part of a standard message's vector, as in `twist.twist.angular.z`; None of any other."""
    parent, _, last = path.rpartition(".")
    vector = VECTORS.get(re.split(r"[. ]", parent)[-1])
    return None if vector is None or last not in ("x", "y", "z") else vector["xyz".index(last)]


def weight(rule: Rule, phrase: tuple[str, ...], words: list[str]) -> int:
    """Return what a phrase weighs of which a name holds all words: two each, and one where it is all there is."""
    if rule.alone:
        return int(words == list(phrase))
    return 2 * len(phrase) if all(p in words for p in phrase) else 0


def of_use(signal: str, sure: int, words: set[str]) -> tuple[str, int] | None:
    """Return a signal as what it was wanted to be or what it was, and how sure its words make it."""
    if COMMANDED & words:
        return (WANTED[signal], sure + (WANTED[signal] in GOALS and "next" not in words)) if signal in WANTED else None
    if signal in GROUNDED and OVER_GROUND & words:
        return signal, 1
    sure += (("true" in words) - ("magnetic" in words)) * (signal in ("yaw_rad", "surge_m_s"))
    return SEEN.get(signal, signal) if MEASURED & words else signal, sure
