"""A fitted model with its free-run errors and its log evidence, by which models are ranked.

    log evidence = log L(training runs) + log p(validation runs | training runs) - 1/2 sum_j log n_j - prior log odds
The first and third terms are the Schwarz approximation of the evidence of the training runs, with the effective sample size n_j
of each coefficient (information.py); the second is the predictive density of the validation runs. The prior log odds are those
against each effect, and against each variant other than the textbook's.
Source: Schwarz 1978, Annals of Statistics 6(2); Kass and Raftery 1995, section 4; Berger, Bayarri and Pericchi 2014, Econometric
Reviews 33.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from fieldsid.diagnosis.evidence.likelihood_fit import (
    FittedProblem,
    LikelihoodFit,
    exchange_penalty,
    largest_own_moment,
    measured_count,
)
from fieldsid.diagnosis.evidence.predictive_density import ValidationRun, log_predictive_density, parameter_jacobian
from fieldsid.diagnosis.records import Errors, Pair
from fieldsid.diagnosis.thresholds import ALTERNATIVE_LOG_ODDS, EVIDENCE_TEMPERATURE
from fieldsid.fitting.predict.own_moment import FreeRun, free_run
from fieldsid.fitting.predict.predict import frozen_problem, refit_nuisances, with_command_timing
from fieldsid.fitting.predict.speed_correction import correct_speed, speed_sensitivity
from fieldsid.fitting.problem.parameters import group_name
from fieldsid.fitting.problem.problem import Problem
from fieldsid.models.axis import NAMES
from fieldsid.models.effect import Effect, definitions_of
from fieldsid.models.model import Model, Noise
from fieldsid.models.record import Record
from fieldsid.noise.own_moment import disturbance_mean_std
from fieldsid.noise.white_floor import white_noise_floor
from fieldsid.numerics.arrays import FloatArray

ValidationFits = tuple[tuple[Problem, FloatArray], ...]
FREE_RUNS = ("training_runs", "validation_runs", "settled_runs", "errors_by_moment")
"""Cached free runs and errors of a scored model that remain valid under another standard deviation of the runs' moments."""


@dataclass(frozen=True)
class ScoredModel:
    """A maximum-likelihood fit with its predictive density, penalty, and validation fits.

    `own_moment` (rad/s^2) is the standard deviation, over training and validation runs, of a constant moment that differs from
    run to run: the mean of the disturbance in each. `settled_residuals` [(2, n)] are the residuals of the validation runs at the
    posterior mean of the parameters after all runs. `output_error_fit` is an output-error fit that is reported instead where its
    free run is nearer to the validation runs. It is computed for the base model, for models that are shown but were not found,
    and in logs without noise for the one found.
    """

    likelihood_fit: LikelihoodFit
    validation_log_density: FloatArray
    complexity_penalty: float
    validation: tuple[Record, ...]
    validation_fits: ValidationFits
    own_moment: float = 0.0
    settled_residuals: tuple[FloatArray, ...] = ()
    output_error_fit: FittedProblem | None = None

    @property
    def reported_fit(self) -> FittedProblem:
        """The fit whose free run is reported."""
        return self.output_error_fit or self.likelihood_fit.fitted

    @property
    def model(self) -> Model:
        """The model of the reported fit."""
        fitted = self.reported_fit
        return bare_model(fitted.problem, fitted.x, self.noise)

    @property
    def noise(self) -> Noise:
        """The noise of training and validation runs."""
        return replace(self.likelihood_fit.noise, own_moment=self.own_moment)

    @property
    def errors(self) -> Pair:
        """Errors on the training and on the validation runs, with the initial state and a constant moment fitted for each run."""
        return Pair(self.train, self.validation_errors)

    @cached_property
    def training_runs(self) -> tuple[FreeRun, ...]:
        """Free runs on the training runs."""
        return training_runs(self.reported_fit)

    @cached_property
    def validation_runs(self) -> tuple[FreeRun, ...]:
        """Free runs on the validation runs."""
        flown = (
            self.validation_fits
            if self.output_error_fit is None
            else validation_fits(self.model, self.output_error_fit, self.validation)
        )
        return validation_runs(flown, self.validation)

    @cached_property
    def settled_runs(self) -> tuple[FreeRun, ...]:
        """Free runs on the validation runs at the posterior mean of the parameters after all runs."""
        return tuple(
            free_run(problem, x, 0, left, white_noise_floor([record]))
            for (problem, x), left, record in zip(self.validation_fits, self.settled_residuals, self.validation, strict=True)
        )

    @cached_property
    def train(self) -> Errors:
        """Errors on the training runs."""
        return self.train_under(self.own_moment)

    @cached_property
    def validation_errors(self) -> Errors:
        """Errors on the validation runs."""
        return self._errors_of("validation_runs", self.own_moment)

    @cached_property
    def errors_by_moment(self) -> dict[tuple[str, float], Errors]:
        """The errors computed so far, by the name of their free runs and `own_moment` (rad/s^2).

        A search compares each model with many others, under few moments.
        """
        return {}

    def _errors_of(self, runs: str, own_moment: float) -> Errors:
        """Return the errors of the free runs of this name, for a standard deviation (rad/s^2) of the runs' moments."""
        known = self.errors_by_moment
        if (runs, own_moment) not in known:
            known[runs, own_moment] = errors_of(getattr(self, runs), own_moment)
        return known[runs, own_moment]

    def with_own_moment(self, own_moment: float) -> ScoredModel:
        """Return the model with another standard deviation (rad/s^2) of the runs' moments and the same free runs."""
        other = replace(self, own_moment=own_moment)
        other.__dict__.update({name: runs for name, runs in self.__dict__.items() if name in FREE_RUNS})
        return other

    def train_under(self, own_moment: float) -> Errors:
        """Return the errors on the training runs for another standard deviation (rad/s^2) of the runs' moments."""
        return self._errors_of("training_runs", own_moment)

    def unseen_under(self, own_moment: float) -> tuple[Errors, ...]:
        """Return `unseen_errors` for another standard deviation (rad/s^2) of the runs' moments."""
        if not self.validation:
            return (self.train_under(own_moment),)
        return self._errors_of("validation_runs", own_moment), self._errors_of("settled_runs", own_moment)

    @property
    def selection_errors(self) -> Errors:
        """The errors by which models are selected: on the validation runs, or on the training runs where there are none."""
        return self.validation_errors if self.validation else self.train

    @property
    def unseen_errors(self) -> tuple[Errors, ...]:
        """The errors by which models are compared: at the training runs' parameters, and at the posterior mean after all runs.

        Training runs may leave a parameter undetermined that one validation run determines, such as a current on two headings:
        the first errors are then those of an arbitrary value.
        """
        return self.unseen_under(self.own_moment)

    def error_of_all_runs(self, floor: Noise) -> float:
        """Return the root mean square over training and validation runs of the error over a noise floor."""
        return float(np.sqrt(np.mean([run.over(floor) ** 2 for run in self.errors.runs])))

    def evaluate_errors(self) -> ScoredModel:
        """Return the model with its errors computed, so that the process that fitted it also computes them."""
        _ = self.errors
        return self

    @property
    def likelihood_model(self) -> Model:
        """The model of the maximum-likelihood fit."""
        return bare_model(self.likelihood_fit.fitted.problem, self.likelihood_fit.fitted.x, self.likelihood_fit.noise)

    @property
    def effects(self) -> tuple[Effect, ...]:
        """The effects of the model."""
        return self.likelihood_fit.fitted.effects

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the effects."""
        return self.likelihood_fit.fitted.names

    @property
    def training_share(self) -> float:
        """The share of all measured values that the training runs have."""
        records = self.likelihood_fit.fitted.problem.records
        return measured_count(records) / measured_count((*records, *self.validation))

    @property
    def trial_penalty(self) -> float:
        """The complexity penalty with the prior log odds once, since a trial needs less evidence than naming an effect."""
        return self.complexity_penalty - (EVIDENCE_TEMPERATURE - 1.0) * ALTERNATIVE_LOG_ODDS * len(self.names)

    @property
    def log_likelihood(self) -> float:
        """Log likelihood of the training runs."""
        return self.likelihood_fit.log_likelihood

    @property
    def training_evidence(self) -> float:
        """Log evidence of the training runs alone, up to a constant that all models share."""
        return self.log_likelihood - self.complexity_penalty

    @cached_property
    def log_evidence(self) -> float:
        """Log evidence up to a constant that all models share."""
        return self.training_evidence + float(self.validation_log_density.sum())


def score_model(ml_fit: LikelihoodFit, validation: Sequence[Record]) -> ScoredModel:
    """Return a maximum-likelihood fit with its log predictive density by validation run."""
    problem, x = ml_fit.fitted.problem, ml_fit.fitted.x
    flown = validation_fits(bare_model(problem, x, ml_fit.noise), ml_fit.fitted, validation)
    density, settled, own_moment = validation_log_density(ml_fit, validation, flown)
    span = float(np.mean([r.time[-1] - r.time[0] for r in problem.records]))
    own_moment = float(np.hypot(own_moment, disturbance_mean_std(ml_fit.noise, span)))
    return ScoredModel(
        ml_fit,
        density,
        bic_penalty(ml_fit, validation),
        tuple(validation),
        flown,
        min(own_moment, largest_own_moment(problem, x)),
        tuple(settled),
    )


def validation_fits(model: Model, fitted: FittedProblem, validation: Sequence[Record]) -> ValidationFits:
    """Return the one-run problems of the validation runs: the model's values fixed, each run's nuisances fitted."""
    evaluations = fitted.problem.evaluations
    problems = (frozen_problem(model, record, fitted.effects, evaluations) for record in validation)
    return tuple(with_command_timing(*p, model.noise) for p in problems)


def validation_log_density(
    ml_fit: LikelihoodFit, validation: Sequence[Record], flown: ValidationFits
) -> tuple[FloatArray, list[FloatArray], float]:
    """Return `log_predictive_density`; without validation runs empty results and the moments of the training runs."""
    if not validation:
        return np.zeros(0), [], ml_fit.noise.own_moment
    runs = []
    for (p, x), r in zip(flown, validation, strict=True):
        at = p.linearise(x, 0)
        left = at.residual if np.isfinite(at.residual).all() else free_run_residual(p, x)
        runs.append(ValidationRun(p, x, left, parameter_jacobian(ml_fit, p, r.speed), speed_sensitivity(p, x, r.speed), at))
    return log_predictive_density(ml_fit, runs, validation)


def free_run_residual(problem: Problem, x: FloatArray, run: int = 0) -> FloatArray:
    """Return the residual (2, n) of a run; where the motion grows without bound, the measurement less its median.

    A model that diverges predicts nothing: its error is that of a model without any motion.
    """
    residual, _ = problem.residual(x, run)
    if np.isfinite(residual).all():
        return residual
    r = problem.records[run]
    return np.stack([np.where(ok, v - (np.median(v[ok]) if ok.any() else 0.0), 0.0) for v, ok in zip(r.both, r.ok, strict=True)])


def with_free_run(h: ScoredModel, fitted: FittedProblem, floor: Noise) -> ScoredModel:
    """Return a model with an output-error fit to be reported, where the free run of that is nearer to the validation runs.

    Generalised least squares is efficient for a correct model, but may give a worse free run for a wrong one.
    """
    other = replace(h, output_error_fit=fitted)
    return other if other.selection_errors.over(floor) < h.selection_errors.over(floor) else h


def validation_runs(flown: ValidationFits, validation: Sequence[Record]) -> tuple[FreeRun, ...]:
    """Return the free runs on the validation runs, each run's speed and start refitted."""
    found = []
    for (flown_problem, start), record in zip(flown, validation, strict=True):
        floor = white_noise_floor([record])
        problem, x, _ = correct_speed(flown_problem, start, floor)
        x = refit_nuisances(problem, x, 0, floor, rescan=False)
        found.append(free_run(problem, x, 0, free_run_residual(problem, x), floor))
    return tuple(found)


def training_runs(fitted: FittedProblem) -> tuple[FreeRun, ...]:
    """Return the free runs of a fit on the training runs, each run's start refitted."""
    problem, found = fitted.problem, []
    for run, record in enumerate(problem.records):
        floor = white_noise_floor([record])
        x = refit_nuisances(problem, fitted.x, run, floor, rescan=False)
        found.append(free_run(problem, x, run, free_run_residual(problem, x, run), floor))
    return tuple(found)


def bic_penalty(ml_fit: LikelihoodFit, validation: Sequence[Record]) -> float:
    """Return the prior log odds and half the log of the effective sample size of each coefficient.

    Shared coefficients and authorities beyond the first count once; nuisances once for every run they fit, see `price_of_runs`.
    """
    layout, records = ml_fit.fitted.problem.layout, ml_fit.fitted.problem.records
    odds = ALTERNATIVE_LOG_ODDS
    total = sum(EVIDENCE_TEMPERATURE * odds + odds * e.is_formed + e.log_prior_penalty for e in layout.effects)
    beyond = {c.name for e in layout.effects for c in e.shared} | {
        group_name(NAMES[layout.axis].authority, layout.groups, i) for i in range(len(layout.groups.speeds))
    } - {NAMES[layout.axis].authority}
    sizes = ml_fit.information.sample_sizes
    total += 0.5 * float(np.log(sizes[[n in beyond for n in layout.names]]).sum())
    total += sum(price_of_runs(e, (*records, *validation)) for e in layout.effects)
    return float(total) + exchange_penalty(ml_fit)


def price_of_runs(effect: Effect, records: Sequence[Record]) -> float:
    """Return half the log of the sample size of each nuisance of an effect in each run: all samples of the run.

    The start of a hidden state decays soon and acts on few samples: it costs 1, as in the criterion of Akaike.
    """
    starts = bool(effect.extra_states) + sum(c.of_start for c in effect.nuisance)
    lasting = len(effect.nuisance) - sum(c.of_start for c in effect.nuisance)
    return sum(0.5 * lasting * float(np.log(max(measured_count([r]), 2))) + starts for r in records)


def errors_of(runs: Sequence[FreeRun], own_moment: float) -> Errors:
    """Return the errors of free runs, of all and of each, for a standard deviation (rad/s^2) of the runs' moments."""
    squares, counts = np.array([r.squares(own_moment) for r in runs]), np.array([r.counts for r in runs])
    if not runs:
        return Errors(float("nan"), float("nan"))
    each = tuple(_rms(*of) for of in zip(squares, counts, strict=True))
    return replace(_rms(squares.sum(axis=0), counts.sum(axis=0)), each=each)


def _rms(squares: FloatArray, counts: FloatArray) -> Errors:
    angle, rate = (float(np.sqrt(s / n)) if n else float("nan") for s, n in zip(squares, counts, strict=True))
    return Errors(angle, rate)


def bare_model(problem: Problem, x: FloatArray, noise: Noise) -> Model:
    """Return the model of a vector without covariance, for simulation only."""
    layout = problem.layout
    values = dict(zip(layout.names, x[: layout.shared].tolist(), strict=True))
    return Model(
        axis=layout.axis,
        effects=tuple(e.name for e in layout.effects),
        values=values,
        units={s.name: s.unit for s in layout.parameters[: layout.shared]},
        free=(),
        covariance=np.zeros((0, 0)),
        law=layout.law(values),
        noise=noise,
        own=definitions_of(layout.effects),
    )
