"""The words of a name and the unit in it, and the canonical names: `yaw_rate_deg_s` is `yaw_rate_rad_s` in deg/s.

A name is split at changes of case, at digits, underscores and brackets, and between known words that are written as one.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from functools import lru_cache
from types import MappingProxyType
from typing import NamedTuple

from fieldsid.logs.channels import POSITION
from fieldsid.logs.convert.servo_counts import BY_UNIT
from fieldsid.logs.convert.units import SPELLINGS, Unit, dimension_of, find_unit, unit_among
from fieldsid.logs.mapping.vocabulary import GLIDER, KNOWN, LATITUDE, LONGITUDE, TIME
from fieldsid.logs.run import FINS, LINES, SIGNALS

_BRACKET = re.compile(r"[\[({]([^\])}]*)[\])}]")
_WORD = re.compile(r"[A-Z]+[a-z]*|[a-z]+|\d+")
_PASCALS = re.compile(r"[kMh]Pa(?![a-z])")
_OF_GLIDER = re.compile(r"^[mc]_[a-z]")
_DEGREE = re.compile("[°º]")
_INVERSE = re.compile(r"(?<=[A-Za-z])\^?-1\b|⁻¹")
OF_NAMES = ("angle", "angle rate", "speed", "length", "pressure", "time")
"""Dimensions of the units that names contain."""
NEVER = frozenset({"in", "mi", "rev", "revs", "d"})
"""Spellings that are other words in names: input, middle, reverse, down."""
ALL_UNITS = frozenset(text for d in OF_NAMES for text in SPELLINGS[d]) - NEVER | {"percent", "pct", "perc"}
LONGEST = 3
"""Largest number of words of a unit; the `per` of `deg_per_sec` does not count."""
SHORTEST = 3
"""Fewest letters of a word that is recognised inside a compound such as `rudderangle`."""


@lru_cache(maxsize=1 << 14)
def tokens_of(name: str) -> tuple[str, ...]:
    """Return the lower-case words of a name and of its unit, without a unit in brackets: `DepthFt` gives depth, ft."""
    bare = _BRACKET.sub(lambda m: " " if m[1] and find_unit(m[1]) is not None and not m[1].isdigit() else m[0], name.strip())
    bare = _INVERSE.sub("", _PASCALS.sub(lambda m: f" {m[0].lower()} ", _DEGREE.sub("deg", bare)))
    glider = _OF_GLIDER.match(name)
    words = [w for part in _WORD.findall(bare[2:] if glider else bare) for run in _by_case(part) for w in _split_compound(run)]
    return (*((GLIDER[name[0]],) if glider else ()), *(w for w in words if w != "per"))


def _by_case(part: str) -> tuple[str, ...]:
    """Split capitals from the word that follows: `SOGkts` before a unit, `GPSHeading` before the last capital."""
    capitals = len(part) - len(part.lstrip("ABCDEFGHIJKLMNOPQRSTUVWXYZ"))
    small = part[capitals:]
    if capitals < 2 or not small:
        return (part.lower(),)
    cut = capitals if len(small) > 1 and small in ALL_UNITS else capitals - 1
    return part[:cut].lower(), part[cut:].lower()


def _split_compound(word: str) -> tuple[str, ...]:
    """Return the known words, and the unit after them, that form a compound; the word itself where it is not a compound."""
    return (word,) if word in KNOWN or word in ALL_UNITS else _parts(word) or (word,)


def _parts(word: str) -> tuple[str, ...]:
    for cut in range(len(word) - 2, SHORTEST - 1, -1):
        head, tail = word[:cut], word[cut:]
        if head in KNOWN:
            rest = (tail,) if tail in ALL_UNITS or (tail in KNOWN and len(tail) >= SHORTEST) else _parts(tail)
            if rest:
                return (head, *rest)
    return ()


def words_of(name: str) -> list[str]:
    """Return the lower-case words of a name without the unit at its end: `/auv/yawRate_deg_s` gives auv, yaw, rate."""
    tokens = tokens_of(name)
    for size in range(min(LONGEST, len(tokens) - 1), 0, -1):
        last = tokens[-size:]
        if _spelled(last) and (size > 1 or (last[0] not in KNOWN and (len(last[0]) > 1 or last[0] in "ms"))):
            return list(tokens[:-size])
    return list(tokens)


def unit_among_words(name: str, dimensions: tuple[str, ...]) -> Unit | None:
    """Return the unit, of one of the given dimensions, that a name states in brackets or among its words; None where none fits.

    A compound unit is not taken for one of its parts: `heading_deg_s` is not in `deg`.
    """
    for inside in (text for text in reversed(_BRACKET.findall(name)) if not text.isdigit()):
        if find_unit(inside) is not None:
            return unit_among(inside, dimensions)
    tokens = tokens_of(name)
    for size in range(LONGEST, 0, -1):
        for end in range(len(tokens), size - 1, -1):
            spelled = _spelled(tokens[end - size : end])
            if spelled and (size > 1 or _may_be_unit(tokens, end)):
                found = next((SPELLINGS[d][spelled] for d in dimensions if spelled in SPELLINGS[d]), None)
                if found is not None or size > 1:
                    return found
    return None


def _spelled(tokens: tuple[str, ...]) -> str:
    """Return the spelling of the unit that the words form as a quotient, such as `deg/s`; empty where they form none."""
    spelled = "/".join(tokens)
    return spelled if spelled in ALL_UNITS else ""


def _may_be_unit(tokens: tuple[str, ...], end: int) -> bool:
    """Return whether the word before `end` may be a unit: other words are in the name, and a single letter is at its end."""
    return len(tokens) > 1 and (len(tokens[end - 1]) > 1 or end == len(tokens))


STEMS: Mapping[str, str] = MappingProxyType(
    {re.sub(r"_(rad|m|rpm)(_s)?$", "", s): s for s, unit in SIGNALS.items() if unit not in ("", "1")}
)
"""The signal of each canonical name without its unit."""

OF_CHANGES: Mapping[str, str] = MappingProxyType({"angle rate": "angle", "speed": "length"})
"""Dimensions whose names may omit `per second`, with the dimension of the unit that is written: a rate in `deg`."""


OF_TOPIC = frozenset({"", "data", "value"})
"""Names of fields that do not describe their content."""


class Canonical(NamedTuple):
    """The canonical signal (or `time_s`) and the unit that a column name states."""

    signal: str
    unit: str


def canonical(column: str) -> Canonical | None:
    """Return the signal and unit that a column name states; None where it is not a canonical name.

    `yaw_degs` is none: it may be a heading in degrees or a rate in deg/s.
    """
    name = column.strip().lower()
    if name in ("thrust", "thrust_ratio"):
        return Canonical(name, "1")
    if name in LINES:
        return Canonical(name, "rad")
    for at in (found.start() for found in re.finditer("_", name)):
        signal, spelled = {**STEMS, "time": TIME}.get(name[:at], ""), name[at + 1 :].replace("_", "/")
        units = [SPELLINGS[d][spelled] for d in fitting(signal) if spelled in SPELLINGS[d] and spelled in ALL_UNITS]
        if units and not any(spelled in SPELLINGS[change] for change, of in OF_CHANGES.items() if of == units[0].dimension):
            return Canonical(signal, units[0].name)
    return None


def fitting(signal: str) -> tuple[str, ...]:
    """Return the dimensions that the unit of a signal may have (a depth may be a pressure); empty where any unit is possible."""
    dimension = {TIME: "time", POSITION: "angle", LATITUDE: "angle", LONGITUDE: "angle"}.get(signal, dimension_of(signal))
    return (*((dimension,) if dimension else ()), *(("pressure",) if signal == "depth_m" else ()))


def stated_unit(text: str, signal: str) -> str | None:
    """Return the name of the unit that a text such as `deg/s` or `[deg/s]` states; None where it does not fit the signal."""
    found = unit_among(text.strip().strip("[]()"), fitting(signal))
    return None if found is None else found.name


def unit_in_name(name: str, signal: str, unit_text: str | None = None) -> str | None:
    """Return the unit that a name such as `heading [deg]`, `r (deg/s)` or `DepthFt` states for a signal; None without one.

    `unit_text` is a unit that the log states separately from the name. A rate named with the unit of its angle, or a speed with
    the unit of a length, is per second.
    """
    stated, dimensions = canonical(name), fitting(signal)
    if stated is not None and stated.signal == signal and stated.unit != "1":
        return stated.unit
    found = unit_among_words(name, dimensions) or (unit_among_words(name, ("time", "ratio")) if signal in FINS else None)
    if found is not None and (found.dimension in dimensions or found.name in BY_UNIT):
        return "rad/s" if found.name == "rev/s" and signal != "propeller_rpm" else found.name
    unit_without_time = (
        unit_among_words(name, (OF_CHANGES[dimensions[0]],)) if dimensions and dimensions[0] in OF_CHANGES else None
    )
    by_second = None if unit_without_time is None else find_unit(f"{unit_without_time.name}/s")
    return by_second.name if by_second is not None else stated_unit(unit_text, signal) if unit_text else None


def unit_of_field(topic: str, field: str, signal: str, unit_text: str | None = None) -> str | None:
    """Return the unit that the name of a field states, or the name of its topic where the field is called `data` or similar."""
    last = field.rpartition(".")[2]
    of_topic = unit_in_name(topic.rpartition("/")[2], signal) if last in OF_TOPIC else None
    return of_topic or unit_in_name(last, signal, unit_text)
