"""Fins and thrusters that are called alike but for a number or a side: what may move a plane together."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from fieldsid.logs.mapping.name_words import words_of
from fieldsid.logs.mapping.vocabulary import COMMANDED, MEASURED, OF_ANOTHER, word_set
from fieldsid.logs.reader import Inventory

OUTPUTS = word_set("servo servomotor actuator actuators rcou output outputs control controls")
"""Words of what a vehicle's servos are told or say, which do not tell which moves what."""
CALLED = OUTPUTS | word_set(
    "fin fins rudder rudders rud elevator elevators elev plane planes sternplane sternplanes surface surfaces flap flaps foil "
    "ctrl delta pwm u d input inputs act surf canard wing"
)
"""Words of what may be a fin among others."""
THRUSTERS = word_set("thrust thruster thrusters thr motor motors prop propeller esc jet engine rpm")
"""Words of what turns a vehicle by pushing more on one side."""
STARBOARD = word_set("starboard stbd right s r sb")
SIDES = STARBOARD | word_set(
    "port left p l upper lower top bottom up down t b a c d ul ur ll lr tl tr bl br pu pl su sl ne nw se sw i ii iii iv"
)
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


def are_outputs(family: Family) -> bool:
    """Whether the names are those of servos in a log of topics: what each of them moves is the vehicle's."""
    return all(OUTPUTS & set(words_of(name)) and "topic" in place for name, place in family.items())


def families(inventory: Inventory) -> list[Family]:
    """Return columns, or fields of topics, that are called alike but for a number or a side, as places in a mapping by name."""
    alike: dict[tuple[str, ...], dict[str, Mapping[str, Any]]] = {}
    for name, place in _numbers(inventory):
        kind = _kind(words_of(name))
        if kind is not None:
            alike.setdefault(kind, {})[name] = place
    return [f for f in alike.values() if 1 < len(f) <= MOST or (are_outputs(f) and any(c.isdigit() for c in "".join(f)))]


def _numbers(inventory: Inventory) -> Iterator[tuple[str, Mapping[str, Any]]]:
    """Yield the numbers of a log that its format does not define, by name, with their place."""
    for channel in inventory.channels if inventory.is_named else ():
        for info in channel.fields:
            if info.kind not in ("text", "numbers") and info.means is None:
                if inventory.by_topic:
                    yield f"{channel.name} {info.path}".strip(), {"topic": channel.name, "field": info.path}
                else:
                    yield channel.name, {"column": channel.name}


def _kind(words: list[str]) -> tuple[str, ...] | None:
    """Return what fins of one kind have alike in their names; None for a name that is no fin's, or of one that stands alone."""
    kind = tuple("#" if w.isdigit() or (w in SIDES and (i or len(w) > SHORT)) else w for i, w in enumerate(words))
    is_fin = bool((CALLED | THRUSTERS) & set(kind)) or set(words) <= SIDES
    return kind if is_fin and "#" in kind and not OF_ANOTHER & set(words) else None


def is_thruster(name: str) -> bool:
    """Whether what pushes is called so, and no servo's motor, or by nothing but its side."""
    words = set(words_of(name))
    return (bool(THRUSTERS & words) and not OUTPUTS & words) or words <= SIDES


def is_on_starboard(name: str) -> bool:
    """Whether a thruster is the one on the starboard side, by its name."""
    return is_thruster(name) and bool(STARBOARD & set(words_of(name)))
