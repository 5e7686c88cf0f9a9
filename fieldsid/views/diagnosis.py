"""A diagnosis: the verdict in its own words, the candidates with their errors, where the model fails, what to fly next."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

from fieldsid.display import View
from fieldsid.page import Block, Page, cut, facts, listed
from fieldsid.rounding import number, probability
from fieldsid.views._words import (
    counted,
    joined,
    pair_row,
    parameter_rows,
    percent,
    table,
    times,
    warned,
    where_block,
    where_rows,
)

if TYPE_CHECKING:
    from pandas import DataFrame

    from fieldsid.diagnosis import Candidate, Diagnosis, Pair


def line(found: Diagnosis) -> str:
    """Return axis, verdict and its sentence."""
    return f"{found.axis.value}, {found.verdict}: {joined(cut(found.says, 280), counted(len(found.notes), 'note'))}"


def page(found: Diagnosis) -> Page:
    """Return the verdict, the candidates after the model as it is, where that fails, and what to fly next."""
    floor = found.noise_floor
    rows = [("model as it is", "", *_errors(found, found.base), "", ""), *(_row(c, found) for c in found.candidates)]
    of = "in rad and rad/s, in logs with next to no noise" if found.noiseless else "over the noise floor"
    heads = ("", "probability", "fitted", "unseen", "explained", "log evidence")
    next_ = found.next_maneuver
    known = facts(
        "Statistics",
        (
            ("verdict", found.verdict),
            ("effects", listed(found.effects) or "none"),
            ("noise floor", f"{number(floor.angle, 3)} rad and {number(floor.rate, 3)} rad/s"),
            ("not tried", "; ".join(f"{n}: {why}" for n, why in found.skipped.items())),
            ("fly next", f"{next_.maneuver}, {next_.why}" if next_ else ""),
        ),
    )
    blocks = (
        known,
        Block(f"Candidates (fitted, unseen: free-run error of those runs {of})", tuple(rows), heads),
        where_block("Where the model as it is fails", found.where),
    )
    return Page(f"Diagnosis of the {found.axis.value} axis: {found.says}", warned(found.notes), blocks)


def frames(found: Diagnosis) -> Mapping[str, Callable[[], DataFrame]]:
    """Return the candidates, where the model as it is fails, and the parameters of the model with the named effects."""
    return {
        "candidates": lambda: table(map(candidate_row, found.candidates), "effect"),
        "where": lambda: table(where_rows(found.where)),
        "parameters": lambda: table(parameter_rows(found.model), "parameter"),
    }


def figures(found: Diagnosis) -> Mapping[str, Callable[[], Any]]:
    """Return the candidates' errors, and where the model fails."""
    from fieldsid.figures.diagnose import figure

    return {"candidates": lambda: figure(found)}


def candidate_row(c: Candidate) -> dict[str, Any]:
    """Return a candidate as a row of a table."""
    return {
        "effect": c.effect,
        "probability": c.probability,
        **pair_row(c.errors),
        "explained": c.explained,
        "log_evidence": c.score,
        "evidence": c.evidence,
        "confusable_with": ", ".join(c.confusable_with),
    }


def _row(c: Candidate, found: Diagnosis) -> tuple[str, ...]:
    return (c.effect, probability(c.probability), *_errors(found, c.errors), percent(c.explained), f"{c.score:+z.0f}")


def _errors(found: Diagnosis, pair: Pair) -> tuple[str, ...]:
    """Return the errors on fitted and on unseen runs: over the noise floor, or in their units without noise."""
    sides = (pair.train, pair.validation)
    return tuple(e.sized() if found.noiseless else times(e.over(found.noise_floor)) for e in sides)


VIEW = View("diagnosis", line, page, frames, lambda found: found.axis.value, figures)
