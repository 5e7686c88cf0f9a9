"""What a name in somebody's log probably means: the rule of the vocabulary that most of its words keep."""

from __future__ import annotations

import re

from fieldsid.logs.channels import ANGLES
from fieldsid.logs.doctor.angle_and_rate import PAIRS
from fieldsid.logs.mapping.canonical_names import canonical, unit_said, words_of
from fieldsid.logs.mapping.vocabulary import COMMANDED, EULER, OF_ANOTHER, PHRASES, Span, is_abbreviation, of_use, part_of, weight

RATES = dict(PAIRS)
"""What an angle's name means beside the unit of a rate, as `yaw_deg_s`."""
CANONICAL, STANDARD = 9, 8
"""What a canonical name, and a part of a standard message, is as sure as."""


def meaning_of(name: str, span: Span | None = None) -> tuple[str, int] | None:
    """Return the signal a name probably means, with the least and largest of its numbers, and how sure that is; or None."""
    said = canonical(name)
    if said is not None:
        return said.signal, CANONICAL
    words = words_of(name)
    part = part_of(name.strip())
    if part is not None and not COMMANDED & set(words) and (part not in ANGLES or EULER & set(words)):
        return part, STANDARD
    scored = [(score, rule) for rule, phrase in PHRASES if (score := weight(rule, phrase, words)) > 0]
    held = [(score, rule) for score, rule in scored if span is None or rule.holds(span)]
    best = max(held, key=lambda found: found[0], default=None)
    if best is None or OF_ANOTHER & set(words) or best[1].unless & set(words):
        return None
    if best[0] == 2 and is_abbreviation(words_of(re.split(r"[/ .]", name.strip())[-1])):
        return None
    signal = best[1].signal
    is_rate = signal in RATES and unit_said(name, ("angle",)) is None and unit_said(name, ("angle rate",)) is not None
    return of_use(RATES[signal] if is_rate else signal, best[0], set(words))
