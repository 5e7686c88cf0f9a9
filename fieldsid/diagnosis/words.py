"""The evidence in words, every one with its number."""

from __future__ import annotations

from math import isfinite

from fieldsid.diagnosis.hypothesis import Hypothesis
from fieldsid.diagnosis.records import Pair
from fieldsid.diagnosis.remainder import Remainder
from fieldsid.diagnosis.search import Search
from fieldsid.diagnosis.verdict import Verdict, explained, worsens
from fieldsid.diagnosis.worth import ALIKE, WORSE, worse_unseen
from fieldsid.models.effect import effect_named, form_of
from fieldsid.models.model import Noise

DISTURBED = 1e-5
"""Disturbance, in rad/s^2, that is worth a word."""


def over(search: Search, h: Hypothesis, floor: Noise) -> float:
    """Return a hypothesis's error on the runs it is judged by over a noise floor."""
    return h.judging.over(floor)


def evidence(search: Search, h: Hypothesis, errors: Pair, floor: Noise, gain: float) -> str:
    """Return what speaks for or against a hypothesis with these errors and this log evidence over the base, in one sentence."""
    base = search.base()
    kind = "unseen runs" if search.validation else "the runs it was fitted to"
    fall = f"error on {kind} {over(search, base, floor):.2f} -> {over(search, h, floor):.2f} x noise floor"
    share = f"{fall} ({100 * explained(search, h, floor):.0f} % of the excess)"
    said = f"makes it worse: {fall}" if worsens(search, h, floor) else share
    lower, total = lower_on(errors, base.errors, floor)
    return f"{said}; log evidence {gain:+.1f}; error lower on {lower} of {total} runs"


def lower_on(errors: Pair, base: Pair, floor: Noise) -> tuple[int, int]:
    """Return on how many runs, fitted and unseen, the error is lower by more than what counts as alike, and of how many."""
    pairs = list(zip((*errors.train.each, *errors.validation.each), (*base.train.each, *base.validation.each), strict=True))
    return sum(ALIKE * now.over(floor) < was.over(floor) for now, was in pairs), len(pairs)


def headline(search: Search, verdict: Verdict, found: Hypothesis, left: Remainder, floor: Noise, noise: Noise) -> str:
    """Return the verdict as an engineer would say it."""
    error, base = over(search, found, floor), over(search, search.base(), floor)
    runs = "unseen runs" if search.validation else "the runs it was fitted to"
    if verdict.word == "sufficient":
        tail = f"; a disturbance of {noise.disturbance:.2g} rad/s^2 is there" if noise.disturbance > DISTURBED else ""
        return f"nothing to add: the model predicts {runs} at {error:.2f} x the noise floor{tail}"
    if verdict.word == "disturbed":
        size = _sized(search, search.base(), base)
        return f"no effect of the catalogue is missing: what is left, {size}, is {_disturbance(noise)}"
    if verdict.word == "unexplained":
        worse = worse_unseen(search.base(), search.floor)
        return (
            f"something is there that is not in the catalogue: error {_sized(search, search.base(), base)}, most of it in "
            f"{left.worst_run} at {left.worst_start_s:.0f}-{left.worst_end_s:.0f} s ({left.worst_ratio:.1f} x the average), "
            f"it moves with {left.moves_with}"
            + (f"; unseen runs are {worse:.1f} times worse than the fitted ones" if worse > WORSE else "")
        )
    names = " and ".join(verdict.effects)
    says = "; ".join(_says(found, n) for n in verdict.effects)
    fall = f"the error on {runs} falls from {_sized(search, search.base(), base)} to {_sized(search, found, error)}"
    if verdict.word == "undecided":
        others = ", ".join("+".join(n for n in r.names if n not in search.known) for r in verdict.rivals)
        return f"{names} or {others}: these data cannot tell them apart; with {names} {fall}"
    return f"{names} ({says}): {fall}"


def _disturbance(noise: Noise) -> str:
    """Return what disturbs in words: a moment on the hull, or sensors that wander."""
    if noise.disturbance > DISTURBED:
        lasts = f"{noise.disturbance:.2g} rad/s^2 with a time constant of {noise.disturbance_time:.2g} s"
        return f"a disturbance moment of {lasts} that does not follow the fin or the motion"
    wander = f"{noise.coloured_angle:.2g} rad and {noise.coloured_rate:.2g} rad/s"
    return f"sensors that wander by {wander} with a time constant of {noise.coloured_time:.2g} s"


def _says(h: Hypothesis, name: str) -> str:
    """Return what an effect of a hypothesis does, with the form it was fitted in where that is not the textbook's."""
    effect = effect_named(name)
    fitted = {c.name for e in h.effects if e.name == name for c in e.coefficients}
    form = form_of(effect, fitted)
    return effect.says if form is None else f"{effect.says}: {form.says}"


def _sized(search: Search, h: Hypothesis, error: float) -> str:
    """Return an error in words: over the noise floor, in its own units where the logs show next to no noise."""
    if not search.is_noiseless:
        return f"{error:.2f} x the noise floor"
    errors = h.judging
    parts = [(errors.angle_rms_rad, "rad"), (errors.rate_rms_rad_s, "rad/s")]
    return " and ".join(f"{value:.2g} {unit}" for value, unit in parts if isfinite(value))
