"""The search over hypotheses: singles, then pairs and triples grown from the best, with swaps and pruning."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from fieldsid.diagnosis.again import DOUBTFUL, begun_again
from fieldsid.diagnosis.allowance import MOST, Allowance
from fieldsid.diagnosis.beside import Beside
from fieldsid.diagnosis.floor import is_noiseless, told_apart
from fieldsid.diagnosis.forms import Plain, Shaping
from fieldsid.diagnosis.hypothesis import Hypothesis, hypothesis_of, price, with_free_run
from fieldsid.diagnosis.laws import Trims, base_trial, error_by_law, law_of, speed_laws, under_other_law
from fieldsid.diagnosis.remainder import is_odd
from fieldsid.diagnosis.trial import SETTLED, Judged, Trial, judge, refine, smaller_twin
from fieldsid.diagnosis.ways import PROMISING, PROMISING_LATER, Way, brought, by_effect, ways
from fieldsid.diagnosis.weather import base_judged, other_noise, sensors
from fieldsid.diagnosis.worth import FAR, MATTERS, MUCH, asks_for_more, fits, helps, pays
from fieldsid.fitting.colour import residuals_of
from fieldsid.fitting.noise import floor_below, floor_of
from fieldsid.fitting.problem import Problem
from fieldsid.fitting.starts import carried, overlaid
from fieldsid.fitting.unbounded import refuse_unbounded
from fieldsid.logs.run import FloatArray
from fieldsid.models.axis import Axis
from fieldsid.models.effect import Effect
from fieldsid.models.model import Noise
from fieldsid.models.record import Record

LEADING = 3
"""Children that every way to them is gone for, whatever the first has brought, and that are given the free run."""
LARGEST, PAIR = 4, 2
"""Effects a hypothesis has at most, and those whose parts were all tried on the way to it."""


@dataclass(slots=True)
class Search:
    """Everything tried so far on one set of runs, by the set of effects; known ones are part of its base."""

    records: tuple[Record, ...]
    validation: tuple[Record, ...]
    axis: Axis
    catalogue: Sequence[Effect]
    known: Sequence[str] = ()
    report: Callable[[str], None] = lambda _text: None
    thorough: bool = False
    """Whether it goes on for as long as there is something to try."""
    floor: Noise = field(init=False)
    tried: dict[frozenset[str], Hypothesis] = field(default_factory=dict)
    family: str = ""
    begun: set[str] = field(default_factory=set)
    trim_of_fin: bool | None = None
    trims: Trims = field(default_factory=Trims)
    told: Noise = field(init=False)
    is_noiseless: bool = False
    """Whether the logs show so little noise that the base errs by a hundred times it in all that was measured."""
    grown_from: set[frozenset[str]] = field(default_factory=set)
    flown_from: set[frozenset[str]] = field(default_factory=set)
    free: dict[frozenset[str], list[Trial]] = field(default_factory=dict)
    shaped: dict[frozenset[str], float] = field(default_factory=dict)
    beside: Beside = field(init=False)
    allowance: Allowance = field(init=False)

    def __post_init__(self) -> None:
        """Tell hypotheses apart down to the sensors' noise, until the base shows how far off it is."""
        both = (*self.records, *self.validation)
        self.told = self.floor = floor_of(both)
        self.beside = Beside(both, self.catalogue)
        self.allowance = Allowance(len(both), np.inf if self.thorough else MOST)

    @property
    def root(self) -> frozenset[str]:
        """The effects of the base."""
        return frozenset(self.known)

    def base(self) -> Hypothesis:
        """Return the hypothesis of the known effects alone."""
        if self.root not in self.tried:
            self.report("base model")
            laws = speed_laws(self.records, trim_of_fin=self.trim_of_fin)
            known = [e for e in self.catalogue if e.name in self.known]
            trials = self.beside.each(lambda groups: base_trial(self.records, self.axis, known, groups, self.floor), laws)
            trial = min(trials, key=lambda t: error_by_law(t, self.axis))
            refuse_unbounded(trial.problem, trial.x, "diagnose", instead="leave effects out of the model it starts from")
            self.is_noiseless = is_noiseless(self.floor, told_apart(self.floor, trial.weights), self.records)
            self.hear(trial)
            self.told = told_apart(self.floor, trial.weights)
            judged = base_judged(trial, self.floor, self.told, self.family, self.beside)
            self.family, self.begun = judged.family, self.begun | {judged.family}
            self._keep(judged)
            self.tried[self.root] = with_free_run(self.tried[self.root], self.floor)
            self._other_law([self.root])
            self._reshape([Plain(self.tried[self.root])])
        return self.tried[self.root]

    def hear(self, trial: Trial) -> None:
        """Lower the floor to what the sensors show once the motion that a trial follows is taken away, if they show noise."""
        if not self.is_noiseless:
            self.floor = floor_below(self.floor, self.records, residuals_of(trial.problem, trial.x))

    def _keep(self, judged: Judged) -> Hypothesis:
        """Keep a hypothesis where it has more evidence than what is known of its effects: a better fit may be a worse end."""
        key = frozenset(judged.trial.names)
        known, cost = self.tried.get(key), price(judged, self.validation)
        if known is None or judged.likelihood - cost > known.judged.likelihood - known.cost + 1e-3:
            found = hypothesis_of(judged, self.validation)
            self.tried[key] = found if known is None or found.score > known.score else known
        return self.tried[key]

    def grow(self, parent: Hypothesis, *, forced: bool = False) -> list[Hypothesis]:
        """Return the parent with each promising effect added, or with every one when forced, judged, best first."""
        key = frozenset(parent.names)
        if key not in self.grown_from:
            self.grown_from.add(key)
            most = PROMISING if key == self.root else PROMISING_LATER
            left = [e for e in self.catalogue if e.name not in key]
            found = ways(parent, left, None if forced else most, self.beside, anew=key == self.root, flown=key in self.flown_from)
            self._flown_before(parent)
            self.flown_from.add(key)
            later = self._gone(parent, by_effect(found))
            leading = {n for h in self._children(key)[:LEADING] for n in h.names if n not in key}
            self._gone(parent, by_effect([w for w in later if w.promise.effect.name in leading]), every=True)
            if self.allowance.lasts():
                self._back_from_child(key)
            self._free_runs(key)
            if self.allowance.lasts():
                self._improve(key, self._leading(key))
        return self._children(key)

    def _children(self, key: frozenset[str]) -> list[Hypothesis]:
        """Return the hypotheses of one effect more that were tried, best first."""
        children = [h for k, h in self.tried.items() if len(k) == len(key) + 1 and key < k]
        return sorted(children, key=lambda h: -h.score)

    def _leading(self, key: frozenset[str]) -> list[frozenset[str]]:
        """Return the best children, and the one that fits the training runs best: a wrong law of speed may hide it elsewhere.

        Only the first of them where it leaves nothing, or a hypothesis has effects and is near the floor with it, or has a pair.
        """
        children = self._children(key)
        best = sorted(children, key=lambda h: h.cost - h.by_run.sum())[:1]
        names = list(dict.fromkeys(frozenset(h.names) for h in (*children[:LEADING], *best)))
        early = key == self.root or (len(key) < len(self.known) + PAIR and any(self.error(h) > FAR for h in children[:1]))
        return names if early and any(asks_for_more(h, self.floor) for h in children[:1]) else names[:1]

    def _flown_before(self, parent: Hypothesis) -> None:
        """Judge the children whose free runs were found under the other noise, from there: a free run knows of neither."""
        key = frozenset(parent.names)
        names = [n for n, free in self.free.items() if free and len(n) == len(key) + 1 and key < n and n not in self.tried]

        def judge_all(name: frozenset[str]) -> Hypothesis:
            for free in self.free[name]:
                self._judge_child(parent, free.problem, free.x, next(e for e in free.effects if e.name not in key))
            return self.tried[name].worked_out()

        self.tried |= dict(zip(names, self.beside.each(judge_all, names), strict=True))

    def _gone(self, parent: Hypothesis, groups: Sequence[Sequence[Way]], *, every: bool = False) -> list[Way]:
        """Go the ways of each effect; return those left out where one gone before has brought what they promise.

        Each of them is gone where every is asked for. All see the same rival, whoever goes first.
        """
        rival = max((h.judged.likelihood for h in self._children(frozenset(parent.names))), default=-np.inf)

        def go_all(group: Sequence[Way]) -> tuple[Hypothesis, list[Trial], list[int]]:
            key = frozenset((*parent.names, group[0].promise.effect.name))
            later = []
            for i, way in enumerate(group):
                if every or key not in self.tried or not brought(way, parent, self.tried[key]):
                    self._go(parent, way, rival)
                else:
                    later.append(i)
            return self.tried[key].worked_out(), self.free.get(key, []), later

        left = []
        for group, (found, free, later) in zip(groups, self.beside.each(go_all, groups), strict=True):
            key = frozenset(found.names)
            self.tried[key], self.free[key] = found, free
            left += [group[i] for i in later]
        return left

    def _go(self, parent: Hypothesis, way: Way, rival: float) -> None:
        """Judge what a way leads to."""
        promise, start = way.promise, way.promise.start
        self.report("+".join((*parent.names, promise.effect.name)))
        if way.plain:
            free = refine(promise.problem, start, parent.judged.trial.weights)
            self.free.setdefault(frozenset(free.names), []).append(free)
            start = free.x
        self._judge_child(parent, promise.problem, start, promise.effect, rival)

    def _judge_child(self, parent: Hypothesis, p: Problem, start: FloatArray, effect: Effect, rival: float = -np.inf) -> None:
        """Judge a start, and the other start that has the same response at one speed."""
        judged = judge(p, start, parent.judged.noise, self.told, self.family, rival=rival)
        self._keep(smaller_twin(judged, effect))

    def _back_from_child(self, key: frozenset[str]) -> None:
        """Judge a hypothesis again from where its best child has led its numbers: a cost that is not smooth has many ends.

        Where that is a better end, on unseen runs as well, its leading children are judged from there too.
        """
        child, parent = next(iter(self._children(key)), None), self.tried[key]
        again = self._judged_from(parent, child) if child else parent.judged
        if again.likelihood > parent.judged.likelihood + SETTLED:
            better = with_free_run(hypothesis_of(again, self.validation), self.floor)
            if better.score > parent.score:
                self.tried[key] = parent = better
                for judged in self.beside.each(lambda child: self._judged_from(child, parent), self._children(key)[:LEADING]):
                    self._keep(judged)

    def _judged_from(self, h: Hypothesis, other: Hypothesis) -> Judged:
        """Judge a hypothesis from the numbers of another one where it has them, else from its own."""
        here, there = h.judged.trial, other.judged.trial
        x = overlaid(there.problem.layout, there.x, here.problem.layout, here.x)
        return judge(here.problem, x, other.judged.noise, self.told, self.family)

    def _free_runs(self, key: frozenset[str]) -> None:
        """Give the best children with evidence the free run of plain output error where that predicts unseen runs better."""
        parent = self.tried[key]
        children = [c for c in self._children(key)[:LEADING] if c.score > parent.score]

        def flown(child: Hypothesis) -> Hypothesis:
            free = self.free.get(frozenset(child.names), ())
            return with_free_run(child, self.floor, parent, free).worked_out(fitted=True)

        self.tried |= {frozenset(child.names): child for child in self.beside.each(flown, children)}

    def _improve(self, key: frozenset[str], names: Sequence[frozenset[str]], *, every: bool = False) -> None:
        """Put children under another law of the speed, and into other forms, where that has more evidence.

        Where none has any as it is and much is left, what is missing may be any child in another form: so too where asked for.
        """
        parent = self.tried[key]
        lost = every or (self.error(parent) > MUCH and not any(helps(parent, self.tried[n]) for n in names))
        names = [frozenset(c.names) for c in self._children(key)] if lost else names
        # forms of what the parent has were tried on it: the best child tries them again, and the one that goes on
        foremost = {*names[:1], *[n for n in names if pays(parent, self.tried[n])][:1]}

        helping = [n for n in names if lost or helps(parent, self.tried[n])]
        self._other_law([n for n in names if fits(parent, self.tried[n])])
        self._reshape([Plain(self.tried[n], parent, None if n in foremost else n - key) for n in helping])

    def _other_law(self, names: Sequence[frozenset[str]]) -> None:
        """Put hypotheses under the other law of the speed where that has more evidence."""

        def better(name: frozenset[str]) -> Hypothesis:
            known = self.tried[name]
            other = under_other_law(known, self.told, self.family, asks_for_more=asks_for_more(known, self.floor))
            return known if other is None else with_free_run(other, self.floor).worked_out(fitted=True)

        self.tried |= dict(zip(names, self.beside.each(better, names), strict=True))

    def _reshape(self, asked: Sequence[Plain]) -> None:
        """Put hypotheses' effects into other forms than the textbook's, unless that was tried from where they are."""
        asked = [p for p in asked if p.h.score > self.shaped.get(frozenset(p.h.names), -np.inf) + SETTLED]
        for h in Shaping(self.told, self.family, self.floor, self.beside).reshaped(asked):
            self.tried[frozenset(h.names)], self.shaped[frozenset(h.names)] = h, h.score

    def best(self) -> Hypothesis:
        """Return the hypothesis of most evidence, without the effects of it that do not matter."""
        self._expand()
        found = self._likeliest()
        nothing = frozenset(found.names) == self.root  # the textbook's forms may promise nothing
        if self.error(found) > MUCH and self.allowance.lasts() and (nothing or is_odd(found.judged, self.beside)):
            untried = [e for e in self.catalogue if nothing and e.forms and self.root | {e.name} not in self.tried]
            self._gone(self.base(), by_effect(ways(self.base(), untried, None, self.beside, anew=False, flown=True)))
            self._improve(self.root, [], every=True)
            self._expand()
            found = self._likeliest()
        if self.error(found) > DOUBTFUL and self.allowance.lasts():
            found = begun_again(found, self.known, self.told, self.family, sensors(self.floor, self.base()), self.beside)
            self.tried[frozenset(found.names)] = found
        return self._likeliest()

    def _expand(self) -> None:
        """Grow what leads, best first, until all that leads has been grown or predicts as well as the sensors allow."""
        self.base()
        while (leading := self._next()) is not None:
            self.grow(leading)
            self._drop_each()
            self.hear(self._likeliest().judged.trial)
            if self._turn():
                self.base()

    def _next(self) -> Hypothesis | None:
        """Return what to grow next of what leads, None where all was.

        What leads: the base; the hypothesis of most evidence; what it is without each of its effects, for another to take that
        one's place; and those that predict better than it, whatever their evidence: a small effect that they lack may have
        paid for a wrong one.
        """
        if self.root not in self.grown_from:
            return self.base()
        if not self.allowance.lasts():
            return None
        best = max(self.tried.values(), key=lambda h: h.score)
        front = [h for h in self.ranked() if h.judging.mean < MATTERS * best.judging.mean]
        parts = [self.tried[k] for e in best.names if (k := frozenset(best.names) - {e}) in self.tried]
        leading = [best, *front, *parts] if asks_for_more(best, self.floor) else front
        return next((h for h in leading if self._is_to_grow(h)), None)

    def _is_to_grow(self, h: Hypothesis) -> bool:
        """Whether additions to a hypothesis are still to be tried, and leave it of a size that can be told."""
        is_new = frozenset(h.names) not in self.grown_from and len(h.names) < len(self.known) + LARGEST
        return is_new and asks_for_more(h, self.floor)

    def _drop_each(self) -> None:
        """Try what has most evidence without each of its effects: the first ones may have stood in for the later ones."""
        best = max(self.tried.values(), key=lambda h: h.score)
        if len(best.names) > len(self.known) + 1:
            for gone in best.effects:
                if gone.name not in self.known and frozenset(best.names) - {gone.name} not in self.tried:
                    self._without(best, gone)

    def _turn(self) -> bool:
        """Begin anew under another noise, once each, or the other law of the trim where that fits the likeliest better.

        What was missing may have hidden it. Likelihoods compare under one noise only, and a disturbance that stands in for
        coloured sensors lets the heading wander for free. What was found stays among what is tried, judged anew.
        """
        if not self.allowance.lasts():
            return False
        found = self._likeliest()
        noise = partial(other_noise, found, self.floor, self.begun, self.beside)
        judged, again = self.trims.asked(found, self.tried, self.floor, self.told, self.beside, noise)
        if judged is None and again is None:
            return False
        if judged is not None:
            self.family, again = judged.family, hypothesis_of(judged, self.validation)
            self.tried, self.shaped, self.grown_from = {}, {}, set()
        elif again is not None:
            left, self.trim_of_fin = law_of(self.base()), law_of(again)
            world = self.tried, self.shaped, self.grown_from, self.free, self.flown_from
            world = self.trims.turn(self.family, world, law=left, other=self.trim_of_fin)
            self.tried, self.shaped, self.grown_from, self.free, self.flown_from = world
        if again is not None and frozenset(again.names) != self.root:
            known, again = self.tried.get(frozenset(again.names)), with_free_run(again, self.floor)
            self.tried[frozenset(again.names)] = again if known is None or again.score > known.score else known
        return True

    def core_of(self, h: Hypothesis) -> frozenset[str]:
        """Return the effects of a hypothesis that pay over it without them: the others have no evidence, or do not matter."""
        while idle := [w for w in self._less(h) if not pays(w, h)]:
            h = max(idle, key=lambda w: w.score)
        return frozenset(h.names)

    def _less(self, h: Hypothesis) -> list[Hypothesis]:
        """Return what was tried of a hypothesis without one of its effects."""
        return [self.tried[k] for n in h.names if n not in self.known and (k := frozenset(h.names) - {n}) in self.tried]

    def evidences(self) -> dict[frozenset[str], float]:
        """Return the log evidence of every set of effects that pay: of all that was tried with these, and others that do not.

        The log of the sum of the evidence of every hypothesis that comes to the set.
        """
        sums: dict[frozenset[str], float] = {}
        for h in self.ranked():
            core = self.core_of(h)
            sums[core] = float(np.logaddexp(sums.get(core, -np.inf), h.score))
        return sums

    def admissible(self, h: Hypothesis) -> bool:
        """Whether every effect of a hypothesis pays."""
        return self.core_of(h) == frozenset(h.names)

    def _likeliest(self) -> Hypothesis:
        """Return the set of effects of most evidence."""
        sums = self.evidences()
        return self.tried[max(sums, key=lambda k: sums[k])]

    def _without(self, h: Hypothesis, gone: Effect) -> Hypothesis:
        """Return a hypothesis without one of its effects, tried from the numbers it has with it."""
        trial = h.judged.trial
        problem = trial.problem.with_effects([e for e in h.effects if e is not gone])
        x = carried(trial.problem.layout, trial.x, problem.layout)
        judged = judge(problem, x, h.judged.noise, self.told, self.family)
        key = frozenset(judged.trial.names)
        before, kept = self.tried.get(key), self._keep(judged)
        if kept is not before:
            self.tried[key] = with_free_run(kept, self.floor)
        return self.tried[key]

    def error(self, h: Hypothesis) -> float:
        """Return the free-run error over the noise floor, that of sensors that wander where they are known to."""
        return h.judging.over(sensors(self.floor, self.tried.get(self.root)))

    def ranked(self) -> list[Hypothesis]:
        """Return all judged hypotheses, best score first, but for those that grow without bound: they were given up."""
        return sorted((h for h in self.tried.values() if np.isfinite(h.score)), key=lambda h: -h.score)
