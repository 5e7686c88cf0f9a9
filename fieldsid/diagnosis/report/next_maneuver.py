"""The next maneuver: one that separates the rivals, a repetition, or a run with a missing signal logged."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from fieldsid.diagnosis.evidence.scored_model import ScoredModel
from fieldsid.diagnosis.records import NextManeuver
from fieldsid.diagnosis.report.report_text import sized
from fieldsid.diagnosis.search.search import Search
from fieldsid.diagnosis.thresholds import RIVAL_LOG_ODDS, SUFFICIENT_ERROR_RATIO
from fieldsid.diagnosis.verdict import Verdict, names_added
from fieldsid.errors import FieldsidError
from fieldsid.models.effect import effect_named
from fieldsid.models.model import Noise
from fieldsid.records.keys import body_of

MOST_RIVALS = 3


def next_maneuver(
    search: Search, verdict: Verdict, found: ScoredModel, skipped: Mapping[str, str], floor: Noise
) -> NextManeuver | None:
    """Return the next maneuver; None where no question is open.

    For rivals it is the maneuver, within the fin angles already flown, whose refitted predictions differ most. A missing signal
    is requested only where the named effects leave an error above the noise floor.
    """
    if verdict.word == "undecided":
        return _separating_maneuver(search, [found, *verdict.rivals][:MOST_RIVALS])
    if verdict.word == "unexplained":
        return NextManeuver(
            "repeat the run", "what comes back at the same fin is the vehicle, what does not is the sea or a fault"
        )
    left = found.selection_errors.over(floor)
    if skipped and verdict.word == "effect" and left > SUFFICIENT_ERROR_RATIO:
        name = min(skipped)
        why = f"an error of {sized(search, found, floor)} is left, and {name} could not be tried: {skipped[name]}"
        return NextManeuver("log the missing signal", why)
    return None


def _separating_maneuver(search: Search, rivals: list[ScoredModel]) -> NextManeuver:
    from fieldsid.planning.discriminate.discriminate import separate
    from fieldsid.planning.safety.envelope import LARGEST_FIN, Envelope

    names = list(dict.fromkeys(n for h in rivals for n in names_added(search, h)))
    command: dict[str, Any] = {
        "separates": tuple(names),
        "command": f"sysid plan --separate {','.join('+'.join(h.names) for h in rivals)}",
    }
    fin = min(max(float(np.max(np.abs(r.fin - np.median(r.fin)))) for r in search.records), LARGEST_FIN)
    speeds = [r.speed for r in search.records if np.isfinite(r.speed)]
    try:
        speed = float(np.median(speeds)) if speeds else 1.0
        models = [h.likelihood_model for h in rivals]
        found = separate(models, Envelope(fin), speed=speed, fast=True, mapped=search.parallel.map)
    except FieldsidError as error:
        # no maneuver inside the limits separates them: propose one that the effects declare to excite them
        return NextManeuver(*_declared_maneuver(names), **command, note=error.what)
    odds = found.expected_log_odds
    if odds < RIVAL_LOG_ODDS:
        tried = f"no maneuver inside the fin angles flown is expected to give log odds of more than {odds:.1f} for the right one"
        return NextManeuver(*_declared_maneuver(names), **command, expected_log_odds=odds, note=tried)
    return NextManeuver(why=f"expected log odds {odds:.0f} for the right one", **body_of(found), **command)


def _declared_maneuver(names: list[str]) -> tuple[str, str]:
    """Return the maneuver that most of the effects declare to excite them, and the reason in words."""
    votes: dict[str, int] = {}
    for name in names:
        for rank, maneuver in enumerate(effect_named(name).excited_by):
            votes[maneuver] = votes.get(maneuver, 0) + 10 - rank
    best = max(votes, key=lambda m: votes[m])
    return best, f"it excites {', '.join(n for n in names if best in effect_named(n).excited_by)}"
