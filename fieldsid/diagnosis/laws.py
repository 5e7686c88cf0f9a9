"""How speed enters a hypothesis: runs of a group alike or scaled, one authority for all or each its own, which trim."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any, TypeVar

from fieldsid.diagnosis.beside import Beside
from fieldsid.diagnosis.hypothesis import Hypothesis, hypothesis_of
from fieldsid.diagnosis.trial import Trial, judge, refine
from fieldsid.diagnosis.worth import MUCH, WORTH, asks_for_more
from fieldsid.fitting.layout import Groups, layout_of, speed_groups
from fieldsid.fitting.problem import Problem
from fieldsid.fitting.start import start_vector
from fieldsid.fitting.starts import by_other_law, ground_of, promise_of, shortened, under_groups
from fieldsid.fitting.trim_law import UNUSUAL, miss_their_speed, possible_trims
from fieldsid.logs.run import FloatArray
from fieldsid.models.axis import Axis
from fieldsid.models.effect import Effect
from fieldsid.models.model import Noise
from fieldsid.models.record import Record
from fieldsid.models.speed_law import TRIM_OF_FIN

T = TypeVar("T")

World = tuple[
    dict[frozenset[str], Hypothesis], dict[frozenset[str], float], set[frozenset[str]], dict[frozenset[str], list[Trial]],
    set[frozenset[str]],
]  # fmt: skip
"""What was tried, shaped and grown from; free runs, and from where they were flown."""

TURNS = 2
"""Times a search begins anew under the trim's other law: a first effect may have asked for the one that the second does not."""
ALIKE_SPEEDS = 1.1
"""What the product of both channels' errors must fall by for runs of a group to count as flown at one speed."""


def speed_laws(records: Sequence[Record], *, trim_of_fin: bool | None) -> tuple[Groups, ...]:
    """Return the ways speed may enter: runs of one group alike or scaled, the trim by one law or another, or by the one given."""
    groups = speed_groups(records)
    snapped = (False, True) if len(groups.speeds) < len(records) else (False,)
    trims = possible_trims(groups) if trim_of_fin is None else (trim_of_fin,)
    return tuple(speed_groups(records, snapped=s, trim_of_fin=t) for t in trims for s in snapped)


def base_trial(records: tuple[Record, ...], axis: Axis, known: Sequence[Effect], groups: Groups, floor: Noise) -> Trial:
    """Return the output error of the base model with the effects it is known to have, under a law of the speed."""
    layout = layout_of(records, axis, (), groups)
    trial = refine(Problem(records, layout), start_vector(records, layout), floor)
    for effect in known:
        ground = ground_of(trial.problem, trial.x, trial.weights)
        promise = shortened(ground, promise_of(ground, effect))
        trial = refine(promise.problem, promise.start, trial.weights)
    return trial


def error_by_law(trial: Trial, axis: Axis) -> float:
    """Return the product of both channels' errors, more where trim or speeds are not what they are as a rule."""
    groups = trial.problem.layout.groups
    usual = (1.0 if groups.trim_of_fin == TRIM_OF_FIN[axis] else UNUSUAL) * (ALIKE_SPEEDS if groups.snapped else 1.0)
    return trial.weights.angle * trial.weights.rate * usual


def under_other_law(h: Hypothesis, told: Noise, family: str, *, asks_for_more: bool) -> Hypothesis | None:
    """Return a hypothesis under another law of the speed, see `by_other_law`, where that has more evidence.

    Speeds that share an authority pin it down far better; a group that is off the law shows once what hid it is found. So
    does a run that was not flown at its group's speed.
    """
    trial = h.judged.trial
    groups = trial.problem.layout.groups
    if groups.snapped and asks_for_more:
        own = speed_groups(trial.problem.records, trim_of_fin=groups.trim_of_fin)
        own = replace(groups, snapped=False, run_speeds=own.run_speeds)
        return _better(h, *under_groups(trial.problem, trial.x, own), told, family, 0.0)
    one_speed = len(groups.speeds) == 1
    if (one_speed or groups.by_law) and not (asks_for_more and miss_their_speed(groups)):
        return None
    return _better(h, *by_other_law(trial.problem, trial.x), told, family, WORTH if one_speed else 0.0)


@dataclass(slots=True)
class Trims:
    """What hypotheses come to under the trim's other law, each judged once, and how often a search has turned to it.

    left is what had been tried by then, under each noise and law: a search may come back.
    """

    known: dict[tuple[tuple[str, ...], float], Hypothesis | None] = field(default_factory=dict)
    turned: int = 0
    left: dict[tuple[str, bool], World] = field(default_factory=dict)

    def turn(self, family: str, world: World, *, law: bool, other: bool) -> World:
        """Return what was tried under the other law before, keeping the world of the law that is left."""
        self.turned += 1
        self.left[family, law] = world
        return self.left.get((family, other), ({}, {}, set(), {}, set()))

    def asked(
        self, found: Hypothesis, tried: Mapping[frozenset[str], Hypothesis], floor: Noise, told: Noise, beside: Beside,
        first: Callable[[], T],
    ) -> tuple[T, Hypothesis | None]:  # fmt: skip
        """Return the first question's answer, and a hypothesis with more evidence under the other law than what was found has.

        One of the effects found may stand in for that law. Where something is left, it may be hidden by it: what was found
        is tried, and those of all which the law may have kept from predicting: the likeliest, and the one that fits best.
        """
        key, asked = frozenset(found.names), list[Hypothesis]()
        if self.turned < TURNS:
            asked = [tried[k] for k in tried if k < key and len(k) == len(key) - 1]
            asked += [found, *_foremost(tried.values())] if asks_for_more(found, floor) else []
        keys = {(h.names, h.score): h for h in asked}
        new = {k: partial(better_trim, h, told) for k, h in keys.items() if k not in self.known}
        parts: tuple[Callable[[], Any], ...] = (first, *new.values())
        answer, *again = beside.each(lambda part: part(), parts)
        self.known |= dict(zip(new, again, strict=True))
        better = [h for h in (self.known[k] for k in keys) if h is not None and h.score > found.score and _predicts(h, found)]
        return answer, max(better, key=lambda h: h.score, default=None)


def _foremost(tried: Collection[Hypothesis]) -> tuple[Hypothesis, Hypothesis]:
    """Return the hypotheses of most evidence, on all runs and on those fitted to."""
    return max(tried, key=lambda h: h.score), max(tried, key=lambda h: float(h.by_run.sum()) - h.cost)


def _predicts(h: Hypothesis, found: Hypothesis) -> bool:
    """Whether a hypothesis under the other law does not predict unseen runs far worse than what was found.

    Where speeds are a little off, a disturbance takes what either law leaves of the heading, and evidence alone tells by chance.
    """
    return h.judging.mean < MUCH * found.judging.mean


def law_of(h: Hypothesis) -> bool:
    """Return whether the trim of a hypothesis is a bent fin's."""
    return h.judged.trial.problem.layout.groups.trim_of_fin


def better_trim(h: Hypothesis, told: Noise) -> Hypothesis | None:
    """Return a hypothesis under the trim's other law where it has more evidence there, None where it has not."""
    trial, layout, family = h.judged.trial, h.judged.trial.problem.layout, h.judged.family
    records, varying = trial.problem.records, any(e.terms is not None for e in h.effects)
    for trim in possible_trims(speed_groups(records), varying=varying):
        if trim != layout.groups.trim_of_fin:
            other = Problem(records, replace(layout, groups=replace(layout.groups, trim_of_fin=trim)))
            fit = hypothesis_of(judge(other, trial.x, h.judged.noise, told, family), h.validation)
            if fit.score > h.score + (0.0 if trim == TRIM_OF_FIN[layout.axis] else WORTH):
                return fit
    return None


def _better(h: Hypothesis, problem: Problem, x: FloatArray, told: Noise, family: str, worth: float) -> Hypothesis | None:
    """Return what a problem of the same effects comes to where it has that much more evidence."""
    other = hypothesis_of(judge(problem, x, h.judged.noise, told, family), h.validation)
    return other if other.score > h.score + worth else None
