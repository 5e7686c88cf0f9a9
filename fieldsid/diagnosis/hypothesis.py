"""A judged hypothesis with its errors on training and on unseen runs, and the score hypotheses are ranked by.

    score = gain in log likelihood, training (fitted) + validation (not fitted) - 1/2 k log N - prior log odds
the Schwarz approximation of the evidence of the training runs times the predictive density of the unseen ones, and the prior
odds against each effect and each form other than the textbook's.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from fieldsid.diagnosis.predictive import Unseen, moves_of, predictive
from fieldsid.diagnosis.records import Errors, Pair
from fieldsid.diagnosis.trial import SETTLED, Judged, Trial, judge, likelihood_at, likelihood_by_run, refine, samples
from fieldsid.fitting.descent import cost_of
from fieldsid.fitting.noise import floor_of
from fieldsid.fitting.own_speed import at_own_speed, speed_doubt
from fieldsid.fitting.predict import frozen_problem, refit_own, with_times
from fieldsid.fitting.problem import Problem
from fieldsid.logs.run import FloatArray
from fieldsid.models.effect import Effect, definitions_of
from fieldsid.models.model import Model, Noise
from fieldsid.models.record import Record

PRIOR_ODDS = 6.0
"""Prior log odds against one effect of the catalogue being there, and against a form other than the textbook's: 400 to 1, for
the dozens of both that are tried."""

Flown = tuple[tuple[Problem, FloatArray], ...]


@dataclass(frozen=True)
class Hypothesis:
    """A judged trial: log likelihoods per training and validation run, price of its parameters, its free run.

    plain is the trial of output error alone, where that predicts unseen runs better.
    """

    judged: Judged
    by_run: FloatArray
    unseen: FloatArray
    cost: float
    validation: tuple[Record, ...]
    flown: Flown
    plain: Trial | None = None

    @property
    def shown(self) -> Trial:
        """The trial whose free run is shown."""
        return self.plain or self.judged.trial

    @property
    def model(self) -> Model:
        """Its model."""
        trial = self.shown
        return bare_model(trial.problem, trial.x, self.judged.noise)

    @property
    def errors(self) -> Pair:
        """Errors of the model on the runs it was fitted to and on the runs it was not, each run's own start at its best."""
        return Pair(self.train, self.unseen_errors)

    @cached_property
    def train(self) -> Errors:
        """Errors on the runs it was fitted to."""
        return training_errors(self.shown)

    @cached_property
    def unseen_errors(self) -> Errors:
        """Errors on the runs it was not fitted to."""
        flown = self.flown if self.plain is None else flown_by(self.model, self.plain, self.validation)
        return unseen_errors(flown, self.validation)

    @property
    def judging(self) -> Errors:
        """The errors a hypothesis is judged by: on unseen runs, on training runs where there are none."""
        return self.unseen_errors if self.validation else self.train

    def worked_out(self, *, fitted: bool = False) -> Hypothesis:
        """Return itself with the errors it is judged by known: worked out where it was found, beside others.

        fitted: those on the runs it was fitted to as well, which few are asked for.
        """
        _ = self.errors if fitted else self.judging
        return self

    @property
    def own_model(self) -> Model:
        """The model of the generalised least squares, the one its likelihood belongs to."""
        return bare_model(self.judged.trial.problem, self.judged.trial.x, self.judged.noise)

    @property
    def effects(self) -> tuple[Effect, ...]:
        """The effects of the hypothesis."""
        return self.judged.trial.effects

    @property
    def names(self) -> tuple[str, ...]:
        """Their names."""
        return self.judged.trial.names

    @property
    def score(self) -> float:
        """Log evidence up to a constant that all hypotheses share."""
        return float(self.by_run.sum() + self.unseen.sum() - self.cost)


def hypothesis_of(judged: Judged, validation: Sequence[Record]) -> Hypothesis:
    """Return a judged trial with its likelihood on the runs it was fitted to and on the runs it was not."""
    problem, x = judged.trial.problem, judged.trial.x
    flown = flown_by(bare_model(problem, x, judged.noise), judged.trial, validation)
    return Hypothesis(
        judged,
        likelihood_by_run(problem, x, judged.noise),
        unseen_likelihood(judged, validation, flown),
        price(judged, validation),
        tuple(validation),
        flown,
    )


def flown_by(model: Model, trial: Trial, validation: Sequence[Record]) -> Flown:
    """Return the one-run problems of unseen runs with the model's values held, their own slots at their best under its noise."""
    return tuple(with_times(*frozen_problem(model, record, trial.effects), model.noise) for record in validation)


def unseen_likelihood(judged: Judged, validation: Sequence[Record], flown: Flown) -> FloatArray:
    """Return each validation run's log predictive likelihood."""
    if not validation:
        return np.zeros(0)
    runs = [
        Unseen(p, x, left_over(p, x), moves_of(judged, p, r.speed), speed_doubt(p, x, r.speed), p.linearise(x, 0))
        for (p, x), r in zip(flown, validation, strict=True)
    ]
    return predictive(judged, runs, validation)


def left_over(problem: Problem, x: FloatArray, run: int = 0) -> FloatArray:
    """Return the residual (2, n) of a run; where the motion grows without bound, all that was measured.

    A model that diverges says nothing of the run: it is judged as one that predicts no motion at all.
    """
    residual, _ = problem.residual(x, run)
    if np.isfinite(residual).all():
        return residual
    r = problem.records[run]
    return np.stack([np.where(ok, v - (np.median(v[ok]) if ok.any() else 0.0), 0.0) for v, ok in zip(r.both, r.ok, strict=True)])


def with_free_run(h: Hypothesis, floor: Noise, parent: Hypothesis | None = None, known: Sequence[Trial] = ()) -> Hypothesis:
    """Return the hypothesis with the free run of plain output error where that predicts unseen runs better.

    Generalised least squares is efficient when the hypothesis is right and may lose the free run when it is not. Its
    numbers must not contradict what the parent's noise weighs most, as a gyro's scale that bends the rate of a free run
    contradicts the heading. known are free runs found before. Where the free run is the more likely one too, the
    hypothesis was judged at another end than its best, and is judged from there.
    """
    trial, names = h.judged.trial, h.judged.trial.problem.layout.names
    free = [refine(trial.problem, trial.x, trial.weights), *(t for t in known if t.problem.layout.names == names)]
    other = replace(h, plain=min(free, key=lambda t: t.weights.angle * t.weights.rate))
    if other.judging.over(floor) >= h.judging.over(floor) or (parent is not None and _contradicts(other, parent)):
        return h
    flown, judged = other.shown, h.judged
    if likelihood_at(flown.problem, flown.x, judged) < judged.likelihood + SETTLED:
        return other
    again = judge(flown.problem, flown.x, judged.noise, judged.floor, judged.family)
    h = hypothesis_of(again, h.validation)
    other = replace(h, plain=flown)
    return other if other.judging.over(floor) < h.judging.over(floor) else h


def _contradicts(h: Hypothesis, parent: Hypothesis) -> bool:
    costs = (cost_of(t.problem, t.x, parent.judged.noise) for t in (h.shown, parent.shown))
    return bool(next(costs) > next(costs))


def unseen_errors(flown: Flown, validation: Sequence[Record]) -> Errors:
    """Return the errors on unseen runs, each run's own speed and start at their best for them."""
    left = []
    for (flown_problem, start), record in zip(flown, validation, strict=True):
        floor = floor_of([record])
        problem, x, _ = at_own_speed(flown_problem, start, floor)
        left.append(left_over(problem, refit_own(problem, x, 0, floor, anew=False)))
    return errors_of(validation, left)


def training_errors(trial: Trial) -> Errors:
    """Return the errors of a trial on the runs it was fitted to, each run's own start at its best for them."""
    problem = trial.problem
    left = []
    for run, record in enumerate(problem.records):
        left.append(left_over(problem, refit_own(problem, trial.x, run, floor_of([record]), anew=False), run))
    return errors_of(problem.records, left)


def price(judged: Judged, validation: Sequence[Record]) -> float:
    """Return the prior log odds and 1/2 k log N.

    Shared coefficients and authorities beyond the first count once, nuisances once for every run they fit.

    The start of a hidden state is soon forgotten and speaks on few samples: it costs 1, as Akaike has it.
    """
    layout, records = judged.trial.problem.layout, judged.trial.problem.records
    own = sum(len(e.nuisance) for e in layout.effects)
    hidden = sum(1 for e in layout.effects if e.extra_states)
    count = sum(len(e.shared) for e in layout.effects) + (0 if layout.groups.by_law else len(layout.groups.speeds) - 1)
    total = sum(PRIOR_ODDS * (1 + e.is_formed) + e.handicap for e in layout.effects) + 0.5 * count * np.log(samples(records))
    for record in (*records, *validation):
        total += 0.5 * own * np.log(max(samples([record]), 2)) + hidden
    return float(total)


def errors_of(records: Sequence[Record], residuals: Sequence[FloatArray]) -> Errors:
    """Return the pooled rms of residuals (2, n) over the measured samples of all runs, and that of each run."""
    each = tuple(_pooled([r], [e]) for r, e in zip(records, residuals, strict=True))
    return replace(_pooled(records, residuals), each=each)


def _pooled(records: Sequence[Record], residuals: Sequence[FloatArray]) -> Errors:
    values = []
    for channel in range(2):
        ok = [r.ok[channel] for r in records]
        squares = sum(float(np.sum(e[channel][m] ** 2)) for e, m in zip(residuals, ok, strict=True))
        count = sum(int(m.sum()) for m in ok)
        values.append(float(np.sqrt(squares / count)) if count else float("nan"))
    return Errors(values[0], values[1])


def bare_model(problem: Problem, x: FloatArray, noise: Noise) -> Model:
    """Return the model of a vector without covariance, for simulation only."""
    layout = problem.layout
    values = dict(zip(layout.names, x[: layout.shared].tolist(), strict=True))
    return Model(
        axis=layout.axis,
        effects=tuple(e.name for e in layout.effects),
        values=values,
        units={s.name: s.unit for s in layout.slots[: layout.shared]},
        free=(),
        covariance=np.zeros((0, 0)),
        law=layout.law(values),
        noise=noise,
        own=definitions_of(layout.effects),
    )
