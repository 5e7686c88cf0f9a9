"""A hypothesis with one of its effects in another form than the textbook's, fitted from where the textbook's has led."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from fieldsid.diagnosis.beside import Beside
from fieldsid.diagnosis.hypothesis import Hypothesis, hypothesis_of, with_free_run
from fieldsid.diagnosis.trial import judge
from fieldsid.diagnosis.worth import WORSE, asks_for_more, likelier, refines, worse_unseen
from fieldsid.fitting.colour import residuals_of
from fieldsid.fitting.descent import Descent, cost_of, descend
from fieldsid.fitting.layout import Layout
from fieldsid.fitting.problem import Problem
from fieldsid.fitting.starts import carried
from fieldsid.logs.run import FloatArray
from fieldsid.models.effect import Coefficient, Effect, Form, Stage, Suggest, in_form
from fieldsid.models.model import Noise
from fieldsid.models.record import Record

LIKELY, GLIMPSE, KEPT, ROUNDS, COARSE = 6, 2, 3, 6, 1e-3
"""Starts of a form that are followed, for how many rounds, how many of them go on, for how many more before the best is
judged; and the share of the cost a round must gain."""
TRIFLE = 0.4
"""Log likelihood under the hypothesis' own noise that a form must have gained by then to be judged: the rest of the way brings
no more, and what unseen runs say of numbers that are next to nothing is next to nothing."""


@dataclass(frozen=True, slots=True)
class Plain:
    """A hypothesis to be put into other forms: the one `without` its last effect, and the effects whose forms are tried.

    Where it has no evidence over the one without, a form need not lower the error that it has. effects are by default all.
    """

    h: Hypothesis
    without: Hypothesis | None = None
    effects: Collection[str] | None = None

    def takes(self, formed: Hypothesis) -> bool:
        """Whether a form that is likelier is worth having."""
        return refines(self.h, formed) or not (self.without is None or likelier(self.without, self.h))


@dataclass(frozen=True, slots=True)
class Shaping:
    """How hypotheses are put into other forms: the noise they are judged under, the noise floor, and who helps."""

    told: Noise
    family: str
    floor: Noise
    beside: Beside

    def reshaped(self, asked: Sequence[Plain]) -> list[Hypothesis]:
        """Return hypotheses with their effects in other forms, the best one first, as long as that pays and something is left.

        The forms of all are judged at once: one hypothesis has many, another none.
        """
        asked, left = list(asked), [i for i, plain in enumerate(asked) if asks_for_more(plain.h, self.floor)]
        while left:
            best = zip(left, self._best_forms([asked[i] for i in left]), strict=True)
            likely = [(i, form) for i, form in best if form is not None and likelier(asked[i].h, form)]
            formed = self.beside.each(lambda of: with_free_run(of[1], self.floor).worked_out(fitted=True), likely)
            taken = {i: form for (i, _), form in zip(likely, formed, strict=True) if asked[i].takes(form)}
            for i, form in taken.items():
                asked[i] = replace(asked[i], h=form)
            left = [i for i, form in taken.items() if asks_for_more(form, self.floor)]
        return [plain.h for plain in asked]

    def _best_forms(self, asked: Sequence[Plain]) -> list[Hypothesis | None]:
        """Return of each hypothesis its likeliest form, besides its own, that gains anything, None where none does."""
        grounds = [_Ground.under(plain.h, self.floor) for plain in asked]
        forms = [
            (ground, e, form)
            for ground, plain in zip(grounds, asked, strict=True)
            for e in plain.h.effects
            if plain.effects is None or e.name in plain.effects
            for form in e.forms
        ]
        judged = list(zip(forms, self.beside.each(lambda of: self._judged_in(*of), forms), strict=True))
        found = [[h for (g, _, _), h in judged if g is ground and h is not None] for ground in grounds]
        return [max(of_one, key=lambda h: h.score, default=None) for of_one in found]

    def _judged_in(self, ground: _Ground, effect: Effect, form: Form) -> Hypothesis | None:
        h = ground.h
        problem, begun = _begun(h, effect, form, ground.left)
        if 0.5 * (ground.cost - begun.cost) < ground.least:
            return None
        judged = judge(problem, begun.x, h.judged.noise, self.told, self.family, rival=h.judged.likelihood)
        return hypothesis_of(judged, h.validation)


@dataclass(frozen=True, slots=True)
class _Ground:
    """What a hypothesis leaves of every run (2, n), the cost of that, and the log likelihood a form must gain to be judged.

    Where unseen runs are far worse than those fitted to, none: these may tell next to nothing of what those show.
    """

    h: Hypothesis
    left: Sequence[FloatArray]
    cost: float
    least: float

    @classmethod
    def under(cls, h: Hypothesis, floor: Noise) -> _Ground:
        """Return the ground of a hypothesis over a noise floor."""
        problem, x = h.judged.trial.problem, h.judged.trial.x
        least = -np.inf if worse_unseen(h, floor) > WORSE else TRIFLE
        return cls(h, residuals_of(problem, x), cost_of(problem, x, h.judged.noise), least)


def _begun(h: Hypothesis, effect: Effect, form: Form, left: Sequence[FloatArray]) -> tuple[Problem, Descent]:
    """Return the form's problem and the best of its starts after a few rounds under the hypothesis' noise.

    The edges of an actuator are sought again with the form's own numbers: a cost with edges has many ends.
    """
    trial, noise = h.judged.trial, h.judged.noise
    old = trial.problem.layout
    problem = trial.problem.with_effects([in_form(e, form) if e is effect else e for e in h.effects])
    records = trial.problem.records
    again = [{}, *_points(records, left, effect.suggest, effect.shared)] if effect.stage is Stage.ACTUATOR else [{}]
    points = [(point, edges) for point in _points(records, left, form.suggest, form.coefficients) for edges in again]
    starts = [_moved(problem.layout, carried(old, trial.x, problem.layout, point), edges) for point, edges in points]
    likely = sorted(starts, key=lambda x: cost_of(problem, x, noise))[:LIKELY]
    found = [descend(problem, x, noise, rounds=GLIMPSE, tolerance=COARSE) for x in likely]
    best = sorted(found, key=lambda d: d.cost)[:KEPT]
    return problem, min((descend(problem, d.x, noise, rounds=ROUNDS, tolerance=COARSE) for d in best), key=lambda d: d.cost)


def _points(
    records: Sequence[Record], left: Sequence[FloatArray], suggest: Suggest | None, coefficients: Sequence[Coefficient]
) -> list[dict[str, float]]:
    """Return the start values of shared coefficients: what is suggested by what is left, else the points of their grids."""
    if suggest is not None:
        return suggest(records, left)
    grids = {c.name: c.scan or (c.start,) for c in coefficients}
    return [dict(zip(grids, point, strict=True)) for point in product(*grids.values())]


def _moved(layout: Layout, x: FloatArray, values: Mapping[str, float]) -> FloatArray:
    """Return x with some shared slots at other values."""
    return np.array([values.get(s.name, v) for s, v in zip(layout.slots, x, strict=True)])
