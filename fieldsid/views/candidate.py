"""A candidate of a diagnosis: its effects, how probable they are, and the evidence."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fieldsid.display import Frames, View
from fieldsid.page import Block, Page, cut, facts
from fieldsid.rounding import number, probability
from fieldsid.views._words import percent, table
from fieldsid.views.diagnosis import candidate_row

if TYPE_CHECKING:
    from fieldsid.diagnosis import Candidate


def line(c: Candidate) -> str:
    """Return effects, probability and evidence."""
    return f"{c.effect}: probability {probability(c.probability)}; {cut(c.evidence, 250)}"


def page(c: Candidate) -> Page:
    """Return the evidence and the parameters."""
    known = facts(
        "Statistics",
        (
            ("probability", probability(c.probability)),
            ("explained", f"{percent(c.explained)} of the error above the noise floor"),
            ("evidence", c.evidence),
            ("confusable with", ", ".join(c.confusable_with)),
        ),
    )
    parameters = Block("Parameters", tuple((n, number(v)) for n, v in c.parameters.items()))
    return Page(f"Candidate {c.effect}", (), (known, parameters))


def frames(c: Candidate) -> Frames:
    """Return the candidate in one row, and its parameters."""
    return {
        "candidate": lambda: table([candidate_row(c)], "effect"),
        "parameters": lambda: table(({"parameter": n, "value": v} for n, v in c.parameters.items()), "parameter"),
    }


VIEW = View("candidate", line, page, frames, lambda c: c.effect)
