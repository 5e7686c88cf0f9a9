"""The sentences of a diagnosis, each with its number."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np

from fieldsid.diagnosis.evidence.acceptance import validation_error_ratio, worst_error
from fieldsid.diagnosis.evidence.scored_model import ScoredModel
from fieldsid.diagnosis.records import Errors, Left, Pair
from fieldsid.diagnosis.residual_tests.residual_tests import ResidualTests
from fieldsid.diagnosis.search.search import Search
from fieldsid.diagnosis.search.whole_hull import HULLS_OWN
from fieldsid.diagnosis.thresholds import (
    EQUAL_ERROR_RATIO,
    MAX_ERROR_RATIO,
    MAX_VALIDATION_ERROR_RATIO,
    MIN_P_VALUE,
    SUFFICIENT_ERROR_RATIO,
)
from fieldsid.diagnosis.verdict import Verdict, excess_explained, names_added, worsens
from fieldsid.models.effect import effect_named, variant_of
from fieldsid.models.model import Noise

DISTURBED = 1e-5
"""Disturbance moment, in rad/s^2, above which the report mentions it."""


def evidence(search: Search, h: ScoredModel, errors: Pair, floor: Noise, gain: float) -> str:
    """Return what speaks for or against a model with these errors and this log evidence over the base, in one sentence."""
    base = search.base()
    kind = "unseen runs" if search.validation else "the runs it was fitted to"
    before, after = (m.selection_errors for m in (base, h))
    size = (
        f"{before.sized()} -> {after.sized()}"
        if search.is_noiseless
        else f"{before.over(floor):.2f} -> {after.over(floor):.2f} x noise floor"
    )
    fall = f"error on {kind} {size}"
    share = f"{fall} ({100 * excess_explained(search, h, floor):.0f} % of the excess)"
    said = f"makes it worse: {fall}" if worsens(search, h, floor) else share
    lower, total = lower_on(errors, base.errors, floor)
    return f"{said}; log evidence {gain:+.1f}; error lower on {lower} of {total} runs"


def lower_on(errors: Pair, base: Pair, floor: Noise) -> tuple[int, int]:
    """Return on how many training and validation runs the error falls by more than EQUAL_ERROR_RATIO, and of how many."""
    pairs = list(zip((*errors.train.each, *errors.validation.each), (*base.train.each, *base.validation.each), strict=True))
    return sum(EQUAL_ERROR_RATIO * now.over(floor) < was.over(floor) for now, was in pairs), len(pairs)


@dataclass(frozen=True, slots=True)
class Sentence:
    """The verdict in a sentence: in full, with what each effect does, and in short, with the effects by their names alone."""

    full: str
    short: str


def headline(
    search: Search, verdict: Verdict, found: ScoredModel, tests: ResidualTests, left: Left, floor: Noise, noise: Noise
) -> Sentence:  # fmt: skip
    """Return the verdict in a sentence."""
    if verdict.word in ("effect", "undecided"):
        return _named(search, verdict, found, left, floor)
    error, base = found.selection_errors.over(floor), sized(search, search.base(), floor)
    if verdict.word == "sufficient":
        tail = f"; a disturbance of {noise.disturbance:.2g} rad/s^2 is there" if noise.disturbance > DISTURBED else ""
        says = f"nothing to add: the model predicts {_judged(search)} at {error:.2f} x the noise floor{tail}"
    elif verdict.word == "disturbed":
        says = _disturbed(search, found, floor, noise, base)
    else:
        says = _unexplained(search, found, tests, floor, noise)
    return Sentence(says, says)


def _judged(search: Search) -> str:
    return "unseen runs" if search.validation else "the runs it was fitted to"


def _disturbed(search: Search, found: ScoredModel, floor: Noise, noise: Noise, base: str) -> str:
    minor = names_added(search, found)
    if not minor:
        return f"no effect of the catalogue is missing: what is left, {base}, is {_disturbance(noise)}"
    leaves = "leaves" if len(minor) == 1 else "leave"
    beside = f"{' and '.join(minor)} may be there besides, and {leaves} {sized(search, found, floor)}"
    return f"what is left, {base}, is for the most part {_disturbance(noise)}; {beside}"


def _named(search: Search, verdict: Verdict, found: ScoredModel, left: Left, floor: Noise) -> Sentence:
    """Return what was found, apart from what every hull has; how the error falls with it; and what is left besides."""
    unusual, own = apart_from_the_hulls_own(verdict.effects)
    with_own = f"with the hull's own {', '.join(own)}" if own else ""
    names = " ".join(part for part in (" and ".join(unusual), with_own) if part) if unusual else " and ".join(own)
    held = {c.name for e in found.effects for c in e.coefficients}
    says = "; ".join(what_it_does(n, held) for n in (*unusual, *own))
    fall = _fall(search, found, floor, _judged(search))
    if verdict.word == "undecided":
        others = {"+".join(names_added(search, r)): r for r in verdict.rivals}
        ended = (f", to {sized(search, r, floor)} with {n}" for n, r in others.items() if len(r.names) > len(found.names))
        both = f"{names} or {', '.join(others)}: these data cannot tell them apart; with {names} {fall}{''.join(ended)}"
        return Sentence(both, both)
    rest = "" if search.is_noiseless else _rest(left)
    return Sentence(f"{names} ({says}): {fall}{rest}", f"{names}: {fall}{rest}")


def apart_from_the_hulls_own(effects: Sequence[str]) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the effects that are unusual, and those that every hull has."""
    return tuple(n for n in effects if n not in HULLS_OWN), tuple(n for n in effects if n in HULLS_OWN)


def _rest(left: Left) -> str:
    """Return what is left that nothing in the catalogue explains, and where; empty where nothing is."""
    if not left.unexplained:
        return ""
    follows = f", and moves with {left.moves_with}" if left.moves_with else ""
    return f"; {left.ratio:.2g} x is left that nothing in the catalogue explains: it is largest in {left.where}{follows}"


def _unexplained(search: Search, found: ScoredModel, left: ResidualTests, floor: Noise, noise: Noise) -> str:
    """Return what is missing and no effect of the catalogue explains: its size, what takes a part of it, where it is largest.

    What it moves with is said where a test says so, and that it may be a disturbance where none speaks against one.
    """
    worse = validation_error_ratio(search.base(), search.floor)
    lowers = found.selection_errors.mean < search.base().selection_errors.mean
    partly = f", {sized(search, found, floor)} with {' and '.join(names_added(search, found))}" if lowers else ""
    when = f"{left.worst_start_s:.0f}-{left.worst_end_s:.0f} s ({left.worst_ratio:.1f} x the average)"
    where = f"{'what is left' if lowers else 'it'} is largest in {left.worst_run} at {when}"
    follows = f" and moves with {left.moves_with}" if 3.0 * left.dependence < MIN_P_VALUE else ""
    passes = left.p >= MIN_P_VALUE and noise.disturbance > DISTURBED
    calm = f"; the tests do not tell it from {_disturbance(noise)}" if passes else ""
    unseen = f"; unseen runs are {worse:.1f} times worse than the fitted ones" if worse > MAX_VALIDATION_ERROR_RATIO else ""
    return (
        f"no effect of the catalogue explains what is missing: error {sized(search, search.base(), floor)}{partly}; "
        f"{where}{follows}{calm}{unseen}{_would_end(search, found, floor)}"
    )


def _would_end(search: Search, found: ScoredModel, floor: Noise) -> str:
    """Return which set of effects ends the error on all runs although another is likelier; empty where none does."""
    if search.is_noiseless:
        return ""
    sums = search.evidences()

    def reached(h: ScoredModel) -> float:
        return sums.get(frozenset(h.names), -np.inf)

    likely = [h for h in search.ranked() if h is not found and reached(h) > sums[search.root]]
    ending = [h for h in likely if worst_error(h, floor) <= SUFFICIENT_ERROR_RATIO]
    if not ending:
        return ""
    best = max(ending, key=reached)
    less = sums[frozenset(found.names)] - reached(best)
    return f"; {'+'.join(names_added(search, best))} leaves {sized(search, best, floor)}, but is {less:.0f} log units less likely"


def _fall(search: Search, found: ScoredModel, floor: Noise, runs: str) -> str:
    """Return how the error falls with a model's effects, on the validation runs where it clearly does there.

    Where the fitted runs' numbers hardly lower it, those of all runs together may; else it is the fitted runs that tell.
    """
    base = search.base()

    def falls(before: Errors, after: Errors) -> bool:
        return after.over(floor) < MAX_ERROR_RATIO * before.over(floor)

    def size(before: Errors, after: Errors) -> str:
        if search.is_noiseless:
            return f"from {before.sized()} to {after.sized()}"
        return f"from {before.over(floor):.2f} to {after.over(floor):.2f} x the noise floor"

    selected = base.selection_errors, found.selection_errors
    if not search.validation or falls(*selected):
        return f"the error on {runs} falls {size(*selected)}"
    settled = base.unseen_errors[-1], found.unseen_errors[-1]
    if falls(*settled):
        alone = f"with the fitted runs' own it goes {size(*selected)}"
        return f"with the numbers of all runs together the error on {runs} falls {size(*settled)}; {alone}"
    return f"the error on the fitted runs goes {size(base.train, found.train)}, that on {runs} {size(*selected)}"


def _disturbance(noise: Noise) -> str:
    """Return what disturbs in words: a moment on the hull, or sensors that wander."""
    if noise.disturbance > DISTURBED:
        lasts = f"{noise.disturbance:.2g} rad/s^2 with a time constant of {noise.disturbance_time:.2g} s"
        return f"a disturbance moment of {lasts} that does not follow the fin or the motion"
    wander = f"{noise.coloured_angle:.2g} rad and {noise.coloured_rate:.2g} rad/s"
    return f"sensors that wander by {wander} with a time constant of {noise.coloured_time:.2g} s"


def what_it_does(name: str, held: Collection[str]) -> str:
    """Return what an effect does in a model that holds these coefficients, with its variant where it is not the textbook's."""
    effect = effect_named(name)
    form = variant_of(effect, held)
    return effect.says if form is None else f"{effect.says}: {form.says}"


def sized(search: Search, h: ScoredModel, floor: Noise) -> str:
    """Return a model's selection error in words: over the noise floor, or in its units where logs show almost no noise."""
    errors = h.selection_errors
    return errors.sized() if search.is_noiseless else f"{errors.over(floor):.2f} x the noise floor"
