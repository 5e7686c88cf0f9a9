"""From ranked hypotheses to a verdict: effect, sufficient, disturbed, undecided or unexplained."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from fieldsid.diagnosis.floor import shown_floor
from fieldsid.diagnosis.hypothesis import Hypothesis
from fieldsid.diagnosis.remainder import BEYOND_CHANCE, Remainder
from fieldsid.diagnosis.search import Search
from fieldsid.diagnosis.trial import BOTH, Judged
from fieldsid.diagnosis.worth import ALIKE, WORSE, worse_unseen
from fieldsid.models.model import Noise

TEMPER = 2.0
"""Log evidence is divided by this before it becomes a probability: forms are never exact, evidence then overstates."""
RIVAL = 3.0
"""Log evidence within which two hypotheses are rivals (odds of 20 to 1 before tempering); twice that from one run."""
BESIDE = ((0.7, 1e-5), (0.6, 1e-3), (0.3, BEYOND_CHANCE))
"""Share of the excess error an effect must explain to be named where what is left is less likely than this p-value: a form
is never exact, but the less it explains the less it may leave."""
LEAVES, BESIDE_SOME = 1.6, ((0.85, 1e-6),)
"""Error over the noise floor that a form of the right effect hardly leaves, and the share to be explained beyond it."""
BESIDE_MUCH = ((0.97, 1e-6),)
"""The same where what is left is beyond any sea: most of a base that is far off is explained by whatever bends."""
LIKELY = 0.05
"""Probability over a hypothesis's own from which on another is its rival: beyond odds of 20 to 1 they are told apart."""
VISIBLE = 1.15
"""Free-run error over the noise floor below which nothing worth naming is left."""
FILTER_S = 1.0
"""Time constant of coloured sensors, in s, below which their colour is their own, and no error: a motion that is missing lasts as
long as a maneuver."""
FAINT, STORM = 2.0, 4.0
"""Error over the noise floor below which only what moves with the vehicle is told from the sea, since gusts come in bursts
too; and the error above which no sea is taken for granted."""
MOSTLY = BESIDE[0][0]


@dataclass(frozen=True, slots=True)
class Verdict:
    """The word, the effects named, and the rivals where it is undecided."""

    word: str
    effects: tuple[str, ...]
    rivals: tuple[Hypothesis, ...] = ()


def verdict_of(search: Search, found: Hypothesis, left: Remainder, judged: Judged) -> Verdict:
    """Return the verdict on the hypothesis a search ended at, with what is left of it judged in its weather.

    Where sea and sensors are told apart, errors are over the sensors' noise with its colour, else over its white part.
    Sufficient is only what predicts fitted and unseen runs alike that well; `disturbed` where what it leaves is a disturbance.
    """
    noise, floor = judged.noise, shown_floor(search.floor, judged.noise)
    least = floor if judged.family == BOTH else search.floor
    error = found.judging.over(least)
    if frozenset(found.names) == search.root:
        worst = max(error, found.train.over(least))
        if worst <= VISIBLE:
            return Verdict("sufficient", ())
        sea = max(found.judging.over(floor), found.train.over(floor))
        p = 3.0 * left.relation if worst < FAINT else left.p
        odd = p < BEYOND_CHANCE or sea > STORM or worse_unseen(found, least) > WORSE
        return Verdict("unexplained" if odd else "disturbed", ())
    visible = (found.judging.over(floor) if noise.coloured_time < FILTER_S else error) > VISIBLE
    share = explained(search, found, least)
    asked = BESIDE if error <= LEAVES or search.is_noiseless else (*BESIDE, *(BESIDE_SOME if error <= STORM else BESIDE_MUCH))
    if visible and any(left.p < p and share < enough for enough, p in asked):
        return Verdict("unexplained", ())
    rivals = rivals_of(search, found)
    if rivals:
        return Verdict("undecided", added(search, found), rivals)
    return Verdict("effect", added(search, found))


def added(search: Search, h: Hypothesis) -> tuple[str, ...]:
    """Return the effects of a hypothesis that were not known before, the one whose lack costs most on unseen runs first.

    What is left without one was tried unless it promised nothing.
    """

    def lack(name: str) -> float:
        without = search.tried.get(frozenset(h.names) - {name})
        return without.judging.mean if without is not None else float("inf")

    return tuple(sorted((n for n in h.names if n not in search.known), key=lambda n: -lack(n)))


def rivals_of(search: Search, found: Hypothesis) -> tuple[Hypothesis, ...]:
    """Return hypotheses of the same size that the data cannot tell from the one found."""
    margin, sums = RIVAL if len(search.records) > 1 else 2.0 * RIVAL, search.evidences()
    best = sums[frozenset(found.names)]
    return tuple(
        h
        for h in search.ranked()
        if h is not found
        and len(h.names) == len(found.names)
        and best - sums.get(frozenset(h.names), -np.inf) < margin
        and h.judging.mean < ALIKE * found.judging.mean
    )


def explained(search: Search, h: Hypothesis, floor: Noise | None = None) -> float:
    """Return the share of the base's excess over a noise floor, by default the search's, that a hypothesis takes away, 0..1."""
    base, now = (x.judging.over(floor or search.floor) for x in (search.base(), h))
    excess = base**2 - 1.0
    return float(np.clip((base**2 - now**2) / excess, 0.0, 1.0)) if excess > 1e-6 else 0.0


def worsens(search: Search, h: Hypothesis, floor: Noise) -> bool:
    """Whether a hypothesis raises the error over a noise floor, by more than hypotheses that predict alike differ."""
    return bool(h.judging.over(floor) > ALIKE * search.base().judging.over(floor))


def probabilities(evidences: Mapping[frozenset[str], float]) -> dict[frozenset[str], float]:
    """Return the probability of each set of effects among all that were tried, from their tempered log evidence."""
    scores = np.array(list(evidences.values())) / TEMPER
    weights = np.exp(scores - scores.max())
    return dict(zip(evidences, (weights / weights.sum()).tolist(), strict=True))
