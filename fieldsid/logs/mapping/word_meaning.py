"""The probable meaning of a name in a log: the rule of the vocabulary that matches most of its words."""

from __future__ import annotations

import re

from fieldsid.logs.mapping.canonical_names import canonical, stated_unit, unit_among_words, words_of
from fieldsid.logs.mapping.vocabulary import (
    COMMANDED,
    CONTROL,
    EULER,
    OF_ANOTHER,
    PHRASES,
    SYMBOLS,
    Span,
    as_command_or_measurement,
    is_abbreviation,
    part_of,
    weight,
)
from fieldsid.logs.run import ANGLES, FINS, MOTORS, RATE_OF

_PREFIXED = re.compile(r"\s*[A-Za-z][_ .]\w{2}")
CANONICAL, STANDARD = 9, 8
"""Scores of a canonical name, as of a field that its format defines, and of a component of a standard message: those of rules
are two for each word."""


def meaning_of(name: str, span: Span | None = None, unit_text: str | None = None) -> tuple[str, int] | None:
    """Return the signal that a name probably means, and its score; None where there is none.

    `span` holds the smallest and largest number of the column. `unit_text` is a unit that the log states beside the name.
    """
    stated = canonical(name)
    if stated is not None:
        return stated.signal, CANONICAL
    words = words_of(name)
    part = part_of(name.strip())
    if part is not None and not COMMANDED & set(words) and (part not in ANGLES or EULER & set(words)):
        return part, STANDARD
    scored = [(score, rule) for rule, phrase in PHRASES if (score := weight(rule, phrase, words)) > 0]
    matching = [(score, rule) for score, rule in scored if span is None or rule.holds(span)]
    best = max(matching, key=lambda found: found[0], default=None)
    if best is None or OF_ANOTHER & set(words) or best[1].unless & set(words):
        return None
    if best[0] == 2 and is_abbreviation(words_of(re.split(r"[/ .]", name.strip())[-1])):
        return None
    signal = best[1].signal
    # the name of an angle with the unit of a rate, as in `yaw_deg_s`, means the rate
    has_unit_of_rate = unit_among_words(name, ("angle rate",)) is not None or (
        signal in RATE_OF and unit_text is not None and stated_unit(unit_text, RATE_OF[signal]) is not None
    )
    is_rate = signal in RATE_OF and unit_among_words(name, ("angle",)) is None and has_unit_of_rate
    meant = RATE_OF[signal] if is_rate else signal
    before = _of_control(name, meant)
    is_actuator = meant in (*FINS, *MOTORS)
    if before == "error" or (before == "command" and not is_actuator):
        return None
    is_side = before == "reference" and is_actuator  # the `r_rudder` beside an `l_rudder`
    return as_command_or_measurement(meant, best[0], {*words, *([] if before is None or is_side else [before])})


def _of_control(name: str, signal: str) -> str | None:
    """Return the meaning of a letter of control before the name of a signal; None without one, and where it is its symbol."""
    letter = words_of(name)[0] if _PREFIXED.match(name) else ""
    return CONTROL.get(letter) if (signal, letter) not in SYMBOLS else None


def is_command(name: str, fin: str) -> bool:
    """Return whether the name of a fin says that it is the command."""
    return bool(COMMANDED & {*words_of(name), _of_control(name, fin)})
