"""A diagnosis: the verdict in words, the candidates with their errors, where the model fails, what to fly next."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from fieldsid.display import Figures, Frames, View
from fieldsid.figures.sketch import sketch
from fieldsid.page import Block, Page, cut, paragraph
from fieldsid.records.keys import body_of
from fieldsid.rounding import RADIANS, Angles
from fieldsid.views._candidates import candidates
from fieldsid.views._words import joined, parameter_rows, some, table, warned, where_block

if TYPE_CHECKING:
    from fieldsid.diagnosis import Candidate, Diagnosis

MOST_PLACES, MOST_SPOKEN = 5, 3


def line(found: Diagnosis) -> str:
    """Return axis, verdict and its sentence."""
    return f"{found.axis.value}, {found.verdict}: {joined(cut(found.says, 280), some(len(found.notes), 'note'))}"


def page(found: Diagnosis, angles: Angles = RADIANS) -> Page:
    """Return the candidates after the model as it is, what is named, where the model as it is fails, and what to fly next."""
    fly = found.next_maneuver
    settle = f"\nwhat would settle it: {fly.maneuver}, {fly.why}{f'; {fly.note}' if fly.note else ''}" if fly else ""
    where = where_block("where the model as it is fails", found.where, angles, MOST_PLACES)
    blocks: tuple[Block | str, ...] = (*candidates(body_of(found), angles), *_words(found), where, *_not_tried(found), settle)
    converted = tuple(b if isinstance(b, Block) else angles.words(b) for b in blocks)
    return Page(f"Diagnosis of the {found.axis.value} axis, {found.verdict}: {found.says}", warned(found.notes), converted)


def _words(found: Diagnosis) -> Iterator[str]:
    """Yield what each named effect does, what it may be confused with, and the evidence for what is not in the verdict."""
    from fieldsid.diagnosis import what_it_does
    from fieldsid.diagnosis.thresholds import RIVAL_PROBABILITY_RATIO

    if found.verdict in ("sufficient", "disturbed"):
        return
    lines = [f"{name}: {what_it_does(name, found.model.values)}" for name in found.effects]
    for i, c in enumerate(found.candidates[:MOST_SPOKEN]):
        if i and c.probability < RIVAL_PROBABILITY_RATIO:
            continue
        if found.verdict != "effect" or i:
            lines.append(f"{c.effect}: {c.evidence}")
        if c.confusable_with:
            lines.append(f"on these data nearly as good as {c.effect}: {', '.join(c.confusable_with)}")
    yield from paragraph(lines)


def _not_tried(found: Diagnosis) -> Iterator[str]:
    why: dict[str, list[str]] = {}
    for name, reason in found.skipped.items():
        why.setdefault(reason, []).append(name)
    yield from paragraph([f"not tried: {', '.join(names)}: {reason}" for reason, names in why.items()])


def frames(found: Diagnosis) -> Frames:
    """Return the candidates, where the model as it is fails, and the parameters of the model with the named effects."""
    return {
        "candidates": lambda: table(map(candidate_row, found.candidates), "effect"),
        "where": lambda: table(map(body_of, found.where)),
        "parameters": lambda: table(parameter_rows(found.model), "parameter"),
    }


def candidate_row(c: Candidate) -> dict[str, Any]:
    """Return a candidate as a row of a table."""
    return {
        "effect": c.effect,
        "probability": c.probability,
        **{
            f"{side}_{n}": v
            for side, e in (("fitted", c.errors.train), ("unseen", c.errors.validation))
            for n, v in body_of(e).items()
        },
        "explained": c.explained,
        "log_evidence": c.score,
        "evidence": c.evidence,
        "confusable_with": ", ".join(c.confusable_with),
    }


def figures(found: Diagnosis) -> Figures:
    """Return the candidates' errors, and where the model fails."""
    return {"candidates": sketch("diagnose", found)}


VIEW = View("diagnosis", line, page, frames, lambda found: found.axis.value, figures)
