"""The hypotheses of a diagnosis as a table, made from its JSON, so that it can also be made from a diagnosis file."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from fieldsid.page import Block
from fieldsid.rounding import Angles, number, probability
from fieldsid.views._words import percent, times

COLUMNS = ("effect", "prob.", "fitted", "unseen", "explained", "evidence")


def candidates(body: Mapping[str, Any], angles: Angles) -> tuple[Block, str]:
    """Return the model as it is and each hypothesis in a row, and what the columns are."""
    rows = [("as it is", "", *_errors(body["base"], body, angles), "", "")]
    rows += [
        (
            c["effect"].replace("+", " +"),
            probability(c["probability"]) if "probability" in c else "",
            *_errors(c, body, angles),
            "worse" if c.get("worse") else percent(c["explained"]) if "explained" in c else "",
            f"{c['log_evidence']:+z.0f}" if "log_evidence" in c else "",
        )
        for c in body["candidates"]
    ]
    of = f"in {angles.unit} and {angles.unit}/s, in logs with next to no noise"
    if not body.get("noiseless"):
        sides, floor = body["base"].values(), body["noise_floor"]
        channels = (("angle_rad", "angle_rms_rad", angles.unit), ("rate_rad_s", "rate_rms_rad_s", f"{angles.unit}/s"))
        logged = [(floor[name] or 0.0, unit) for name, rms, unit in channels if any(number(side[rms]) != "-" for side in sides)]
        of = f"over the noise floor, {' and '.join(f'{number(angles.factor * value, 2)} {unit}' for value, unit in logged)}"
    return (
        Block("", tuple(rows), COLUMNS),
        f"fitted, unseen: free-run error of those runs {of}; evidence: log, over the first row",
    )


def _errors(sides: Mapping[str, Any], body: Mapping[str, Any], angles: Angles) -> tuple[str, ...]:
    """Return the errors on fitted and on unseen runs: over the noise floor, or in their units without noise."""
    from fieldsid.comparison.sufficient import over_noise

    def in_words(errors: Mapping[str, float | None]) -> str:
        if not body.get("noiseless"):
            return times(over_noise(errors, body["noise_floor"]))
        known = (number(None if rms is None else angles.factor * rms, 2) for rms in errors.values())
        return ", ".join(k for k in known if k != "-")

    return in_words(sides["train"]), in_words(sides["validation"])
