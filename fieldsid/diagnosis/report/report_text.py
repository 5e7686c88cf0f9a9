"""The sentences of a diagnosis, each with its numbers."""

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
    """Return the evidence for or against a model in one sentence; `gain` is its log evidence over the base."""
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
    effect_on_error = f"makes it worse: {fall}" if worsens(search, h, floor) else share
    lower, total = lower_on(errors, base.errors, floor)
    return f"{effect_on_error}; log evidence {gain:+.1f}; error lower on {lower} of {total} runs"


def lower_on(errors: Pair, base: Pair, floor: Noise) -> tuple[int, int]:
    """Return the number of training and validation runs on which the error falls by more than EQUAL_ERROR_RATIO, and of all."""
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
        return _effects_sentence(search, verdict, found, left, floor, _calm(tests, noise))
    error, base = found.selection_errors.over(floor), sized(search, search.base(), floor)
    if verdict.word == "sufficient":
        tail = f"; a disturbance of {noise.disturbance:.2g} rad/s^2 is there" if noise.disturbance > DISTURBED else ""
        says = f"nothing to add: the model predicts {_runs_compared(search)} at {error:.2f} x the noise floor{tail}"
    elif verdict.word == "disturbed":
        says = _disturbed_sentence(search, found, floor, noise, base)
    else:
        says = _unexplained_sentence(search, found, tests, floor, noise)
    return Sentence(says, says)


def _runs_compared(search: Search) -> str:
    return "unseen runs" if search.validation else "the runs it was fitted to"


def _disturbed_sentence(search: Search, found: ScoredModel, floor: Noise, noise: Noise, base: str) -> str:
    minor = names_added(search, found)
    if not minor:
        return f"no effect of the catalogue is missing: what is left, {base}, is {_disturbance(noise)}"
    leaves = "leaves" if len(minor) == 1 else "leave"
    minor_effects = f"{' and '.join(minor)} may be there besides, and {leaves} {sized(search, found, floor)}"
    return f"what is left, {base}, is for the most part {_disturbance(noise)}; {minor_effects}"


def _effects_sentence(
    search: Search, verdict: Verdict, found: ScoredModel, left: Left, floor: Noise, calm: str
) -> Sentence:  # fmt: skip
    """Return the sentence on the effects found, the unusual first, the fall of the error, and the error that remains."""
    unusual, of_every_hull = apart_from_the_hulls_own(verdict.effects)
    with_hull = f"with the hull's own {', '.join(of_every_hull)}" if of_every_hull else ""
    names = " ".join(part for part in (" and ".join(unusual), with_hull) if part) if unusual else " and ".join(of_every_hull)
    coefficients = {c.name for e in found.effects for c in e.coefficients}
    says = "; ".join(what_it_does(n, coefficients) for n in (*unusual, *of_every_hull))
    fall = _error_fall(search, found, floor, _runs_compared(search))
    if verdict.word == "undecided":
        others = {"+".join(names_added(search, r)): r for r in verdict.rivals}
        ended = (f", to {sized(search, r, floor)} with {n}" for n, r in others.items() if len(r.names) > len(found.names))
        both = f"{names} or {', '.join(others)}: these data cannot tell them apart; with {names} {fall}{''.join(ended)}"
        return Sentence(both, both)
    rest = _unexplained_rest(left, f"{left.ratio:.2g} x is" if not search.is_noiseless else "an error is", calm)
    return Sentence(f"{names} ({says}): {fall}{rest}", f"{names}: {fall}{rest}")


def apart_from_the_hulls_own(effects: Sequence[str]) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the unusual effects, and the effects that every hull has."""
    return tuple(n for n in effects if n not in HULLS_OWN), tuple(n for n in effects if n in HULLS_OWN)


def _unexplained_rest(left: Left, remains: str, calm: str) -> str:
    """Return the clause on what no effect of the catalogue explains, and where it is; empty without such an error."""
    if not left.unexplained:
        return ""
    follows = f", and moves with {left.moves_with}" if left.moves_with else ""
    return f"; {remains} left that nothing in the catalogue explains: it is largest in {left.where}{follows}{calm}"


def _calm(tests: ResidualTests, noise: Noise) -> str:
    """Return the clause on the disturbance that the tests do not exclude; empty where they exclude one."""
    passes = tests.p >= MIN_P_VALUE and noise.disturbance > DISTURBED
    return f"; the tests do not tell it from {_disturbance(noise)}" if passes else ""


def _unexplained_sentence(search: Search, found: ScoredModel, left: ResidualTests, floor: Noise, noise: Noise) -> str:
    """Return the sentence on an error that no effect of the catalogue explains: its size, partial explanation and place.

    It names the signal that the error follows where a test shows one, and a possible disturbance where no test excludes one.
    """
    worse = validation_error_ratio(search.base(), search.floor)
    lowers = found.selection_errors.mean < search.base().selection_errors.mean
    worse_fitted = found.train.over(floor) > EQUAL_ERROR_RATIO * found.selection_errors.over(floor)
    fitted = f" ({_size(search, found.train, floor)} on the fitted runs)" if worse_fitted else ""
    partly = f", {sized(search, found, floor)}{fitted} with {' and '.join(names_added(search, found))}" if lowers else ""
    when = f"{left.worst_start_s:.0f}-{left.worst_end_s:.0f} s ({left.worst_ratio:.1f} x the average)"
    where = f"{'what is left' if lowers else 'it'} is largest in {left.worst_run} at {when}"
    follows = f" and moves with {left.moves_with}" if 3.0 * left.dependence < MIN_P_VALUE else ""
    unseen = f"; unseen runs are {worse:.1f} times worse than the fitted ones" if worse > MAX_VALIDATION_ERROR_RATIO else ""
    return (
        f"no effect of the catalogue explains what is missing: error {sized(search, search.base(), floor)}{partly}; "
        f"{where}{follows}{_calm(left, noise)}{unseen}{_less_likely_explanation(search, found, floor)}"
    )


def _less_likely_explanation(search: Search, found: ScoredModel, floor: Noise) -> str:
    """Return the clause on a set of effects that ends the error on all runs but is less likely; empty without one."""
    if search.is_noiseless:
        return ""
    sums = search.evidences()

    def evidence_of(h: ScoredModel) -> float:
        return sums.get(frozenset(h.names), -np.inf)

    likely = [h for h in search.ranked() if h is not found and evidence_of(h) > sums[search.root]]
    ending = [h for h in likely if worst_error(h, floor) <= SUFFICIENT_ERROR_RATIO]
    if not ending:
        return ""
    best = max(ending, key=evidence_of)
    less = sums[frozenset(found.names)] - evidence_of(best)
    return f"; {'+'.join(names_added(search, best))} leaves {sized(search, best, floor)}, but is {less:.0f} log units less likely"


def _error_fall(search: Search, found: ScoredModel, floor: Noise, runs: str) -> str:
    """Return the clause on the fall of the error with a model's effects, on the validation runs where it clearly falls there.

    Where it falls clearly further at the parameters of all runs, that is stated too, and where it falls at neither, the errors of
    fitted and unseen runs are.
    """
    base = search.base()

    def falls(before: Errors, after: Errors) -> bool:
        return after.over(floor) < MAX_ERROR_RATIO * before.over(floor)

    def size(before: Errors, after: Errors) -> str:
        if search.is_noiseless:
            return f"from {before.sized()} to {after.sized()}"
        return f"from {before.over(floor):.2f} to {after.over(floor):.2f} x the noise floor"

    selected = base.selection_errors, found.selection_errors
    settled = base.unseen_errors[-1], found.unseen_errors[-1]
    is_open = bool(search.validation) and falls(found.selection_errors, settled[1])
    if not search.validation or (falls(*selected) and not is_open):
        return f"the error on {runs} falls {size(*selected)}"
    if falls(*settled):
        alone = f"with the fitted runs' own it goes {size(*selected)}"
        return f"with the numbers of all runs together the error on {runs} falls {size(*settled)}; {alone}"
    return f"the error on the fitted runs goes {size(base.train, found.train)}, that on {runs} {size(*selected)}"


def _disturbance(noise: Noise) -> str:
    """Return the disturbance in words: a moment on the hull, or coloured sensor noise."""
    if noise.disturbance > DISTURBED:
        lasts = f"{noise.disturbance:.2g} rad/s^2 with a time constant of {noise.disturbance_time:.2g} s"
        return f"a disturbance moment of {lasts} that does not follow the fin or the motion"
    wander = f"{noise.coloured_angle:.2g} rad and {noise.coloured_rate:.2g} rad/s"
    return f"sensors that wander by {wander} with a time constant of {noise.coloured_time:.2g} s"


def what_it_does(name: str, coefficients: Collection[str]) -> str:
    """Return, in words, what an effect does in a model with these coefficients, and its variant if not the textbook's."""
    effect = effect_named(name)
    form = variant_of(effect, coefficients)
    return effect.says if form is None else f"{effect.says}: {form.says}"


def sized(search: Search, h: ScoredModel, floor: Noise) -> str:
    """Return a model's selection error in words: over the noise floor, or in its units where logs show almost no noise."""
    return _size(search, h.selection_errors, floor)


def _size(search: Search, errors: Errors, floor: Noise) -> str:
    return errors.sized() if search.is_noiseless else f"{errors.over(floor):.2f} x the noise floor"
