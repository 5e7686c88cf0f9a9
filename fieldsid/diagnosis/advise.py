"""What to fly next: the maneuver that would tell the rivals apart, or show what these runs could not."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from fieldsid.diagnosis.hypothesis import Hypothesis
from fieldsid.diagnosis.search import Search
from fieldsid.diagnosis.verdict import VISIBLE, Verdict
from fieldsid.errors import FieldsidError
from fieldsid.models.effect import effect_named
from fieldsid.models.model import Noise

MOST_RIVALS = 3
DECIDES = 3.0
"""Log odds below which a maneuver is not worth a dive: 20 to 1 for the right one."""


def next_maneuver(
    search: Search, verdict: Verdict, found: Hypothesis, skipped: Mapping[str, str], floor: Noise
) -> dict[str, Any] | None:
    """Return what to fly next; None where nothing is open.

    Rivals: the maneuver inside the fin angles already flown whose refitted predictions stay furthest apart. A signal that the
    logs lack is missed only where the effects named leave something above the noise floor.
    """
    if verdict.word == "undecided":
        return _deciding(search, [found, *verdict.rivals][:MOST_RIVALS])
    if verdict.word == "unexplained":
        return {
            "maneuver": "repeat the run",
            "why": "what comes back at the same fin is the vehicle, what does not is the sea or a fault",
        }
    left = found.judging.over(floor)
    if skipped and verdict.word == "effect" and left > VISIBLE:
        name = min(skipped)
        why = f"{left:.2f} x the noise floor is left, and {name} could not be tried: {skipped[name]}"
        return {"maneuver": "log the missing signal", "why": why}
    return None


def _deciding(search: Search, rivals: list[Hypothesis]) -> dict[str, Any]:
    from fieldsid.planning.discriminate import separate
    from fieldsid.planning.envelope import LARGEST_FIN, Envelope

    names = list(dict.fromkeys(n for h in rivals for n in h.names if n not in search.known))
    command = {"separates": names, "command": f"sysid plan --separate {','.join('+'.join(h.names) for h in rivals)}"}
    fin = min(max(float(np.max(np.abs(r.fin - np.median(r.fin)))) for r in search.records), LARGEST_FIN)
    speeds = [r.speed for r in search.records if np.isfinite(r.speed)]
    try:
        found = separate(
            [h.own_model for h in rivals], Envelope(fin), speeds=(float(np.median(speeds)) if speeds else 1.0,), fast=True
        )
    except FieldsidError as error:
        # nothing inside the limits separates them: what the effects themselves declare is still worth flying
        return {**_declared(names), **command, "note": error.what}
    odds = found.expected_log_odds
    if odds < DECIDES:
        tried = f"no maneuver inside the fin angles flown is expected to give log odds of more than {odds:.1f} for the right one"
        return {**_declared(names), **command, "expected_log_odds": odds, "note": tried}
    return {**found.plain(), **command, "why": f"expected log odds {odds:.0f} for the right one"}


def _declared(names: list[str]) -> dict[str, Any]:
    """Return the maneuver that excites most of some effects, by their own declarations."""
    votes: dict[str, int] = {}
    for name in names:
        for rank, maneuver in enumerate(effect_named(name).excited_by):
            votes[maneuver] = votes.get(maneuver, 0) + 10 - rank
    best = max(votes, key=lambda m: votes[m])
    return {"maneuver": best, "why": f"it excites {', '.join(n for n in names if best in effect_named(n).excited_by)}"}
