"""The search over sets of effects: a best-first queue over one archive, from the bare model and from the whole hull.

The most evident model is expanded until it has been or leaves nothing above the noise: each effect of the catalogue is added to
it; what is then most evident is fitted without each of its effects, from its free run, under other laws of speed and trim, and
with other variants of its effects. The search starts from below, at the bare model, and from above, at the whole hull: first
together with the effects that were found from below and, where that leaves a visible error, without them. All starts lead to the
same sets of effects, and the better optimum of each set is kept. At the end the set found is fitted without each of its effects,
until all are needed.

Where one effect alone comes near the noise, the queue takes one more step from below before the whole hull is fitted. Otherwise a
servo lag, which gains much evidence and lowers the error little, would hide that effect, and the free cross state of the hull
would fit it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from fieldsid.diagnosis.data.noise_floor import is_noiseless, larger_of, resolution_floor
from fieldsid.diagnosis.evidence.acceptance import (
    compared_error,
    compared_share,
    keeps_error,
    leaves_error,
    worst_error,
)
from fieldsid.diagnosis.evidence.likelihood_fit import FittedProblem, LikelihoodFit
from fieldsid.diagnosis.evidence.noise_kind import fit_base, joint_noise_fit, sensor_noise
from fieldsid.diagnosis.evidence.scored_model import ScoredModel, score_model, with_free_run
from fieldsid.diagnosis.moves.archive import Archive, Names
from fieldsid.diagnosis.moves.drop_effect import drop_each
from fieldsid.diagnosis.moves.grounds import Grounds
from fieldsid.diagnosis.moves.grow import Growth
from fieldsid.diagnosis.moves.speed_law_search import (
    error_product,
    fit_base_output_error,
    other_speed_law,
    speed_laws,
    under_other_law,
)
from fieldsid.diagnosis.moves.variant_search import VariantRequest, try_variants
from fieldsid.diagnosis.parallel_map import ParallelMap
from fieldsid.diagnosis.search.accepted_sets import AcceptedSets
from fieldsid.diagnosis.search.budget import Budget
from fieldsid.diagnosis.search.given_model import refitted_from
from fieldsid.diagnosis.search.whole_hull import whole_hull, whole_hull_error
from fieldsid.diagnosis.thresholds import MIN_EXPLAINED_SHARE, MISSING_ERROR_RATIO, SUFFICIENT_ERROR_RATIO
from fieldsid.fitting.covariance.noise_selection import residuals_of
from fieldsid.fitting.optimise.unbounded_motion import refuse_unbounded_motion
from fieldsid.fitting.predict.speed_correction import error_of_speed
from fieldsid.fitting.problem.problem import Problem
from fieldsid.models.axis import Axis
from fieldsid.models.effect import Effect
from fieldsid.models.model import Model, Noise
from fieldsid.models.record import Record
from fieldsid.noise.white_floor import WhiteBounds, lowered_noise_floor, white_noise_floor
from fieldsid.numerics.arrays import FloatArray

MAX_CANDIDATES = 8
"""Largest number of models that a diagnosis shows in addition to the base."""


@dataclass(slots=True)
class Search:
    """A search on one set of runs. `known` effects are part of its base; `thorough` is one without a budget.

    `given` is the model with the known effects, where there is one: the base is also fitted from its values.

    `floor` is the lowest estimate of the sensors' noise so far. `is_noiseless` is whether every measured channel has less of it
    than a fiftieth of the base's error, or than the error that a measured speed makes: `floor` includes that error then. `white`
    are the bounds of the white noise of every fit.
    """

    records: tuple[Record, ...]
    validation: tuple[Record, ...]
    axis: Axis
    catalogue: Sequence[Effect]
    known: Sequence[str] = ()
    report: Callable[[str], None] = lambda _text: None
    thorough: bool = False
    given: Model | None = None
    floor: Noise = field(init=False)
    white: WhiteBounds = field(init=False)
    noise_kind: str = field(default="", init=False)
    is_noiseless: bool = field(default=False, init=False)
    tried: Archive = field(init=False)
    budget: Budget = field(init=False)
    parallel: ParallelMap = field(init=False)
    _accepted: tuple[tuple[object, ...], AcceptedSets] | None = field(default=None, init=False)

    def __post_init__(self) -> None:
        """Set the resolution floor to the sensors' noise, until the error of the base model is known."""
        both = (*self.records, *self.validation)
        self.floor = white_noise_floor(both)
        self.white = WhiteBounds.near(self.floor)
        self.tried = Archive(self.root)
        length = float(np.mean([len(r) for r in both]))
        self.budget = Budget(len(both), length, np.inf) if self.thorough else Budget(len(both), length)
        self.parallel = ParallelMap(both, self.catalogue, self.budget.evaluations)

    def best(self) -> ScoredModel:
        """Return the accepted set of effects with the highest log evidence."""
        self.expand(self.base())
        if self.leaves_visible_error() and self._one_effect_nears_noise() and (leading := self._next_to_expand()) is not None:
            self.expand(leading)
        for h in dict.fromkeys((frozenset(self.best_admissible().names), self.root)):
            if self.leaves_visible_error():
                self.enter_from_above(self.tried[h])
        while (leading := self._next_to_expand()) is not None:
            self.expand(leading)
        while self._eliminate(found := self.best_admissible()):
            self.share_own_moments()
        return found

    def enter_from_above(self, h: ScoredModel) -> None:
        """Fit a model with the effects of the whole hull added, then without each of its effects."""
        hull = self.refined(whole_hull(h, self.catalogue, self.tried, self.grounds))
        drop_each(hull, self.tried, self.grounds)
        self.share_own_moments()

    def _one_effect_nears_noise(self) -> bool:
        """Return whether a model with one effect comes near the noise: apart from a small effect, nothing else may be missing."""
        return any(worst_error(h, self.floor) <= MISSING_ERROR_RATIO for h in self.tried.children(self.root))

    def _eliminate(self, found: ScoredModel) -> bool:
        """Refine the set found, and fit it without each of its effects; return whether any model was fitted or became better."""
        if self.refined(found) is not found:
            return True
        return drop_each(found, self.tried, self.grounds)

    def expand(self, h: ScoredModel) -> None:
        """Add each effect to a model; fit the most evident one without each of its effects, in other variants and laws."""
        self.grow(h)
        drop_each(self.tried.most_evident(), self.tried, self.grounds)
        if self.may_go_on():
            self.refined(self.tried.most_evident())
        self.share_own_moments()
        self.lower_floor(self.best_admissible())

    def refined(self, h: ScoredModel) -> ScoredModel:
        """Return a model refitted from its output-error fit, under another law and in other variants, if each gains evidence."""
        names = frozenset(h.names)
        if not self.tried.is_refined(h):
            h = self.tried[names] = self.grounds.better(h, self.grounds.fit_from_the_free_run(h))
            under_other_law(h, self.tried, self.grounds)
            try_variants([VariantRequest(self.tried[names])], self.tried, self.grounds)
            self.tried.refined[names] = self.tried[names].log_evidence
        return self.tried[names]

    def grow(self, h: ScoredModel, *, forced: bool = False) -> list[ScoredModel]:
        """Return the models with one effect more, sorted by log evidence; `forced` fits every effect, not only those screened."""
        key = frozenset(h.names)
        if key not in self.tried.expanded:
            effects = [e for e in self.catalogue if e.name not in key]
            Growth(h, effects, self.tried, self.grounds, self.may_go_on, forced).grow()
        return self.tried.children(key)

    def _next_to_expand(self) -> ScoredModel | None:
        """Return the model of the highest log evidence; None where it was expanded, is at the noise, or no budget is left."""
        best = self.tried.most_evident()
        return best if self.may_go_on() and self._is_expandable(best) else None

    def _is_expandable(self, h: ScoredModel) -> bool:
        """Whether a model has not been expanded, does not diverge, and leaves an error above the noise floor.

        No other rule stops the growth of a set: the prior against each further effect does.
        """
        is_new = frozenset(h.names) not in self.tried.expanded
        return is_new and bool(np.isfinite(h.log_evidence)) and leaves_error(h, self.floor)

    # ----- the base

    @property
    def root(self) -> Names:
        """The names of the effects of the base."""
        return frozenset(self.known)

    def base(self) -> ScoredModel:
        """Return the model of the known effects alone."""
        if self.root not in self.tried:
            self.report("base model")
            known = [e for e in self.catalogue if e.name in self.known]
            fits = self.parallel.map(
                lambda groups: fit_base_output_error(self.records, self.axis, known, groups, self.floor, self.budget.evaluations),
                speed_laws(self.records),
            )
            fitted = min(fits, key=lambda t: error_product(t, self.axis))
            refuse_unbounded_motion(fitted.problem, fitted.x, "diagnose", instead="leave effects out of the model it starts from")
            self._settle_noise(fitted)
            ml_fit = fit_base(fitted, self.floor, self.white, self.parallel)
            self.noise_kind = ml_fit.noise_kind
            h = score_model(ml_fit, self.validation).evaluate_errors()
            own, other = with_free_run(h, fitted, self.floor), other_speed_law(h, self.grounds)
            if other is not None:
                other = self.with_free_run(other)
            self.tried[self.root] = own if other is None or not keeps_error(own, other) else other.evaluate_errors()
            try_variants([VariantRequest(self.tried[self.root])], self.tried, self.grounds)
            if self.given is not None:
                self.tried[self.root] = refitted_from(self.given, self.tried[self.root], self.grounds)
        return self.tried[self.root]

    # ----- the conditions under which models are compared

    def _settle_noise(self, fitted: FittedProblem) -> None:
        """Set the noise floor and the bounds of the white noise, given the output-error fit of the base.

        In a log without noise the likelihood would compare the smallest inconsistencies of the sensors. No model follows the
        motion more closely than the measured speed lets it, nor is any expected to leave less than the whole hull leaves: models
        are compared under at least that error.
        """
        with_speed = larger_of(self.floor, error_of_speed(fitted.problem, fitted.x))
        least = resolution_floor(with_speed, fitted.weights)
        self.is_noiseless = is_noiseless(self.floor, least, self.records)
        if self.is_noiseless:
            self.floor = with_speed
            self.report("whole hull")
            self.white = WhiteBounds.above(larger_of(least, whole_hull_error(fitted, self.catalogue, self.parallel)))
        else:
            self._lower_floor_by(fitted.problem, fitted.x)
            self.white = WhiteBounds.near(resolution_floor(self.floor, fitted.weights))

    @property
    def grounds(self) -> Grounds:
        """The records, the noise floor and the kind of noise under which all models are compared."""
        return Grounds(self.validation, self.floor, self.white, self.noise_kind, self.parallel, self.report)

    def lower_floor(self, h: ScoredModel) -> None:
        """Lower the noise floor to what the third differences of a model's residuals show."""
        fitted = h.likelihood_fit.fitted
        self._lower_floor_by(fitted.problem, fitted.x)

    def _lower_floor_by(self, problem: Problem, x: FloatArray) -> None:
        if not self.is_noiseless:
            self.floor = lowered_noise_floor(self.floor, self.records, residuals_of(problem, x))

    def share_own_moments(self) -> None:
        """Set, in every model, the standard deviation of the runs' moments that the most evident model estimates.

        The runs are the same for all models, and a model that lacks an effect mistakes part of it for trims that differ by run.
        """
        estimated = self.tried.most_evident().own_moment
        others = {name: h.with_own_moment(estimated) for name, h in self.tried.items() if h.own_moment != estimated}
        self.tried.update(others)

    # ----- what is found

    def may_go_on(self) -> bool:
        """Return whether evaluations remain."""
        return self.budget.remains(self._leaves_error_unexplained)

    def leaves_visible_error(self) -> bool:
        """Return whether the best accepted set has a larger error than a sufficient model, on fitted or on unseen runs."""
        return worst_error(self.best_admissible(), self.floor) > SUFFICIENT_ERROR_RATIO

    def leaves_unexplained(self) -> bool:
        """Whether the best accepted set leaves a visible error, or explains too small a share of the base model's error."""
        if self.leaves_visible_error():
            return True
        base, best = self.base(), self.best_admissible()
        is_visible = worst_error(base, self.floor) > SUFFICIENT_ERROR_RATIO
        return is_visible and compared_share(base, best, self.floor) < MIN_EXPLAINED_SHARE

    def _leaves_error_unexplained(self) -> bool:
        """Return whether the best accepted set leaves an unexplained error, by its errors or by the comparison of the verdict."""
        if self.leaves_unexplained():
            return True
        return compared_error(self.base(), self.best_admissible(), self.floor) > SUFFICIENT_ERROR_RATIO

    def evidences(self) -> Mapping[Names, float]:
        """Return the log evidence of each accepted set: log sum exp over the models whose accepted effects are that set."""
        return self._accepted_sets().evidences

    def _accepted_sets(self) -> AcceptedSets:
        """Return the accepted sets, recomputed only where a model or the floor has changed."""
        at, known = (self.floor, *self.tried.values()), self._accepted
        if known is None or len(at) != len(known[0]) or any(a is not b for a, b in zip(at, known[0], strict=True)):
            known = self._accepted = at, AcceptedSets.of(self.tried, self.floor)
        return known[1]

    def best_admissible(self) -> ScoredModel:
        """Return the model of the accepted set with the highest log evidence."""
        return self.tried[self._accepted_sets().best]

    def reported(self, h: ScoredModel) -> ScoredModel:
        """Return a model with the fit to be reported: without noise that by output error, where it is nearer to unseen runs."""
        return (self.with_free_run(h) if self.is_noiseless else h).evaluate_errors()

    def with_free_run(self, h: ScoredModel) -> ScoredModel:
        """Return a model with its output-error fit, where the free run of that is nearer to the validation runs."""
        known = h.output_error_fit is not None
        return h if known else with_free_run(h, h.likelihood_fit.fitted.by_output_error(), self.floor)

    def tested_fit(self, h: ScoredModel) -> LikelihoodFit:
        """Return the fit of a model whose innovations are tested: with coloured sensor noise beside the disturbance if likelier.

        Without noise, what a model leaves is not coloured sensor noise.
        """
        return h.likelihood_fit if self.is_noiseless else joint_noise_fit(h.likelihood_fit, self.parallel)

    def error_ratio(self, h: ScoredModel) -> float:
        """Return a model's selection error over the noise floor, with coloured sensor noise where the base has it."""
        return h.selection_errors.over(sensor_noise(self.floor, self.tried.get(self.root)))

    def ranked(self) -> list[ScoredModel]:
        """Return all scored models by log evidence, the best first, without those that diverge."""
        return self.tried.ranked()
