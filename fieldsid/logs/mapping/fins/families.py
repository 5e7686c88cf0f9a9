"""Fins and thrusters that are called alike but for a number or a side: what may move a plane together."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from fieldsid.logs.mapping.name_words import words_of
from fieldsid.logs.mapping.vocabulary import COMMANDED, MEASURED
from fieldsid.logs.reader import Inventory

CALLED = frozenset({
    "fin", "fins", "servo", "servomotor", "rudder", "rudders", "rud", "elevator", "elevators", "elev", "plane", "planes",
    "sternplane", "sternplanes", "surface", "surfaces", "flap", "flaps", "foil", "actuator", "actuators", "output", "outputs",
    "control", "controls", "ctrl", "rcou", "delta", "pwm", "u", "d", "input", "inputs", "act", "surf", "canard", "wing",
})  # fmt: skip
"""Words of what may be a fin among others."""
THRUSTERS = frozenset({
    "thrust", "thruster", "thrusters", "thr", "motor", "motors", "prop", "propeller", "esc", "jet", "engine", "rpm",
})  # fmt: skip
"""Words of what turns a vehicle by pushing more on one side."""
STARBOARD = frozenset({"starboard", "stbd", "right", "s", "r", "sb"})
SIDES = STARBOARD | frozenset({
    "port", "left", "p", "l", "upper", "lower", "top", "bottom", "up", "down", "t", "b", "a", "c", "d", "ul", "ur", "ll", "lr",
    "tl", "tr", "bl", "br", "pu", "pl", "su", "sl", "ne", "nw", "se", "sw", "i", "ii", "iii", "iv",
})  # fmt: skip
"""Words of where one of several fins is."""
MOST = 16
"""Fins and motors alike: more are no vehicle's."""
Family = Mapping[str, Mapping[str, Any]]
"""Fins alike: where a mapping finds each, by its name."""
SHORT = 2
"""Letters up to which a word is a side only behind another."""


def is_measured(family: Family) -> bool:
    """Whether fins are told as they were measured, by their names."""
    words = {word for name in family for word in words_of(name)}
    return bool(words & MEASURED) and not words & (COMMANDED | {"set"})


def families(inventory: Inventory) -> list[Family]:
    """Return columns, or fields of topics, that are called alike but for a number or a side, as places in a mapping by name."""
    alike: dict[tuple[str, ...], dict[str, Mapping[str, Any]]] = {}
    for name, place in _moving(inventory):
        kind = _kind(words_of(name))
        if kind is not None:
            alike.setdefault(kind, {})[name] = place
    return [family for family in alike.values() if 1 < len(family) <= MOST]


def _moving(inventory: Inventory) -> Iterator[tuple[str, Mapping[str, Any]]]:
    """Yield the numbers of a log that change and that its format does not define, by name, with their place."""
    if inventory.table is not None and not inventory.table.header:
        return
    for channel in inventory.channels:
        for info in channel.fields:
            is_number = info.kind not in ("text", "numbers") and info.means is None
            if is_number and (info.span is None or info.span[0] < info.span[1]):
                if inventory.by_topic:
                    yield f"{channel.name} {info.path}".strip(), {"topic": channel.name, "field": info.path}
                else:
                    yield channel.name, {"column": channel.name}


def _kind(words: list[str]) -> tuple[str, ...] | None:
    """Return what fins of one kind have alike in their names; None for a name that is no fin's, or of one that stands alone."""
    kind = tuple("#" if w.isdigit() or (w in SIDES and (i or len(w) > SHORT)) else w for i, w in enumerate(words))
    is_fin = bool((CALLED | THRUSTERS) & set(kind)) or set(words) <= SIDES
    return kind if is_fin and "#" in kind else None


def is_thruster(name: str) -> bool:
    """Whether what pushes is called so, or by nothing but its side."""
    words = set(words_of(name))
    return bool(THRUSTERS & words) or words <= SIDES


def is_on_starboard(name: str) -> bool:
    """Whether a thruster is the one on the starboard side, by its name."""
    return is_thruster(name) and bool(STARBOARD & set(words_of(name)))
