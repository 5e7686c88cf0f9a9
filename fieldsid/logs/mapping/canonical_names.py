"""The words of a name and the unit in it, and the canonical names: `yaw_rate_deg_s` is `yaw_rate_rad_s` in deg/s.

A name is split at case, digits, underscores and brackets, and where known words are glued.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from functools import lru_cache
from types import MappingProxyType
from typing import NamedTuple

from fieldsid.logs.channels import POSITION
from fieldsid.logs.convert.servo_counts import BY_UNIT
from fieldsid.logs.convert.units import SPELLINGS, Unit, dimension_of, find_unit
from fieldsid.logs.mapping.vocabulary import GLIDER, KNOWN, LATITUDE, LONGITUDE, TIME
from fieldsid.logs.run import FINS, LINES, SIGNALS

_BRACKET = re.compile(r"[\[({]([^\])}]*)[\])}]")
_WORD = re.compile(r"[A-Z]+[a-z]*|[a-z]+|\d+")
_PASCALS = re.compile(r"[kMh]Pa(?![a-z])")
_OF_GLIDER = re.compile(r"^[mc]_[a-z]")
_DEGREE = re.compile("[°º]")
_INVERSE = re.compile(r"(?<=[A-Za-z])\^?-1\b|⁻¹")
OF_NAMES = ("angle", "angle rate", "speed", "length", "pressure", "time")
"""Dimensions whose units stand in names."""
NEVER = frozenset({"in", "mi", "rev", "revs", "d"})
"""Spellings that are other words in names: input, middle, reverse, down."""
ALL_UNITS = frozenset(text for d in OF_NAMES for text in SPELLINGS[d]) - NEVER | {"percent", "pct", "perc"}
LONGEST = 3
"""Words of a unit: `deg_per_sec`, of which `per` is none."""
SHORTEST = 3
"""Letters of the words that are told apart where they are glued."""


@lru_cache(maxsize=1 << 14)
def tokens_of(name: str) -> tuple[str, ...]:
    """Return the lower-case words of a name with those of its unit, but for a unit in brackets: `DepthFt` gives depth, ft."""
    bare = _BRACKET.sub(lambda m: " " if m[1] and find_unit(m[1]) is not None and not m[1].isdigit() else m[0], name.strip())
    bare = _INVERSE.sub("", _PASCALS.sub(lambda m: f" {m[0].lower()} ", _DEGREE.sub("deg", bare)))
    glider = _OF_GLIDER.match(name)
    words = [w for part in _WORD.findall(bare[2:] if glider else bare) for run in _by_case(part) for w in _unglued(run)]
    return (*((GLIDER[name[0]],) if glider else ()), *(w for w in words if w != "per"))


def _by_case(part: str) -> tuple[str, ...]:
    """Split capitals from the word behind them: `SOGkts` at a unit, `GPSHeading` before the last capital."""
    capitals = len(part) - len(part.lstrip("ABCDEFGHIJKLMNOPQRSTUVWXYZ"))
    small = part[capitals:]
    if capitals < 2 or not small:
        return (part.lower(),)
    cut = capitals if len(small) > 1 and small in ALL_UNITS else capitals - 1
    return part[:cut].lower(), part[cut:].lower()


def _unglued(word: str) -> tuple[str, ...]:
    """Return the known words, and the unit behind them, that a word is made of; itself where it is one or is not made of them."""
    return (word,) if word in KNOWN or word in ALL_UNITS else _parts(word) or (word,)


def _parts(word: str) -> tuple[str, ...]:
    for cut in range(len(word) - 2, SHORTEST - 1, -1):
        head, tail = word[:cut], word[cut:]
        if head in KNOWN:
            behind = (tail,) if tail in ALL_UNITS or (tail in KNOWN and len(tail) >= SHORTEST) else _parts(tail)
            if behind:
                return (head, *behind)
    return ()


def words_of(name: str) -> list[str]:
    """Return the lower-case words of a name, the unit at its end left out: `/auv/yawRate_deg_s` gives auv, yaw, rate."""
    tokens = tokens_of(name)
    for size in range(min(LONGEST, len(tokens) - 1), 0, -1):
        last = tokens[-size:]
        if _spelled(last) and (size > 1 or (last[0] not in KNOWN and (len(last[0]) > 1 or last[0] in "ms"))):
            return list(tokens[:-size])
    return list(tokens)


def unit_said(name: str, dimensions: tuple[str, ...]) -> Unit | None:
    """Return the unit of one of some dimensions that a name states: in brackets, else among its words; None where none fits.

    A name that states a unit by another states none of the two: `heading_deg_s` is not in `deg`.
    """
    for inside in (text for text in reversed(_BRACKET.findall(name)) if not text.isdigit()):
        units = [u for d in dimensions if (u := find_unit(inside, d)) is not None]
        fitting = next((u for u in units if u.dimension in dimensions), None)
        if fitting is not None or units:
            return fitting
    tokens = tokens_of(name)
    for size in range(LONGEST, 0, -1):
        for end in range(len(tokens), size - 1, -1):
            spelled = _spelled(tokens[end - size : end])
            if spelled and (size > 1 or _is_apart(tokens, end)):
                found = next((SPELLINGS[d][spelled] for d in dimensions if spelled in SPELLINGS[d]), None)
                if found is not None or size > 1:
                    return found
    return None


def _spelled(tokens: tuple[str, ...]) -> str:
    """Return the unit that some words are together, several by one another, as it is spelled; empty where they are none."""
    spelled = "/".join(tokens)
    return spelled if spelled in ALL_UNITS else ""


def _is_apart(tokens: tuple[str, ...], end: int) -> bool:
    """Whether a word is a unit beside others and not all of a name: of a letter alone that at the end only."""
    return len(tokens) > 1 and (len(tokens[end - 1]) > 1 or end == len(tokens))


STEMS: Mapping[str, str] = MappingProxyType(
    {re.sub(r"_(rad|m|rpm)(_s)?$", "", s): s for s, unit in SIGNALS.items() if unit not in ("", "1")}
)
"""Names without a unit, and the signal each stands for."""

OF_CHANGES: Mapping[str, str] = MappingProxyType({"angle rate": "angle", "speed": "length"})
"""Dimensions whose names leave out that a unit is one by a second, and that unit's dimension: a rate in `deg`."""


OF_TOPIC = frozenset({"", "data", "value"})
"""Fields that say nothing of what they are."""


class Canonical(NamedTuple):
    """What a column name says: the canonical signal (or `time_s`) and the unit of its numbers."""

    signal: str
    unit: str


def canonical(column: str) -> Canonical | None:
    """Return the signal and unit that a column name states, or None when it is no canonical name."""
    name = column.strip().lower()
    if name in ("thrust", "thrust_ratio"):
        return Canonical(name, "1")
    if name in LINES:
        return Canonical(name, "rad")
    for at in (found.start() for found in re.finditer("_", name)):
        signal, spelled = {**STEMS, "time": TIME}.get(name[:at], ""), name[at + 1 :].replace("_", "/")
        units = [SPELLINGS[d][spelled] for d in fitting(signal) if spelled in SPELLINGS[d] and spelled in ALL_UNITS]
        if units:
            return Canonical(signal, units[0].name)
    return None


def fitting(signal: str) -> tuple[str, ...]:
    """Return the dimensions that a signal's numbers may have: a depth may be a pressure; none where any unit may be meant."""
    dimension = {TIME: "time", POSITION: "angle", LATITUDE: "angle", LONGITUDE: "angle"}.get(signal, dimension_of(signal))
    return (*((dimension,) if dimension else ()), *(("pressure",) if signal == "depth_m" else ()))


def stated_unit(text: str, signal: str) -> str | None:
    """Return a unit that stands beside a signal, as `deg/s` or `[deg/s]`, by its own name; None where it does not fit."""
    bare = text.strip().strip("[]()")
    units = (find_unit(bare, dimension) for dimension in fitting(signal))
    return next((u.name for u in units if u is not None and u.dimension in fitting(signal)), None)


def unit_in_name(name: str, signal: str, beside: str | None = None) -> str | None:
    """Return the unit a name, or what stands beside it, states for a signal: `heading [deg]`, `r (deg/s)`, `DepthFt`; else None.

    A rate named with the unit of its angle, or a speed with that of its way, is one by a second.
    """
    said, dimensions = canonical(name), fitting(signal)
    if said is not None and said.signal == signal and said.unit != "1":
        return said.unit
    found = unit_said(name, dimensions) or (unit_said(name, ("time", "ratio")) if signal in FINS else None)
    if found is not None and (found.dimension in dimensions or found.name in BY_UNIT):
        return "rad/s" if found.name == "rev/s" and signal != "propeller_rpm" else found.name
    whole = unit_said(name, (OF_CHANGES[dimensions[0]],)) if dimensions and dimensions[0] in OF_CHANGES else None
    by_second = None if whole is None else find_unit(f"{whole.name}/s")
    return by_second.name if by_second is not None else stated_unit(beside, signal) if beside else None


def unit_of_field(topic: str, field: str, signal: str, beside: str | None = None) -> str | None:
    """Return the unit that a field of a topic states by its name, or where that says nothing, as `data`, the topic's."""
    last = field.rpartition(".")[2]
    of_topic = unit_in_name(topic.rpartition("/")[2], signal) if last in OF_TOPIC else None
    return of_topic or unit_in_name(last, signal, beside)
