"""Moves of a search: each adds one effect to a model, or drops one, is fitted from its start, and is scored."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import chain
from typing import Any

import numpy as np

from fieldsid.diagnosis.evidence.acceptance import (
    errs_less,
    gains_any_evidence,
    gains_evidence,
    gains_training_evidence,
    is_accepted,
    leaves_error,
    only_validation_shows,
    worst_error,
)
from fieldsid.diagnosis.evidence.likelihood_fit import (
    MIN_LIKELIHOOD_GAIN,
    FittedProblem,
    LikelihoodFit,
    fit_maximum_likelihood,
    fit_output_error,
    likelihood_at,
    prefer_smaller_equivalent,
)
from fieldsid.diagnosis.evidence.predictive_density import most_log_density
from fieldsid.diagnosis.evidence.scored_model import ScoredModel, bic_penalty, prefer_output_error, score_model
from fieldsid.diagnosis.search.add_effect import (
    FOREMOST_EFFECTS,
    MAX_EFFECTS_AT_BASE,
    MAX_EFFECTS_LATER,
    Addition,
    SearchMove,
    by_effects,
    foremost,
    is_redundant_start,
    screen_additions,
)
from fieldsid.diagnosis.search.search_state import SearchState
from fieldsid.diagnosis.search.unseen_screen import moves_of_all_runs
from fieldsid.diagnosis.search.variant_search import VariantRequest
from fieldsid.diagnosis.thresholds import (
    ALTERNATIVE_LOG_ODDS,
    FAR_ERROR_RATIO,
    MAIN_EXPLAINED_SHARE,
    MAX_ERROR_RATIO,
    MISSING_ERROR_RATIO,
    RIVAL_LOG_ODDS,
    SUFFICIENT_ERROR_RATIO,
)
from fieldsid.fitting.initial.effect_screen import carry_parameters
from fieldsid.fitting.optimise.levenberg_marquardt import cost_of
from fieldsid.fitting.problem.problem import Problem
from fieldsid.models.effect import Effect
from fieldsid.numerics.arrays import FloatArray


@dataclass(slots=True)
class MoveEvaluation(SearchState):
    """A search that can add one effect to a model, or drop one, and score what comes of it."""

    def forward_step(self, parent: ScoredModel, *, forced: bool = False) -> list[ScoredModel]:
        """Return the parent with each effect that passes the screens, or with each when forced, fitted and scored, best first."""
        key = frozenset(parent.names)
        if key not in self.tried.progress.expanded:
            self.tried.progress.expanded.add(key)
            is_root, flown = key == self.root, key in self.tried.free_runs.screened or self._is_close(parent)
            most = None if forced else MAX_EFFECTS_AT_BASE if is_root else MAX_EFFECTS_LATER
            left = [e for e in self.catalogue if e.name not in key]
            [found] = screen_additions([Addition(parent, left, most, flown, anew=is_root)], self.parallel)
            self._fit_from_output_error(parent)
            self.tried.free_runs.screened.add(key)
            groups = by_effects(found)
            later = self._evaluate_moves(groups) if forced else self._evaluate_foremost(key, groups)
            if only_validation_shows(parent, self.floor):
                moves = moves_of_all_runs(parent, self._untried(parent), self.parallel)
                self._evaluate_moves(by_effects(moves), every=True)
            leading = {n for h in self._children(key)[:LEADING_CHILDREN] for n in h.names if n not in key}
            self._evaluate_moves(by_effects([w for w in later if w.screened.effect.name in leading]), every=True)
            self._refine_children(key)
        return self._children(key)

    def _evaluate_foremost(self, key: frozenset[str], groups: Sequence[Sequence[SearchMove]]) -> list[SearchMove]:
        """Evaluate the moves of the effects that promise most, then those of the others.

        Where the best child then leaves no visible error, of the others only what its effect may be mistaken for. Returns what
        `_evaluate_moves` does.
        """
        first = foremost(groups, FOREMOST_EFFECTS)
        later = self._evaluate_moves(first)
        best = self._children(key)[:1]
        explained = best if best and worst_error(best[0], self.floor) <= SUFFICIENT_ERROR_RATIO else []
        alike = {n for h in explained for e in h.effects if e.name not in key for n in e.mistaken_for}
        others = [group for group in groups if group not in first]
        return later + self._evaluate_moves([g for g in others if not explained or g[0].screened.effect.name in alike])

    def _is_close(self, parent: ScoredModel) -> bool:
        """Whether a model's free run is so near the noise that to first order its likelihood shows whatever its free run does."""
        return frozenset(parent.names) != self.root and worst_error(parent, self.floor) < MISSING_ERROR_RATIO

    def _refine_children(self, key: frozenset[str]) -> None:
        """Fit a model again from its best child, its leading children by output error and under other laws and variants."""
        if self._prefer_output_error(key, refit=self.may_go_on()):
            self._prefer_output_error(key, refit=False)
        if self.may_go_on(leading=True):
            self._try_laws_and_variants(key, self._leading(key))

    def _leading(self, key: frozenset[str]) -> list[frozenset[str]]:
        """Return the best children, and the one with most evidence on the training runs.

        A wrong speed law may hide the last on the validation runs. Only those that stay in question beside the first where it
        reaches the floor, or where the parent has effects and the child is near the floor or has a pair.
        """
        children = self._children(key)
        best = sorted(children, key=lambda h: -h.training_evidence)[:1]
        names = list(dict.fromkeys(frozenset(h.names) for h in (*children[:LEADING_CHILDREN], *best)))
        early = key == self.root or (
            len(key) < len(self.known) + TESTED_SUBSET_SIZE and any(self.error_ratio(h) > FAR_ERROR_RATIO for h in children[:1])
        )
        if early and any(leaves_error(h, self.floor) for h in children[:1]):
            return [n for n in names if self._is_worth_refining(self.tried[n], children[0], self.tried[key])]
        return [frozenset(h.names) for h in children if self._stays_in_question(h, children[0])]

    def _stays_in_question(self, h: ScoredModel, best: ScoredModel) -> bool:
        """Whether a model is a rival of its best sibling by log evidence, or leaves clearly less of fitted and of unseen runs.

        Its evidence may be lower only because its effect is there in another variant: a hull's cross flow, whose drag is no
        linear one, beside a dead band.
        """
        if best.log_evidence - h.log_evidence < RIVAL_LOG_ODDS:
            return True
        return leaves_error(best, self.floor) and errs_less(h, best, MAX_ERROR_RATIO)

    def _is_worth_refining(self, h: ScoredModel, best: ScoredModel, parent: ScoredModel) -> bool:
        """Whether a child may come to lead its best sibling in another variant or under another law.

        Any may where that leaves a visible error. Where it leaves none, what explains less of the parent's than it leaves is not
        the effect that is missing, in whatever variant.
        """
        if worst_error(best, self.floor) > SUFFICIENT_ERROR_RATIO or self._stays_in_question(h, best):
            return True
        return self.explained_share(parent, h) >= MAIN_EXPLAINED_SHARE

    def _fit_from_output_error(self, parent: ScoredModel) -> None:
        """Fit the children from the output-error fits found under another kind of noise: output error does not depend on it."""
        key = frozenset(parent.names)
        known = self.tried.free_runs.fits
        names = [n for n, free in known.items() if free and len(n) == len(key) + 1 and key < n and n not in self.tried]

        def fit_all(name: frozenset[str]) -> ScoredModel:
            found = dict[frozenset[str], ScoredModel]()
            for free in known[name]:
                effect = next(e for e in free.effects if e.name not in key)
                self._keep(self._fit_child(parent, free.problem, free.x, effect), found)
            return found[name].evaluate_errors()

        self.tried.update(zip(names, self.parallel.map(fit_all, names), strict=True))

    def _evaluate_moves(self, groups: Sequence[Sequence[SearchMove]], *, every: bool = False) -> list[SearchMove]:
        """Evaluate the moves to each set of effects; return those left out: an earlier start has reached their predicted cost.

        `every` leaves none out. All moves of a parent are compared with the same rival, so that the result does not depend on
        their order. What cannot come near a model is not kept, where one is given.
        """
        parents = {frozenset(move.parent.names) for group in groups for move in group}
        rivals = {p: max((h.log_likelihood for h in self._children(p)), default=-np.inf) for p in parents}

        def evaluate_all(group: Sequence[SearchMove]) -> tuple[ScoredModel | None, list[FittedProblem], list[int]]:
            key = group[0].names
            found = {key: self.tried[key]} if key in self.tried else {}
            free, later = list(self.tried.free_runs.fits.get(key, ())), list[int]()
            fits = [h.likelihood_fit for h in found.values()]
            for i, move in enumerate(group):
                if every or not fits or not is_redundant_start(move, max(fits, key=lambda f: f.log_likelihood)):
                    (start, flown), rival = self._start_of(move), rivals[frozenset(move.parent.names)]
                    free += flown
                    fits.append(self._fit_child(move.parent, move.screened.problem, start, move.screened.effect, rival))
                    if move.asked.near is None or self._may_come_near(move.asked.near, fits[-1]):
                        self._keep(fits[-1], found)
                else:
                    later.append(i)
            return found[key].evaluate_errors() if found else None, free, later

        left = []
        for group, (found, free, later) in zip(groups, self.parallel.map(evaluate_all, groups), strict=True):
            key = group[0].names
            self.tried.free_runs.fits[key] = free
            if found is not None:
                self.tried[key] = found
            left += [group[i] for i in later]
        return left

    def _untried(self, h: ScoredModel) -> list[Effect]:
        """Return the effects of the catalogue that were not tried beside those of a model."""
        return [e for e in self.catalogue if e.name not in h.names and frozenset((*h.names, e.name)) not in self.tried]

    def _try_added(self, asked: Sequence[Addition]) -> None:
        """Fit each model with each of its effects that passes the screen: see `screen_additions` and `_evaluate_moves`."""
        moves = screen_additions([addition for addition in asked if addition.effects], self.parallel)
        self._evaluate_moves(by_effects(chain.from_iterable(moves)))

    def _try_at(self, best: ScoredModel, pairs: Sequence[tuple[Sequence[Effect], Sequence[Effect]]]) -> None:
        """Fit some effects with each of some others, at the parameters of the best model, for each pair of the two."""
        self._try_added([Addition(self._moved(best, others), effects, near=best) for others, effects in pairs if effects])

    def _try_variants_near(self, best: ScoredModel, pairs: Sequence[tuple[Sequence[Effect], Sequence[Effect]]]) -> None:
        """Try what comes near the best by log evidence, of pairs some effects and one more, with what it lacks in variants."""
        keys = dict.fromkeys(frozenset((*(e.name for e in others), one.name)) for others, alike in pairs for one in alike)
        near = [h for k in keys if (h := self.tried.get(k)) and best.log_evidence - h.log_evidence < ALTERNATIVE_LOG_ODDS]
        self._try_variants([VariantRequest(h, set(h.names) - set(best.names)) for h in near])

    @staticmethod
    def _moved(h: ScoredModel, effects: Sequence[Effect]) -> ScoredModel:
        """Return a model with other effects at the parameters of one that was fitted, itself not fitted, to add to."""
        fitted = h.likelihood_fit.fitted
        problem = fitted.problem.with_effects(effects)
        x = carry_parameters(problem.layout, fitted.vector)
        at = replace(h.likelihood_fit, fitted=FittedProblem(problem, x, fitted.weights))
        return replace(h, likelihood_fit=replace(at, log_likelihood=likelihood_at(problem, x, at)))

    def _add_most_promising(self, h: ScoredModel) -> None:
        """Add to a model that there are no evaluations to expand what promises most to first order.

        Not what an effect of the model may be mistaken for: that takes a part of it, and is exchanged for it elsewhere.
        """
        alike = {n for e in h.effects for n in e.mistaken_for}
        self._try_added([Addition(h, [e for e in self._untried(h) if e.name not in alike], MAX_PROMISING)])

    def _may_come_near(self, h: ScoredModel, ml_fit: LikelihoodFit) -> bool:
        """Whether a fit may come near a model by log evidence, if it left nothing of the validation runs but the noise.

        Nor more than the model leaves; by chance it may leave less, which counts as much as a model near it lacks.
        """
        unseen = max(most_log_density(self.validation, self.floor), float(h.validation_log_density.sum()))
        most, least = ml_fit.log_likelihood + unseen, h.log_evidence - 2.0 * ALTERNATIVE_LOG_ODDS
        # the penalty, none of which is below nothing, asks for a linearisation
        return most > least and most - bic_penalty(ml_fit, self.validation) > least

    def _start_of(self, move: SearchMove) -> tuple[FloatArray, list[FittedProblem]]:
        """Return where the model that a move leads to is fitted from, and its output-error fit where that is made first."""
        screened = move.screened
        self.report("+".join((*move.parent.names, screened.effect.name)))
        if not move.by_output_error:
            return screened.start, []
        free = fit_output_error(screened.problem, screened.start, move.parent.likelihood_fit.fitted.weights)
        return free.x, [free]

    def _fit_child(
        self, parent: ScoredModel, p: Problem, start: FloatArray, effect: Effect, rival: float = -np.inf
    ) -> LikelihoodFit:  # fmt: skip
        """Fit by maximum likelihood from a start, and from the equivalent solution that has the same response at one speed."""
        ml_fit = fit_maximum_likelihood(
            p, start, parent.likelihood_fit.noise, self.resolution_floor, self.noise_kind, rival=rival
        )
        return prefer_smaller_equivalent(ml_fit, effect)

    def _drop_effect(self, h: ScoredModel, gone: Effect) -> ScoredModel:
        """Return a model without one of its effects, fitted from the parameters it has with it, the base's where they diverge."""
        fitted, noise = h.likelihood_fit.fitted, h.likelihood_fit.noise
        problem = fitted.problem.with_effects([e for e in h.effects if e is not gone])
        starts = [carry_parameters(problem.layout, fitted.vector)]
        if not np.isfinite(cost_of(problem, starts[0], noise)):
            # a hull that its sway alone holds straight runs away without it, and no descent begins there
            starts = [carry_parameters(problem.layout, self.base().likelihood_fit.fitted.vector, fitted.vector)]
        before = self.tried.get(frozenset(e.name for e in problem.layout.effects))
        if before is not None and any(e not in before.effects for e in problem.layout.effects):
            # in its variants the others' numbers may be far from those without it
            starts.append(carry_parameters(problem.layout, before.likelihood_fit.fitted.vector, fitted.vector))
        found = {} if before is None else {frozenset(before.names): before}
        for start in starts:
            kept = self._keep(fit_maximum_likelihood(problem, start, noise, self.resolution_floor, self.noise_kind), found)
        return kept if kept is before else prefer_output_error(kept, self.floor)

    def _takes_refit(self, key: frozenset[str], again: LikelihoodFit) -> bool:
        """Keep a model fitted again from its best child's parameters where that has more evidence; return whether it has.

        The cost may have several local minima. The leading children are then fitted again from the new parameters.
        """
        parent = self.tried[key]
        if again.log_likelihood <= parent.likelihood_fit.log_likelihood + MIN_LIKELIHOOD_GAIN:
            return False
        better = prefer_output_error(score_model(again, self.validation), self.floor)
        if better.log_evidence <= parent.log_evidence:
            return False
        self.tried[key] = better
        for ml_fit in self.parallel.map(lambda child: self._fit_from(child, better), self._children(key)[:LEADING_CHILDREN]):
            self._keep(ml_fit)
        return True

    def _fit_from(self, h: ScoredModel, other: ScoredModel) -> LikelihoodFit:
        """Fit a model from another model's parameters where that has them, from its own elsewhere."""
        here, there = h.likelihood_fit.fitted, other.likelihood_fit.fitted
        x = carry_parameters(here.problem.layout, there.vector, here.vector)
        return fit_maximum_likelihood(here.problem, x, other.likelihood_fit.noise, self.resolution_floor, self.noise_kind)

    def _fit_from_parts(self) -> None:
        """Fit again from a part of its effects each model that is less likely than that part.

        A model holds the optimum of each of its parts. One found since, beside other effects or in another order, it has missed.
        """
        known, missed = self.tried.progress.likelihood_of_part, list[tuple[ScoredModel, ScoredModel]]()
        for h in self.tried.values():
            part = max(self._parts(h), key=lambda part: part.log_likelihood, default=h)
            least = max(h.log_likelihood, known.get(frozenset(h.names), -np.inf))
            if part.log_likelihood > least + MIN_LIKELIHOOD_GAIN:
                missed.append((h, part))
        known.update((frozenset(h.names), part.log_likelihood) for h, part in missed)
        for ml_fit in self.parallel.map(lambda pair: self._fit_from(*pair), missed):
            self._keep(ml_fit)

    def _parts(self, h: ScoredModel) -> list[ScoredModel]:
        """Return the fitted models of one effect fewer that a model holds: the others in its variants, under its speed law."""
        names = set(h.likelihood_fit.fitted.problem.layout.names)
        less = ((w, w.likelihood_fit.fitted.problem.layout) for w in self._less(h))
        return [w for w, layout in less if names > set(layout.names) and all(e in h.effects for e in layout.effects)]

    def _prefer_output_error(self, key: frozenset[str], *, refit: bool) -> bool:
        """Give the leading children with more evidence than their parent their output-error fit, where that validates better.

        `refit`: beside that the parent is fitted again from the best child. Returns whether it was better so: then the children
        are those before their output-error fits.
        """
        parent, leading = self.tried[key], self._children(key)[:LEADING_CHILDREN]

        def flown(child: ScoredModel) -> ScoredModel:
            free = self.tried.free_runs.fits.get(frozenset(child.names), ())
            return prefer_output_error(child, self.floor, parent, free).evaluate_errors()

        jobs: list[Callable[[], Any]] = [partial(self._fit_from, parent, child) for child in leading[:1] if refit]
        again = len(jobs)
        jobs += [partial(flown, child) for child in leading if child.log_evidence > parent.log_evidence]
        done = self.parallel.map(lambda job: job(), jobs)
        if again and self._takes_refit(key, done[0]):
            return True
        self.tried.update({frozenset(child.names): child for child in done[again:]})
        return False

    def _try_laws_and_variants(self, key: frozenset[str], names: Sequence[frozenset[str]], *, every: bool = False) -> None:
        """Try another speed law and other variants of the effects for some children, kept where they have more evidence.

        Where no child gains evidence over all runs and the parent's error is large, or with `every`, all children are tried: the
        missing effect may be any of them in another variant, whatever follows the training runs alone.
        """
        parent = self.tried[key]
        lost = every or (
            self.error_ratio(parent) > MISSING_ERROR_RATIO and not any(gains_evidence(parent, self.tried[n]) for n in names)
        )
        names = [frozenset(c.names) for c in self._children(key)] if lost else names
        # forms of what the parent has were tried on it: the best child tries them again, and the one that goes on
        foremost = {*names[:1], *[n for n in names if is_accepted(parent, self.tried[n])][:1]}

        helping = [n for n in names if lost or gains_any_evidence(parent, self.tried[n])]
        self._try_other_speed_law([n for n in names if gains_training_evidence(parent, self.tried[n])])
        self._try_variants([VariantRequest(self.tried[n], None if n in foremost else n - key) for n in helping])


LEADING_CHILDREN = 3
"""Best children whose left-out moves are evaluated too, and which may take their output-error fit."""


MAX_PROMISING = 2
"""Effects that are added to the model found where no evaluations are left to expand it: of five effects that were injected into
36 hulls of other hands and missed, two were the first of that order and one the second."""


TESTED_SUBSET_SIZE = 2
"""Size of a set of effects whose subsets have all been tried before."""
