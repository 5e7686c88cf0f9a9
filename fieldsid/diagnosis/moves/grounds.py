"""The common conditions of all models of a search: validation runs, noise floor, kind of noise, and the worker process."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fieldsid.diagnosis.evidence.acceptance import excess_share
from fieldsid.diagnosis.evidence.likelihood_fit import LikelihoodFit, fit_maximum_likelihood
from fieldsid.diagnosis.evidence.scored_model import ScoredModel, bic_penalty, score_model
from fieldsid.diagnosis.parallel_map import ParallelMap
from fieldsid.diagnosis.thresholds import RIVAL_LOG_ODDS
from fieldsid.fitting.problem.problem import Problem
from fieldsid.models.model import Noise
from fieldsid.models.record import Record
from fieldsid.noise.white_floor import WhiteBounds
from fieldsid.numerics.arrays import FloatArray

SAME_OPTIMUM = 1e-3
"""Log likelihood within which two fits of the same effects have ended at the same optimum."""


@dataclass(frozen=True, slots=True)
class Grounds:
    """The common conditions under which models are compared, so that log evidences differ only because the effects differ.

    `floor` is the sensors' noise, `white` the bounds of the white noise of every fit, `noise_kind` its kind of noise.
    """

    validation: tuple[Record, ...]
    floor: Noise
    white: WhiteBounds
    noise_kind: str
    parallel: ParallelMap
    report: Callable[[str], None]

    def fit(self, problem: Problem, x: FloatArray, noise: Noise, *, rival: float = -np.inf) -> LikelihoodFit:
        """Return the maximum-likelihood fit from x and a noise; it stops early if it cannot reach the log likelihood `rival`."""
        return fit_maximum_likelihood(problem, x, noise, self.white, self.noise_kind, rival=rival)

    def fit_from_the_free_run(self, h: ScoredModel) -> LikelihoodFit:
        """Return the maximum-likelihood fit of a model from its output-error fit.

        Output error has no disturbance, so that this start is not at an optimum where the disturbance replaces an effect.
        """
        fitted = h.likelihood_fit.fitted
        return self.fit(fitted.problem, fitted.by_output_error().x, h.likelihood_fit.noise)

    def better(self, known: ScoredModel | None, ml_fit: LikelihoodFit) -> ScoredModel:
        """Return the scored model of a fit, or the known one of the same effects where that has more evidence.

        Where two optima are about equally likely on the training runs, such as an event at two times, the validation runs decide.
        """
        if known is None:
            return score_model(ml_fit, self.validation)
        evidence_gain = ml_fit.log_likelihood - bic_penalty(ml_fit, self.validation) - known.training_evidence
        if evidence_gain <= -RIVAL_LOG_ODDS or abs(evidence_gain) <= SAME_OPTIMUM:
            return known
        found = score_model(ml_fit, self.validation)
        return found if found.log_evidence > known.log_evidence else known

    def error_ratio(self, h: ScoredModel) -> float:
        """Return a model's selection error over the noise floor."""
        return h.selection_errors.over(self.floor)

    def explained_share(self, before: ScoredModel, h: ScoredModel) -> float:
        """Return the share of a model's excess squared error, on fitted and unseen runs, that another model explains."""
        was, left = ((one.selection_errors, one.train) for one in (before, h))
        return excess_share(was, left, self.floor)
