"""The move that adds an effect: screen all effects, fit the most promising, and try other variants of the best."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from fieldsid.diagnosis.evidence.acceptance import (
    errs_less,
    gains_any_evidence,
    gains_evidence,
    leaves_error,
    worst_error,
)
from fieldsid.diagnosis.evidence.likelihood_fit import (
    LikelihoodFit,
    fit_output_error,
)
from fieldsid.diagnosis.evidence.scored_model import ScoredModel
from fieldsid.diagnosis.moves.add_effect import (
    FOREMOST_EFFECTS,
    MAX_EFFECTS_AT_BASE,
    MAX_EFFECTS_LATER,
    Addition,
    SearchMove,
    by_effects,
    foremost,
    is_redundant_start,
    screen_addition,
)
from fieldsid.diagnosis.moves.archive import Archive, Names
from fieldsid.diagnosis.moves.grounds import Grounds
from fieldsid.diagnosis.moves.refit import with_events_of_parts
from fieldsid.diagnosis.moves.variant_search import VariantRequest, try_variants
from fieldsid.diagnosis.thresholds import (
    MAIN_EXPLAINED_SHARE,
    MAX_ERROR_RATIO,
    MISSING_ERROR_RATIO,
    RIVAL_LOG_ODDS,
    SUFFICIENT_ERROR_RATIO,
)
from fieldsid.models.effect import Effect

LEADING_CHILDREN = 3
"""Number of best children that are tried in other variants."""


@dataclass(frozen=True, slots=True)
class Growth:
    """The additions to one model, the archive that stores them, and the conditions under which they are compared."""

    parent: ScoredModel
    effects: Sequence[Effect]
    tried: Archive
    grounds: Grounds
    may_refine: Callable[[], bool]
    forced: bool = False
    """Whether each effect is fitted from all its starts, without a screen."""

    @property
    def key(self) -> Names:
        """The names of the parent's effects."""
        return frozenset(self.parent.names)

    def grow(self) -> None:
        """Store in the archive the fits of the parent with each effect that passes the screens."""
        is_root = self.key == self.tried.known
        self.tried.expanded.add(self.key)
        most = None if self.forced else MAX_EFFECTS_AT_BASE if is_root else MAX_EFFECTS_LATER
        flown = is_root or worst_error(self.parent, self.grounds.floor) > SUFFICIENT_ERROR_RATIO
        groups = by_effects(screen_addition(Addition(self.parent, self.effects, most, flown=flown), self.grounds.parallel))
        if self.forced:
            self.evaluate(groups)
        else:
            self._evaluate_foremost(groups)
        if self.may_refine():
            self._try_variants(self._leading())

    def _evaluate_foremost(self, groups: Sequence[Sequence[SearchMove]]) -> None:
        """Fit the most promising effects, then the others.

        Where the best child already leaves no visible error, only effects that may be confused with its effects are fitted after
        it.
        """
        first = foremost(groups, FOREMOST_EFFECTS)
        self.evaluate(first)
        best = self.tried.children(self.key)[:1]
        explained = [h for h in best if worst_error(h, self.grounds.floor) <= SUFFICIENT_ERROR_RATIO]
        alike = {n for h in explained for e in h.effects if e.name not in self.key for n in e.mistaken_for}
        others = [group for group in groups if group not in first]
        self.evaluate([g for g in others if not explained or g[0].screened.effect.name in alike])

    def evaluate(self, groups: Sequence[Sequence[SearchMove]]) -> None:
        """Fit the moves to each set of effects, except those whose predicted cost an earlier fit has reached.

        All are compared with the same rival, so that the result does not depend on their order.
        """
        rival = max((h.log_likelihood for h in self.tried.children(self.key)), default=-np.inf)

        def evaluate_all(group: Sequence[SearchMove]) -> ScoredModel | None:
            found = self.tried.get(group[0].names)
            fits = [] if found is None else [found.likelihood_fit]
            for move in group:
                if fits and is_redundant_start(move, max(fits, key=lambda f: f.log_likelihood)):
                    continue
                fits.append(self._fitted(move, rival))
                found = self.grounds.better(found, fits[-1])
            found = found and with_events_of_parts(found, group[0].screened.effect.name, self.tried, self.grounds)
            return found and found.evaluate_errors()

        for group, found in zip(groups, self.grounds.parallel.map(evaluate_all, groups), strict=True):
            if found is not None:
                self.tried[group[0].names] = found

    def _fitted(self, move: SearchMove, rival: float) -> LikelihoodFit:
        """Fit the model of a move by maximum likelihood, first by output error where it was screened by that."""
        screened, of_parent = move.screened, move.parent.likelihood_fit
        self.grounds.report("+".join((*move.parent.names, screened.effect.name)))
        start = screened.start
        if move.by_output_error:
            start = fit_output_error(screened.problem, start, of_parent.fitted.weights).x
        return self.grounds.fit(screened.problem, start, of_parent.noise, rival=rival)

    def _leading(self) -> list[Names]:
        """Return the children worth refining: the best few, and the one with most evidence on the training runs.

        The latter may rank low only because the validation runs are far from its textbook variant.
        """
        children = self.tried.children(self.key)
        best = sorted(children, key=lambda h: -h.training_evidence)[:1]
        names = list(dict.fromkeys(frozenset(h.names) for h in (*children[:LEADING_CHILDREN], *best)))
        if self.key == self.tried.known:
            return [n for n in names if self._is_worth_refining(self.tried[n], children[0])]
        return [frozenset(h.names) for h in children if self._is_undecided(h, children[0])]

    def _is_undecided(self, h: ScoredModel, best: ScoredModel) -> bool:
        """Whether a model is a rival of its best sibling by log evidence, or has a clearly lower error on fitted and unseen runs.

        Its evidence may be lower only because the vehicle has another variant of its effect.
        """
        if best.log_evidence - h.log_evidence < RIVAL_LOG_ODDS:
            return True
        return leaves_error(best, self.grounds.floor) and errs_less(h, best, MAX_ERROR_RATIO)

    def _is_worth_refining(self, h: ScoredModel, best: ScoredModel) -> bool:
        """Whether a child may overtake its best sibling in another variant.

        Any child may while the sibling leaves a visible error. Otherwise a child that explains less than half of the parent's
        error is not the missing effect in any variant.
        """
        if worst_error(best, self.grounds.floor) > SUFFICIENT_ERROR_RATIO or self._is_undecided(h, best):
            return True
        return self.grounds.explained_share(self.tried[self.key], h) >= MAIN_EXPLAINED_SHARE

    def _needs_all_variants(self, children: Sequence[ScoredModel]) -> bool:
        """Return whether the parent's error is large and no child gains evidence, so that all children are tried in variants."""
        large = self.grounds.error_ratio(self.tried[self.key]) > MISSING_ERROR_RATIO
        return large and not any(gains_evidence(self.tried[self.key], child) for child in children)

    def _try_variants(self, names: Sequence[Names]) -> None:
        """Try some children in other variants of the effect added, and store those with more evidence.

        Where no child gains evidence over all runs and the parent's error is large, all children are tried.
        """
        tried, parent = self.tried, self.tried[self.key]
        tries_all = self._needs_all_variants([tried[n] for n in names])
        names = [frozenset(c.names) for c in tried.children(self.key)] if tries_all else names
        promising = [n for n in names if tries_all or gains_any_evidence(parent, tried[n])]
        try_variants([VariantRequest(tried[n], n - self.key) for n in promising], tried, self.grounds)
