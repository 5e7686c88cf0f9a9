"""What a name in somebody's log probably means: the rule of the vocabulary that most of its words keep."""

from __future__ import annotations

import re

from fieldsid.logs.mapping.canonical_names import canonical
from fieldsid.logs.mapping.name_words import unit_said, words_of
from fieldsid.logs.mapping.vocabulary import (
    COMMANDED,
    GREEK,
    LATITUDE,
    LONGITUDE,
    MEASURED,
    MOST_BESIDE_GREEK,
    OF_ANOTHER,
    OVER_GROUND,
    PHRASES,
    TIME,
    Rule,
    Span,
)

_FINS = {"rudder_rad": "rudder_measured_rad", "elevator_rad": "elevator_measured_rad"}
_GOALS = {"yaw_rad": "yaw_goal_rad", "pitch_rad": "pitch_goal_rad"}
RATES = {"yaw_rad": "yaw_rate_rad_s", "pitch_rad": "pitch_rate_rad_s", "roll_rad": "roll_rate_rad_s"}
"""What an angle's name means beside the unit of a rate, as `yaw_deg_s`."""
CANONICAL = 9
"""What a canonical name is as sure as."""


def meaning_of(name: str, span: Span | None = None) -> tuple[str, int] | None:
    """Return the signal a name probably means, with the least and largest of its numbers, and how sure that is; or None."""
    said = canonical(name)
    if said is not None:
        return said.signal, CANONICAL
    words = words_of(name)
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


def _score(rule: Rule, phrase: tuple[str, ...], words: list[str]) -> int:
    """Return what a phrase weighs of which a name holds all words: two each, and one where it is all there is."""
    if rule.alone:
        return int(words == list(phrase))
    return 2 * len(phrase) if all(p in words for p in phrase) else 0


def _of_use(signal: str, sure: int, words: set[str]) -> tuple[str, int] | None:
    """Return a signal as what it was wanted to be or what it was, and how sure its words make it."""
    if signal in _FINS and MEASURED & words and not COMMANDED & words:
        return _FINS[signal], sure
    if COMMANDED & words and signal in _GOALS:
        return _GOALS[signal], sure + ("next" not in words)
    if COMMANDED & words and signal not in (*_FINS, "thrust", "propeller_rpm", TIME):
        return None
    if signal in ("yaw_rad", "surge_m_s"):
        sure += ("true" in words) - ("magnetic" in words)
    if signal in ("yaw_rad", "surge_m_s", LATITUDE, LONGITUDE):
        sure = 1 if OVER_GROUND & words else sure
    return signal, sure
