"""The search over variants of an effect, each fitted from the solution of the textbook's variant."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from fieldsid.diagnosis.evidence.acceptance import gains_evidence, keeps_error, leaves_error, validation_error_ratio
from fieldsid.diagnosis.evidence.likelihood_fit import MIN_LIKELIHOOD_GAIN
from fieldsid.diagnosis.evidence.scored_model import ScoredModel, score_model
from fieldsid.diagnosis.moves.archive import Archive
from fieldsid.diagnosis.moves.grounds import Grounds
from fieldsid.diagnosis.thresholds import MAX_VALIDATION_ERROR_RATIO
from fieldsid.fitting.covariance.noise_selection import residuals_of
from fieldsid.fitting.initial.effect_screen import carry_parameters
from fieldsid.fitting.optimise.levenberg_marquardt import Minimum, cost_of, levenberg_marquardt
from fieldsid.fitting.problem.parameters import ParameterLayout
from fieldsid.fitting.problem.problem import Problem
from fieldsid.models.effect import Coefficient, Effect, InitialGuesses, Stage, Variant, with_one_cross_state, with_variant
from fieldsid.models.model import Noise
from fieldsid.models.record import Record
from fieldsid.numerics.arrays import FloatArray

MAX_STARTS, SCREEN_ITERATIONS, MAX_CONTINUED_STARTS, CONTINUED_ITERATIONS, COST_TOLERANCE = 6, 2, 3, 6, 1e-3
"""Starts of a variant that are iterated, their iterations, how many of them continue, for how many iterations before the best is
fitted by maximum likelihood; and the share of the cost an iteration must gain."""
MIN_VARIANT_LIKELIHOOD_GAIN = 0.4
"""Log likelihood, under the noise of the model, that a variant must gain in these iterations: the remaining ones gain no more,
and coefficients near zero change nothing on the validation runs."""


@dataclass(frozen=True, slots=True)
class VariantRequest:
    """A request to try the effects of a model, by default all, in other variants."""

    model: ScoredModel
    effects: Collection[str] | None = None

    @property
    def key(self) -> tuple[frozenset[str], frozenset[str]]:
        """The names of the model's effects, and of those to be tried in other variants."""
        return frozenset(self.model.names), frozenset(self.model.names if self.effects is None else self.effects)


def try_variants(requests: Sequence[VariantRequest], tried: Archive, grounds: Grounds) -> bool:
    """Store models with the best variants of their effects, changed one at a time while accepted; return whether any changed.

    A change is accepted where it gains evidence and does not raise the validation error. All are fitted in one parallel map, as
    the models have different numbers of variants. A request that was tried before at the same evidence is skipped.
    """
    varied = tried.varied
    new = [r for r in requests if r.model.log_evidence > varied.get(r.key, -np.inf) + MIN_LIKELIHOOD_GAIN]
    requests, left = list(new), [i for i, request in enumerate(new) if leaves_error(request.model, grounds.floor)]
    while left:
        best = zip(left, _best_variants([requests[i] for i in left], grounds), strict=True)
        likely = [(i, variant) for i, variant in best if variant is not None and gains_evidence(requests[i].model, variant)]
        evaluated = grounds.parallel.map(lambda of: of[1].evaluate_errors(), likely)
        taken = {i: variant for (i, _), variant in zip(likely, evaluated, strict=True) if keeps_error(requests[i].model, variant)}
        for i, variant in taken.items():
            requests[i] = replace(requests[i], model=variant)
        left = [i for i, variant in taken.items() if leaves_error(variant, grounds.floor)]
    for request, found in zip(new, requests, strict=True):
        tried[frozenset(found.model.names)], varied[request.key] = found.model, found.model.log_evidence
    return any(found.model is not request.model for request, found in zip(new, requests, strict=True))


def _best_variants(requests: Sequence[VariantRequest], grounds: Grounds) -> list[ScoredModel | None]:
    """Return the variant of each model with the most evidence, None where no variant passes."""
    starts = [_VariantStart.under(request.model, grounds.floor) for request in requests]
    variants = [
        (start, e, variant)
        for start, request in zip(starts, requests, strict=True)
        for e in request.model.effects
        if request.effects is None or e.name in request.effects
        for variant in e.variants
        if with_variant(e, variant) in with_one_cross_state(_with_effect_in_variant(request.model.effects, e, variant))
    ]
    fitted = list(zip(variants, grounds.parallel.map(lambda of: _fit_variant(*of, grounds), variants), strict=True))
    found = [[h for (of, _, _), h in fitted if of is start and h is not None] for start in starts]
    return [max(of_one, key=lambda h: h.log_evidence, default=None) for of_one in found]


def _fit_variant(start: _VariantStart, effect: Effect, variant: Variant, grounds: Grounds) -> ScoredModel | None:
    """Return a model with one of its effects in a variant, None where that does not gain enough likelihood after a few steps."""
    h = start.model
    problem, begun = _best_start(h, effect, variant, start.residuals)
    if 0.5 * (start.cost - begun.cost) < start.min_gain:
        return None
    ml_fit = grounds.fit(problem, begun.x, h.likelihood_fit.noise, rival=h.likelihood_fit.log_likelihood)
    return score_model(ml_fit, h.validation)


@dataclass(frozen=True, slots=True)
class _VariantStart:
    """A model's residuals (2, n) of every run, their cost, and the log likelihood that a variant must gain to be fitted.

    No gain is required where the validation error is far above the training error: a variant may act on the validation runs
    alone.
    """

    model: ScoredModel
    residuals: Sequence[FloatArray]
    cost: float
    min_gain: float

    @classmethod
    def under(cls, h: ScoredModel, floor: Noise) -> _VariantStart:
        """Return the start of a model's variants over a noise floor."""
        problem, x = h.likelihood_fit.fitted.problem, h.likelihood_fit.fitted.x
        least = -np.inf if validation_error_ratio(h, floor) > MAX_VALIDATION_ERROR_RATIO else MIN_VARIANT_LIKELIHOOD_GAIN
        return cls(h, residuals_of(problem, x), cost_of(problem, x, h.likelihood_fit.noise), least)


def _best_start(h: ScoredModel, effect: Effect, variant: Variant, left: Sequence[FloatArray]) -> tuple[Problem, Minimum]:
    """Return the problem of a variant and the best of its starts after a few iterations under the model's noise.

    The edges of an actuator (dead band, limit) are scanned again together with the variant: a cost with edges has local minima.
    """
    fitted, noise = h.likelihood_fit.fitted, h.likelihood_fit.noise
    problem = fitted.problem.with_effects(_with_effect_in_variant(h.effects, effect, variant))
    records = fitted.problem.records
    again = [{}, *_start_points(records, left, effect.initial_guesses, effect.shared)] if effect.stage is Stage.ACTUATOR else [{}]
    points = [
        (point, edges) for point in _start_points(records, left, variant.initial_guesses, variant.coefficients) for edges in again
    ]
    starts = [
        _with_values(problem.layout, carry_parameters(problem.layout, fitted.vector), point | edges) for point, edges in points
    ]
    likely = sorted(starts, key=lambda x: cost_of(problem, x, noise))[:MAX_STARTS]
    found = [levenberg_marquardt(problem, x, noise, max_iterations=SCREEN_ITERATIONS, tolerance=COST_TOLERANCE) for x in likely]
    best = sorted(found, key=lambda d: d.cost)[:MAX_CONTINUED_STARTS]
    return problem, min(
        (levenberg_marquardt(problem, d.x, noise, max_iterations=CONTINUED_ITERATIONS, tolerance=COST_TOLERANCE) for d in best),
        key=lambda d: d.cost,
    )


def _with_effect_in_variant(effects: Sequence[Effect], effect: Effect, variant: Variant) -> list[Effect]:
    """Return the effects, one of them in another variant."""
    return [with_variant(e, variant) if e is effect else e for e in effects]


def _start_points(
    records: Sequence[Record], left: Sequence[FloatArray], suggest: InitialGuesses | None, coefficients: Sequence[Coefficient]
) -> list[dict[str, float]]:
    """Return start values of shared coefficients: initial guesses from the residuals, else the points of the scan grids."""
    if suggest is not None:
        return suggest(records, left)
    grids = {c.name: c.scan or (c.start,) for c in coefficients}
    return [dict(zip(grids, point, strict=True)) for point in product(*grids.values())]


def _with_values(layout: ParameterLayout, x: FloatArray, values: Mapping[str, float]) -> FloatArray:
    """Return x with some shared parameters at other values."""
    return np.array([values.get(s.name, v) for s, v in zip(layout.parameters, x, strict=True)])
