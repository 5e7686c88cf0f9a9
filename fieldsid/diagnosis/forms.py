"""A hypothesis with one of its effects in another form than the textbook's, fitted from where the textbook's has led."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
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
class Shaping:
    """How hypotheses are put into other forms: the noise they are judged under, the noise floor, and who helps."""

    told: Noise
    family: str
    floor: Noise
    beside: Beside

    def reshaped(
        self, h: Hypothesis, *, without: Hypothesis | None = None, effects: Collection[str] | None = None
    ) -> Hypothesis:  # fmt: skip
        """Return a hypothesis with its effects in other forms, the best one first, as long as that pays and something is left.

        Where it has no evidence over the one `without` its last effect, a form need not lower the error that it has.
        effects are those whose forms are tried, by default all.
        """
        while asks_for_more(h, self.floor):
            best = max(self.in_other_forms(h, effects), key=lambda other: other.score, default=h)
            if not likelier(h, best):
                break
            best = with_free_run(best, self.floor)
            if not refines(h, best) and (without is None or likelier(without, h)):
                break
            h = best
        return h

    def in_other_forms(self, h: Hypothesis, effects: Collection[str] | None = None) -> list[Hypothesis]:
        """Return a hypothesis with every form that gains anything of those its effects have besides their own, judged.

        Where unseen runs are far worse than those fitted to, every form: these may tell next to nothing of what those show.
        """
        trial, noise = h.judged.trial, h.judged.noise
        asked = [(e, form) for e in h.effects if effects is None or e.name in effects for form in e.forms]
        if not asked:
            return []
        left, before = residuals_of(trial.problem, trial.x), cost_of(trial.problem, trial.x, noise)
        least = -np.inf if worse_unseen(h, self.floor) > WORSE else TRIFLE

        def judged_in(of: tuple[Effect, Form]) -> Hypothesis | None:
            problem, begun = _begun(h, *of, left)
            if 0.5 * (before - begun.cost) < least:
                return None
            judged = judge(problem, begun.x, noise, self.told, self.family, rival=h.judged.likelihood)
            return hypothesis_of(judged, h.validation)

        return [other for other in self.beside.each(judged_in, asked) if other is not None]


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
