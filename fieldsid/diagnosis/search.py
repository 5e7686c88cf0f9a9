"""The search over hypotheses: singles, then pairs and triples grown from the best, with swaps and pruning."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from fieldsid.diagnosis.hypothesis import Hypothesis, hypothesis_of, with_free_run
from fieldsid.diagnosis.trial import Judged, Trial, judge, refine
from fieldsid.fitting.descent import descend
from fieldsid.fitting.layout import layout_of, speed_groups
from fieldsid.fitting.noise import floor_of
from fieldsid.fitting.problem import Problem
from fieldsid.fitting.start import start_vector
from fieldsid.fitting.starts import Ground, Promise, ground_of, grown, promise_of, shared_points, shortened, twin_of
from fieldsid.logs.run import BoolArray, FloatArray
from fieldsid.models.axis import Axis
from fieldsid.models.effect import Effect, Stage
from fieldsid.models.model import Noise
from fieldsid.models.record import Record

NOISES = ("disturbance", "coloured")
FREE_RUNS = 3
PROMISING, PROMISING_LATER, PROMISING_INSTEAD = 5, 4, 2
"""Effects that go on from each of the two screens: the free run's own error, and the error whitened by its noise. Of
the base, of a hypothesis with effects, and of one that is only tried in another order."""
LARGEST = 4
CLEAN = 1.02
GLIMPSE, GLIMPSE_PLAIN = 5.0, 0.02
"""Fall of the whitened sum of squares, and share of the plain one, below which the screen does not send an effect on."""
SHIFT_ROUNDS = 12
TWINS = 1.0
"""Log likelihood within which two starts of one hypothesis are alike."""
WORTH = 6.0
"""Log evidence an addition must bring: odds of 400 to 1, for the dozens of additions that are tried."""
LEARNED = 4.0
"""Log likelihood an addition must gain on the runs it is fitted to, or its numbers come from nowhere."""
MATTERS = 0.97
"""Share the free-run error must fall to: significant is not important."""
MATTERS_MORE = 0.02
"""What a third and each further effect must bring beyond that: long explanations are the easier to find."""


@dataclass(slots=True)
class Search:
    """Everything tried so far on one set of runs, by the set of effects."""

    records: tuple[Record, ...]
    validation: tuple[Record, ...]
    axis: Axis
    catalogue: tuple[Effect, ...]
    floor: Noise
    known: tuple[str, ...] = ()
    tried: dict[frozenset[str], Hypothesis] = field(default_factory=dict)
    family: str = NOISES[0]
    grown_from: set[frozenset[str]] = field(default_factory=set)
    report: Callable[[str], None] = lambda _text: None

    @property
    def root(self) -> frozenset[str]:
        """The effects of the base."""
        return frozenset(self.known)

    def base(self) -> Hypothesis:
        """Return the hypothesis of the known effects alone."""
        if self.root not in self.tried:
            self.report("base model")
            trial = min((self._base_trial(snapped=s) for s in self._laws()), key=lambda t: t.weights.angle * t.weights.rate)
            judged = max((judge(trial.problem, trial.x, self.floor, f) for f in NOISES), key=lambda j: j.likelihood)
            self.family = judged.family
            self._keep(judged)
            self.tried[self.root] = with_free_run(self.tried[self.root], self.floor)
        return self.tried[self.root]

    def _laws(self) -> tuple[bool, ...]:
        """Whether runs of one speed group share their parameters as they are, besides by the scaling with speed."""
        groups = speed_groups(self.records)
        return (False, True) if len(groups.speeds) < len(self.records) else (False,)

    def _base_trial(self, *, snapped: bool) -> Trial:
        layout = layout_of(self.records, self.axis, (), speed_groups(self.records, snapped=snapped))
        trial = refine(Problem(self.records, layout), start_vector(self.records, layout), self.floor)
        for effect in (e for e in self.catalogue if e.name in self.known):
            ground = ground_of(trial.problem, trial.x, trial.weights)
            promise = shortened(ground, promise_of(ground, effect))
            trial = refine(promise.problem, promise.start, trial.weights)
        return trial

    def _keep(self, judged: Judged) -> Hypothesis:
        key = frozenset(judged.trial.names)
        known = self.tried.get(key)
        if known is None or judged.likelihood > known.judged.likelihood + 1e-3:
            self.tried[key] = hypothesis_of(judged, self.validation)
        return self.tried[key]

    def grow(self, parent: Hypothesis, *, most: int | None = None, forced: bool = False) -> list[Hypothesis]:
        """Return the parent with each promising effect added, or with every one when forced, judged, best first."""
        key = frozenset(parent.names)
        if key not in self.grown_from:
            self.grown_from.add(key)
            most = most or (PROMISING if key == self.root else PROMISING_LATER)
            for promise, plain in self._promising(parent, most, forced=forced):
                self.report("+".join((*parent.names, promise.effect.name)))
                start = refine(promise.problem, promise.start, parent.judged.trial.weights).x if plain else promise.start
                child = judge(promise.problem, start, parent.judged.noise, self.family)
                self._keep(child)
                self._try_twin(child, promise.effect)
            self._free_runs(key)
        children = [h for k, h in self.tried.items() if len(k) == len(key) + 1 and key < k]
        return sorted(children, key=lambda h: -h.score)

    def _try_twin(self, judged: Judged, effect: Effect) -> None:
        """Judge the other start that has the same response at one speed; of two alike the smaller effect is kept."""
        problem, x = judged.trial.problem, judged.trial.x
        start = twin_of(problem, x, effect)
        if start is None:
            return
        twin = judge(problem, start, judged.noise, self.family)
        place = problem.layout.names.index(effect.coefficients[0].name)
        key = frozenset(judged.trial.names)
        if twin.likelihood > self.tried[key].judged.likelihood - TWINS and twin.trial.x[place] < x[place]:
            self.tried[key] = hypothesis_of(twin, self.validation)
        else:
            self._keep(twin)

    def _free_runs(self, key: frozenset[str]) -> None:
        """Give the best children with evidence the free run of plain output error where that predicts unseen runs better."""
        children = sorted((k for k in self.tried if len(k) == len(key) + 1 and key < k), key=lambda k: -self.tried[k].score)
        for child in children[:FREE_RUNS]:
            if self.tried[child].score > self.tried[key].score:
                self.tried[child] = with_free_run(self.tried[child], self.floor)

    def _promising(self, parent: Hypothesis, most: int, *, forced: bool) -> list[tuple[Promise, bool]]:
        """Return the promises worth judging, each with whether plain output error leads the way there."""
        trial, noise = parent.judged.trial, parent.judged.noise
        have = set(trial.names)
        left = [e for e in self.catalogue if e.name not in have]
        free_run = parent.plain or refine(trial.problem, trial.x, trial.weights)
        found: list[tuple[Promise, bool]] = []
        for at, weights, plain in ((free_run, free_run.weights, True), (trial, noise, False)):
            ground = ground_of(at.problem, at.x, weights)
            worth = GLIMPSE_PLAIN * ground.cost if plain else GLIMPSE
            promises = sorted((promise_of(ground, e) for e in left), key=lambda p: p.cost)
            kept = promises if forced else [p for p in promises[:most] if ground.cost - p.cost > worth]
            found += [(shortened(ground, p), plain) for p in kept]
            if plain and len(have) == len(self.known):
                found += [(self._shifted(ground, e), True) for e in left if shifts_time(e)]
        return found

    def _shifted(self, ground: Ground, effect: Effect) -> Promise:
        """Return the promise of an effect that shifts time, each scan point after a few rounds of descent.

        A model that misses a shift has bent all its numbers to make up for it: no first-order step sees past that, so
        the base starts anew from the measurement shifted back.
        """
        tried = []
        base = ground.problem.layout
        for values in shared_points(ground, effect):
            moved = [earlier(r, next(iter(values.values()))) for r in self.records]
            x = ground.x.copy()
            x[: base.shared] = start_vector(moved, base)[: base.shared]
            problem, start = grown(ground.problem, x, effect, values)
            found = descend(problem, start, ground.noise, rounds=SHIFT_ROUNDS, tolerance=1e-3)
            tried.append(Promise(effect, found.cost, start, found.x, problem))
        return min(tried, key=lambda p: p.cost)

    def best(self) -> Hypothesis:
        """Return the hypothesis the search ends at."""
        current = self.base()
        for size in range(LARGEST):
            children = self.grow(current)
            paying = next((c for c in children if self.pays(current, c)), None) or self._two_at_once(current, children)
            if paying is None:
                break
            current = self._swapped(paying) if size else paying
            if not self.asks_for_more(current):
                break
        found = self._pruned(current)
        return max((h for h in self.tried.values() if self.admissible(h)), key=lambda h: h.score, default=found)

    def _two_at_once(self, current: Hypothesis, children: Sequence[Hypothesis]) -> Hypothesis | None:
        """Return a pair that pays where the first of the two has evidence but the error falls with the second only."""
        first = next((c for c in children if self.likelier(current, c)), None)
        if first is None:
            return None
        return next((c for c in self.grow(first) if self.pays(first, c) and self.pays(current, c)), None)

    def admissible(self, h: Hypothesis) -> bool:
        """Whether every effect of a hypothesis is worth having: it pays over each smaller one that was tried."""
        key = frozenset(h.names)
        return all(self.pays(self.tried[k], h) for k in self.tried if k < key)

    def _swapped(self, found: Hypothesis) -> Hypothesis:
        """Drop each effect in turn and add the best other one; keep what scores higher."""
        best = found
        for gone in found.effects[:-1]:
            if gone.name in self.known:
                continue
            rest = frozenset(n for n in found.names if n != gone.name)
            if rest not in self.tried:
                continue
            for child in self.grow(self.tried[rest], most=PROMISING_INSTEAD)[:1]:
                if len(child.effects) == len(found.effects) and child.score > best.score:
                    best = child
        return best

    def _pruned(self, found: Hypothesis) -> Hypothesis:
        """Return the smallest tried subset that loses nothing worth having."""
        for key in sorted(self.tried, key=len):
            if self.root <= key < frozenset(found.names) and not self.pays(self.tried[key], found):
                return self.tried[key]
        return found

    def pays(self, without: Hypothesis, with_: Hypothesis) -> bool:
        """Whether an addition brings evidence and lowers the error on unseen runs by more than a trifle."""
        matters = MATTERS - MATTERS_MORE * max(0, len(with_.names) - 2)
        return self.likelier(without, with_) and self.misfit(with_) < matters * self.misfit(without)

    def likelier(self, without: Hypothesis, with_: Hypothesis) -> bool:
        """Whether an addition brings evidence, whatever it does to the free run."""
        learned = float(with_.by_run.sum() - without.by_run.sum()) > LEARNED
        return learned and with_.score - without.score > WORTH

    def misfit(self, h: Hypothesis) -> float:
        """Return the geometric mean of both channels' errors: the heading, where every error adds up, has no more say."""
        errors = h.errors.validation if self.validation else h.errors.train
        known = [e for e in (errors.angle_rms_rad, errors.rate_rms_rad_s) if np.isfinite(e)]
        return float(np.prod(known) ** (1.0 / len(known))) if known else float("inf")

    def error(self, h: Hypothesis) -> float:
        """Return the free-run error over the noise floor on unseen runs, on training runs where there are none."""
        return (h.errors.validation if self.validation else h.errors.train).over(self.floor)

    def asks_for_more(self, h: Hypothesis) -> bool:
        """Whether something is left above the noise, be it a disturbance or not."""
        return max(self.error(h), h.errors.train.over(self.floor)) > CLEAN

    def ranked(self) -> list[Hypothesis]:
        """Return all judged hypotheses, best score first."""
        return sorted(self.tried.values(), key=lambda h: -h.score)


def earlier(record: Record, late_s: float) -> Record:
    """Return a record whose measurement is taken late_s seconds later, as if it had not been late."""
    then = record.time + late_s

    def moved(values: FloatArray, ok: BoolArray) -> FloatArray:
        return np.interp(then, record.time[ok], values[ok]) if ok.any() else values

    return replace(record, angle=moved(record.angle, record.angle_ok), rate=moved(record.rate, record.rate_ok))


def shifts_time(effect: Effect) -> bool:
    """Whether an effect moves command against measurement in time: a scanned coefficient in s outside the hull."""
    return effect.stage is not Stage.HYDRODYNAMICS and any(c.unit == "s" and c.scan for c in effect.shared)


def usable(catalogue: Iterable[Effect], records: Sequence[Record]) -> tuple[tuple[Effect, ...], dict[str, str]]:
    """Return the effects whose signals every run has, and why each other one is skipped."""
    kept, skipped = [], {}
    for effect in catalogue:
        missing = sorted({role for role in effect.needs for r in records if role not in r.signals})
        if missing:
            skipped[effect.name] = f"needs {', '.join(missing)}, which the log lacks"
        else:
            kept.append(effect)
    return tuple(kept), skipped


def search(
    records: Sequence[Record],
    validation: Sequence[Record],
    axis: Axis,
    catalogue: Sequence[Effect],
    *,
    known: Sequence[str] = (),
    report: Callable[[str], None] = lambda _text: None,
) -> Search:
    """Return a search ready to go; known effects are part of its base."""
    floor = floor_of([*records, *validation])
    return Search(tuple(records), tuple(validation), axis, tuple(catalogue), floor, tuple(known), report=report)
