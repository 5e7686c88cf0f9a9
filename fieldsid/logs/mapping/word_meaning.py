"""The probable meaning of a name in a log: the rule of the vocabulary that matches most of its words."""

from __future__ import annotations

import re

from fieldsid.logs.channels import ANGLES
from fieldsid.logs.doctor.angle_and_rate import PAIRS
from fieldsid.logs.mapping.canonical_names import canonical, stated_unit, unit_among_words, words_of
from fieldsid.logs.mapping.vocabulary import (
    COMMANDED,
    EULER,
    OF_ANOTHER,
    PHRASES,
    Span,
    as_command_or_measurement,
    is_abbreviation,
    part_of,
    weight,
)

RATES = dict(PAIRS)
"""The rate that the name of an angle means together with the unit of a rate, as in `yaw_deg_s`."""
CANONICAL, STANDARD = 9, 8
"""Scores of a canonical name and of a component of a standard message, comparable with those of rules."""


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
    has_unit_of_rate = unit_among_words(name, ("angle rate",)) is not None or (
        signal in RATES and unit_text is not None and stated_unit(unit_text, RATES[signal]) is not None
    )
    is_rate = signal in RATES and unit_among_words(name, ("angle",)) is None and has_unit_of_rate
    return as_command_or_measurement(RATES[signal] if is_rate else signal, best[0], set(words))
