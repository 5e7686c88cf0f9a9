"""What to fly next: the maneuver that would tell the rivals apart, or show what these runs could not."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from fieldsid.diagnosis.hypothesis import Hypothesis
from fieldsid.diagnosis.search import Search
from fieldsid.diagnosis.verdict import Verdict
from fieldsid.models.effect import effect_named


def next_maneuver(search: Search, verdict: Verdict, found: Hypothesis, skipped: Mapping[str, str]) -> dict[str, Any] | None:
    """Return a maneuver by the effects' own declarations of what excites them; None where nothing is open."""
    if verdict.word == "undecided":
        names = [n for h in (found, *verdict.rivals) for n in h.names if n not in search.known]
        apart = list(dict.fromkeys(names))
        return {"separates": apart, **_maneuver(apart), "command": f"sysid plan --separate {','.join(apart[:3])}"}
    if verdict.word == "unexplained":
        return {
            "maneuver": "repeat the run",
            "why": "what comes back at the same fin is the vehicle, what does not is the sea or a fault",
        }
    if skipped:
        name = min(skipped)
        return {"maneuver": "log the missing signal", "why": f"{name} could not be tried: {skipped[name]}"}
    return None


def _maneuver(names: list[str]) -> dict[str, Any]:
    """Return the maneuver that excites most of some effects."""
    votes: dict[str, int] = {}
    for name in names:
        for rank, maneuver in enumerate(effect_named(name).excited_by):
            votes[maneuver] = votes.get(maneuver, 0) + 10 - rank
    best = max(votes, key=lambda m: votes[m])
    return {"maneuver": best, "why": f"it excites {', '.join(n for n in names if best in effect_named(n).excited_by)}"}
