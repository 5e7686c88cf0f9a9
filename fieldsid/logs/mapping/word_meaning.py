"""What a name in somebody's log probably means: the rule of the vocabulary that most of its words keep."""

from __future__ import annotations

import re

from fieldsid.logs.channels import ANGLES
from fieldsid.logs.doctor.angle_and_rate import PAIRS
from fieldsid.logs.mapping.canonical_names import canonical, unit_said, words_of
from fieldsid.logs.mapping.vocabulary import (
    COMMANDED,
    EULER,
    GREEK,
    GROUNDED,
    MEASURED,
    MOST_BESIDE_GREEK,
    OF_ANOTHER,
    OVER_GROUND,
    PHRASES,
    SEEN,
    VECTORS,
    WANTED,
    Rule,
    Span,
)
from fieldsid.logs.run import GOALS

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
    scored = [(score, rule) for rule, phrase in PHRASES if (score := _score(rule, phrase, words)) > 0]
    held = [(score, rule) for score, rule in scored if span is None or rule.holds(span)]
    best = max(held, key=lambda found: found[0], default=None)
    if best is None or OF_ANOTHER & set(words) or best[1].unless & set(words):
        return None
    own = words_of(re.split(r"[/ .]", name.strip())[-1])
    if best[0] == 2 and GREEK & set(own) and len(own) > MOST_BESIDE_GREEK + 1:
        return None
    signal = best[1].signal
    is_rate = signal in RATES and unit_said(name, ("angle",)) is None and unit_said(name, ("angle rate",)) is not None
    return _of_use(RATES[signal] if is_rate else signal, best[0], set(words))


def part_of(path: str) -> str | None:
    """Return the signal of one part of a standard message's vector, as in `twist.twist.angular.z`; None of any other."""
    parent, _, last = path.rpartition(".")
    vector = VECTORS.get(re.split(r"[. ]", parent)[-1])
    return None if vector is None or last not in ("x", "y", "z") else vector["xyz".index(last)]


def _score(rule: Rule, phrase: tuple[str, ...], words: list[str]) -> int:
    """Return what a phrase weighs of which a name holds all words: two each, and one where it is all there is."""
    if rule.alone:
        return int(words == list(phrase))
    return 2 * len(phrase) if all(p in words for p in phrase) else 0


def _of_use(signal: str, sure: int, words: set[str]) -> tuple[str, int] | None:
    """Return a signal as what it was wanted to be or what it was, and how sure its words make it."""
    if COMMANDED & words:
        return (WANTED[signal], sure + (WANTED[signal] in GOALS and "next" not in words)) if signal in WANTED else None
    if signal in GROUNDED and OVER_GROUND & words:
        return signal, 1
    sure += (("true" in words) - ("magnetic" in words)) * (signal in ("yaw_rad", "surge_m_s"))
    return SEEN.get(signal, signal) if MEASURED & words else signal, sure
