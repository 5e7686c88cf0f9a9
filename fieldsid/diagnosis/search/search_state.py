"""What a search over sets of effects has found so far: scored models, noise kinds, the noise floor, the budget."""

from __future__ import annotations

from collections.abc import Callable, Mapping, MutableMapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np

from fieldsid.diagnosis.data.noise_floor import is_noiseless, resolution_floor
from fieldsid.diagnosis.evidence.acceptance import (
    compared_error,
    compared_share,
    excess_share,
    is_accepted,
    keeps_error,
    leaves_error,
    lowers_error,
    settles_error,
    worst_error,
)
from fieldsid.diagnosis.evidence.likelihood_fit import MIN_LIKELIHOOD_GAIN, FittedProblem, LikelihoodFit
from fieldsid.diagnosis.evidence.noise_kind import fit_base, sensor_noise
from fieldsid.diagnosis.evidence.scored_model import ScoredModel, bic_penalty, prefer_output_error, score_model
from fieldsid.diagnosis.parallel_map import ParallelMap
from fieldsid.diagnosis.search.archive import Archive, Names
from fieldsid.diagnosis.search.budget import Budget
from fieldsid.diagnosis.search.model_spec import Assumptions
from fieldsid.diagnosis.search.speed_law_search import (
    TrimLawSearch,
    error_product,
    fit_base_output_error,
    other_speed_law,
    speed_laws,
)
from fieldsid.diagnosis.search.variant_search import FormSearch, VariantRequest
from fieldsid.diagnosis.thresholds import (
    EXPLAINED_ERROR_RATIO,
    MIN_EXPLAINED_SHARE,
    RIVAL_LOG_ODDS,
    SUFFICIENT_ERROR_RATIO,
)
from fieldsid.fitting.covariance.noise_selection import residuals_of
from fieldsid.fitting.optimise.unbounded_motion import refuse_unbounded_motion
from fieldsid.models.axis import Axis
from fieldsid.models.effect import Effect
from fieldsid.models.model import Noise
from fieldsid.models.record import Record
from fieldsid.noise.white_floor import lowered_noise_floor, white_noise_floor

SAME_OPTIMUM = 1e-3
"""Log likelihood within which two fits of the same effects have ended at the same optimum."""


@dataclass(frozen=True, slots=True)
class _Sums:
    """The log evidence of each accepted set at a floor, assumptions and models, kept so that no other has their identity."""

    at: tuple[object, ...]
    models: tuple[ScoredModel, ...]
    evidences: Mapping[Names, float]


@dataclass(slots=True)
class SearchState:
    """Everything tried so far on one set of runs, by the set of effects; known effects are part of its base."""

    records: tuple[Record, ...]

    validation: tuple[Record, ...]

    axis: Axis

    catalogue: Sequence[Effect]

    known: Sequence[str] = ()

    report: Callable[[str], None] = lambda _text: None

    thorough: bool = False
    """Whether the evaluation budget is unlimited."""

    floor: Noise = field(init=False)

    tried: Archive = field(default_factory=Archive)
    """Every model tried, by its spec."""

    trim_laws: TrimLawSearch = field(default_factory=TrimLawSearch)

    resolution_floor: Noise = field(init=False)

    is_noiseless: bool = False
    """Whether the base model's error is more than a hundred times the noise in every measured channel."""

    parallel: ParallelMap = field(init=False)

    budget: Budget = field(init=False)

    _sums: _Sums | None = field(default=None, init=False)

    def __post_init__(self) -> None:
        """Compare models down to the sensors' noise until the error of the base model is known."""
        both = (*self.records, *self.validation)
        self.resolution_floor = self.floor = white_noise_floor(both)
        length = float(np.mean([len(r) for r in both]))
        self.budget = Budget(len(both), length, np.inf) if self.thorough else Budget(len(both), length)
        self.parallel = ParallelMap(both, self.catalogue, self.budget.evaluations, self._place)

    def _place(self) -> int:
        """Return a number that is equal in two searches that have come to the same place."""
        evidences = ((k, h.log_evidence if np.isfinite(h.log_evidence) else None) for k, h in self.tried.items())
        return hash((self.budget.evaluations.count, self.tried.assumptions, tuple(evidences)))

    @property
    def noise_kind(self) -> str:
        """The kind of noise that models are compared under; empty until the base model has been fitted."""
        return self.tried.assumptions.noise_kind if self.tried.assumptions else ""

    @property
    def root(self) -> frozenset[str]:
        """The effects of the base."""
        return frozenset(self.known)

    def base(self) -> ScoredModel:
        """Return the model of the known effects alone."""
        if self.root not in self.tried:
            self.report("base model")
            assumed = self.tried.assumptions
            laws = speed_laws(self.records, trim_of_fin=assumed.trim_of_fin if assumed else None)
            known = [e for e in self.catalogue if e.name in self.known]
            fits = self.parallel.map(
                lambda groups: fit_base_output_error(self.records, self.axis, known, groups, self.floor, self.budget.evaluations),
                laws,
            )
            fitted = min(fits, key=lambda t: error_product(t, self.axis))
            refuse_unbounded_motion(fitted.problem, fitted.x, "diagnose", instead="leave effects out of the model it starts from")
            self.is_noiseless = is_noiseless(self.floor, resolution_floor(self.floor, fitted.weights), self.records)
            self.update_noise_floor(fitted)
            self.resolution_floor = resolution_floor(self.floor, fitted.weights)
            ml_fit = fit_base(fitted, self.floor, self.resolution_floor, self.noise_kind, self.parallel)
            self.tried.assumptions = Assumptions(ml_fit.noise_kind, fitted.problem.layout.groups.trim_of_fin)
            h = self._keep(ml_fit).evaluate_errors()
            # both ways ask for its errors: two processes would compute and count them twice
            _ = h.unseen_errors
            ways: tuple[Callable[[], Any], ...] = (partial(prefer_output_error, h, self.floor), partial(self._under_other_law, h))
            own, other = self.parallel.map(lambda way: way(), ways)
            self.tried[self.root] = own if other is None or not keeps_error(own, other) else other
            self._try_variants([VariantRequest(self.tried[self.root])])
        return self.tried[self.root]

    def may_go_on(self, *, leading: bool = False) -> bool:
        """Whether evaluations are left; with the model that leads the search goes on for longer while an error is visible."""
        return (leading and self.may_follow_leading()) or self.budget.remaining(self._misses_something)

    def may_follow_leading(self) -> bool:
        """Whether an error is visible and the search may go on from the model that leads, if from no other."""
        return self.budget.remains_for_leading and self.leaves_visible_error()

    def leaves_visible_error(self) -> bool:
        """Whether the best accepted set leaves more than a sufficient model may, on fitted or on unseen runs."""
        return worst_error(self.best_admissible(), self.floor) > SUFFICIENT_ERROR_RATIO

    def leaves_unexplained(self) -> bool:
        """Whether the best accepted set leaves a visible error, or explains less of one than stands whatever is left."""
        if self.leaves_visible_error():
            return True
        base, best = self.base(), self.best_admissible()
        is_visible = worst_error(base, self.floor) > SUFFICIENT_ERROR_RATIO
        return is_visible and compared_share(base, best, self.floor) < MIN_EXPLAINED_SHARE

    def _misses_something(self) -> bool:
        """Whether the best accepted set leaves that, or an error that the verdict counts although those shown are small."""
        if self.leaves_unexplained():
            return True
        return compared_error(self.base(), self.best_admissible(), self.floor) > SUFFICIENT_ERROR_RATIO

    def explained_share(self, before: ScoredModel, h: ScoredModel) -> float:
        """Return the share of what a model leaves above the noise, on fitted and on unseen runs, that another explains."""
        was, left = ((one.selection_errors, one.train) for one in (before, h))
        return excess_share(was, left, self.floor)

    def update_noise_floor(self, fitted: FittedProblem) -> None:
        """Lower the noise floor to what the third differences of a fit's residuals show, unless the log is noiseless."""
        if not self.is_noiseless:
            self.floor = lowered_noise_floor(self.floor, self.records, residuals_of(fitted.problem, fitted.x))

    def share_own_moments(self) -> None:
        """Let every model have the moments of the runs' own that the one of the highest evidence tells: the runs are the same.

        A model that lacks an effect takes part of it for trims that differ from run to run.
        """
        told = self._most_evident().own_moment
        others = {name: h.with_own_moment(told) for name, h in self.tried.items() if h.own_moment != told}
        self.tried.update(others)

    def _keep(self, ml_fit: LikelihoodFit, among: MutableMapping[Names, ScoredModel] | None = None) -> ScoredModel:
        """Keep a fit where it has more evidence than the one known of its effects, and return that of these effects.

        The likelier one may validate worse: where two optima are about as likely after the training runs, as an event's at two
        times, the validation runs decide. `among` models of its own a function that is mapped keeps it: what it changes here is
        seen in one process only.
        """
        tried = self.tried if among is None else among
        key = frozenset(ml_fit.fitted.names)
        known, cost = tried.get(key), bic_penalty(ml_fit, self.validation)
        lead = (
            np.inf
            if known is None
            else ml_fit.log_likelihood - cost - known.likelihood_fit.log_likelihood + known.complexity_penalty
        )
        if lead > -RIVAL_LOG_ODDS and abs(lead) > SAME_OPTIMUM:
            found = score_model(ml_fit, self.validation)
            tried[key] = found if known is None or found.log_evidence > known.log_evidence else known
        return tried[key]

    def _children(self, key: frozenset[str]) -> list[ScoredModel]:
        """Return the models of one effect more that were tried, the best first."""
        children = [h for k, h in self.tried.items() if len(k) == len(key) + 1 and key < k]
        return sorted(children, key=lambda h: -h.log_evidence)

    def _try_other_speed_law(self, names: Sequence[frozenset[str]]) -> None:
        """Fit models under the other speed law, and keep that where it has more evidence."""
        others = self.parallel.map(lambda name: self._under_other_law(self.tried[name]), names)
        self.tried.update({name: other for name, other in zip(names, others, strict=True) if other is not None})

    def _under_other_law(self, h: ScoredModel) -> ScoredModel | None:
        """Return a model under the other speed law where that has more evidence, None elsewhere."""
        other = other_speed_law(h, self.resolution_floor, self.noise_kind, asks_for_more=leaves_error(h, self.floor))
        return None if other is None else prefer_output_error(other, self.floor).evaluate_errors()

    def _try_variants(self, asked: Sequence[VariantRequest]) -> None:
        """Try other variants of the models' effects, unless that was done at the same evidence."""
        at = self.tried.progress.evidence_at_variants
        asked = [p for p in asked if p.model.log_evidence > at.get(p.key, -np.inf) + MIN_LIKELIHOOD_GAIN]
        formed = FormSearch(self.resolution_floor, self.noise_kind, self.floor, self.parallel).try_variants(asked)
        for request, h in zip(asked, formed, strict=True):
            self.tried[frozenset(h.names)], at[request.key] = h, h.log_evidence

    def _most_evident(self) -> ScoredModel:
        """Return the model of the highest log evidence, whether or not its effects are accepted."""
        return max(self.tried.values(), key=lambda h: h.log_evidence)

    def core_of(self, h: ScoredModel) -> frozenset[str]:
        """Return the accepted effects of a model: the rest is left out, one at a time, where the model without it is as good.

        An effect that gains evidence beside all else stays where it lowers the error, though it may gain none once a small one is
        left out: what that leaves in fast samples, a disturbance takes up with the rest. So does one that ends a visible error
        and is a rival by evidence.
        """
        floor = sensor_noise(self.floor, self.tried.get(self.root))
        least = self._least_to_explain(floor)
        proven = {name for name, w in self._without_each(h) if is_accepted(w, h, floor, least)}
        while idle := [
            w
            for name, w in self._without_each(h)
            if not (
                is_accepted(w, h, floor, least)
                or (name in proven and lowers_error(w, h, floor, least))
                or settles_error(w, h, floor)
            )
        ]:
            h = max(idle, key=lambda w: w.log_evidence)
        return frozenset(h.names)

    def _least_to_explain(self, floor: Noise) -> float:
        """Return the error over a floor that is one to explain: a visible one, and any where the base leaves a visible one."""
        visible = worst_error(self.base(), floor) > SUFFICIENT_ERROR_RATIO
        return EXPLAINED_ERROR_RATIO if visible else SUFFICIENT_ERROR_RATIO

    def _without_each(self, h: ScoredModel) -> list[tuple[str, ScoredModel]]:
        """Return each effect of a model whose absence was tried, with the fitted model that lacks it."""
        left = ((n, frozenset(h.names) - {n}) for n in h.names if n not in self.known)
        return [(n, self.tried[k]) for n, k in left if k in self.tried]

    def _less(self, h: ScoredModel) -> list[ScoredModel]:
        """Return the fitted models that lack one of a model's effects."""
        return [w for _, w in self._without_each(h)]

    def evidences(self) -> Mapping[frozenset[str], float]:
        """Return the log evidence of each accepted set: log sum exp over the models whose accepted effects are that set."""
        models = tuple(self.tried.values())
        at = (self.floor, self.tried.assumptions, *map(id, models))
        if self._sums is None or self._sums.at != at:
            sums: dict[frozenset[str], float] = {}
            for h in self.ranked():
                core = self.core_of(h)
                sums[core] = float(np.logaddexp(sums.get(core, -np.inf), h.log_evidence))
            self._sums = _Sums(at, models, sums)
        return self._sums.evidences

    def admissible(self, h: ScoredModel) -> bool:
        """Whether every effect of a model is accepted."""
        return self.core_of(h) == frozenset(h.names)

    def best_admissible(self) -> ScoredModel:
        """Return the model of the accepted set with the highest log evidence."""
        sums = self.evidences()
        return self.tried[max(sums, key=lambda k: sums[k])]

    def error_ratio(self, h: ScoredModel) -> float:
        """Return a model's selection error over the noise floor, with coloured sensor noise where the base has it."""
        return h.selection_errors.over(sensor_noise(self.floor, self.tried.get(self.root)))

    def ranked(self) -> list[ScoredModel]:
        """Return all scored models by log evidence, the best first, without those that diverge."""
        return sorted((h for h in self.tried.values() if np.isfinite(h.log_evidence)), key=lambda h: -h.log_evidence)
