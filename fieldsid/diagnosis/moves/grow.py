"""The move that adds an effect: screen all effects, fit those that promise most, refine the best in variants and speed laws."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from fieldsid.diagnosis.evidence.acceptance import (
    errs_less,
    gains_any_evidence,
    gains_evidence,
    leaves_error,
    only_validation_shows,
    worst_error,
)
from fieldsid.diagnosis.evidence.likelihood_fit import (
    MIN_LIKELIHOOD_GAIN,
    LikelihoodFit,
    fit_output_error,
    prefer_smaller_equivalent,
)
from fieldsid.diagnosis.evidence.scored_model import ScoredModel, score_model, with_free_run
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
from fieldsid.diagnosis.moves.speed_law_search import under_other_law
from fieldsid.diagnosis.moves.unseen_screen import moves_of_all_runs
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
"""Best children whose left-out moves are evaluated too, and which are fitted again where their parent has a better optimum."""


@dataclass(frozen=True, slots=True)
class Growth:
    """The additions to one model: the archive that they are kept in, and the grounds that they are compared on."""

    parent: ScoredModel
    effects: Sequence[Effect]
    tried: Archive
    grounds: Grounds
    may_refine: Callable[[], bool]
    forced: bool = False
    """Whether each effect is fitted from all its starts, whatever it promises."""

    @property
    def key(self) -> Names:
        """The parent's effects."""
        return frozenset(self.parent.names)

    def grow(self) -> None:
        """Put into the archive the parent with each effect that passes the screens."""
        is_root, tried, floor = self.key == self.tried.known, self.tried, self.grounds.floor
        tried.expanded.add(self.key)
        flown = is_root or worst_error(self.parent, floor) >= MISSING_ERROR_RATIO
        most = None if self.forced else MAX_EFFECTS_AT_BASE if is_root else MAX_EFFECTS_LATER
        found = screen_addition(Addition(self.parent, self.effects, most, flown, anew=is_root), self.grounds.parallel)
        groups = by_effects(found)
        later = self.evaluate(groups) if self.forced else self._evaluate_foremost(groups)
        if only_validation_shows(self.parent, floor):
            untried = [e for e in self.effects if self.key | {e.name} not in tried]
            self.evaluate(by_effects(moves_of_all_runs(self.parent, untried, self.grounds.parallel)), every=True)
        leading = {n for h in tried.children(self.key)[:LEADING_CHILDREN] for n in h.names if n not in self.key}
        self.evaluate(by_effects([move for move in later if move.screened.effect.name in leading]), every=True)
        self._refit_parent()
        if is_root and self._is_lost(tried.children(self.key)):
            rest = [e for e in self.effects if e.variants and self.key | {e.name} not in tried]
            self.evaluate(by_effects(screen_addition(Addition(self.parent, rest), self.grounds.parallel)))
        if self.may_refine():
            self._try_laws_and_variants(self._leading())

    def _evaluate_foremost(self, groups: Sequence[Sequence[SearchMove]]) -> list[SearchMove]:
        """Fit the effects that promise most, then the others; return the starts that were left out.

        Where the best child already leaves no visible error, only effects that may be mistaken for its own are fitted after it.
        """
        first = foremost(groups, FOREMOST_EFFECTS)
        later = self.evaluate(first)
        best = self.tried.children(self.key)[:1]
        explained = [h for h in best if worst_error(h, self.grounds.floor) <= SUFFICIENT_ERROR_RATIO]
        alike = {n for h in explained for e in h.effects if e.name not in self.key for n in e.mistaken_for}
        others = [group for group in groups if group not in first]
        return later + self.evaluate([g for g in others if not explained or g[0].screened.effect.name in alike])

    def evaluate(self, groups: Sequence[Sequence[SearchMove]], *, every: bool = False) -> list[SearchMove]:
        """Fit the moves to each set of effects; return the moves skipped because an earlier start reached their predicted cost.

        `every` skips none. All moves are compared with the same rival, so that the result does not depend on their order.
        """
        rival = max((h.log_likelihood for h in self.tried.children(self.key)), default=-np.inf)

        def evaluate_all(group: Sequence[SearchMove]) -> tuple[ScoredModel | None, list[int]]:
            found, later = self.tried.get(group[0].names), list[int]()
            fits = [] if found is None else [found.likelihood_fit]
            for i, move in enumerate(group):
                if not every and fits and is_redundant_start(move, max(fits, key=lambda f: f.log_likelihood)):
                    later.append(i)
                    continue
                fits.append(self._fitted(move, rival))
                found = self.grounds.better(found, fits[-1])
            return found and found.evaluate_errors(), later

        left = []
        for group, (found, later) in zip(groups, self.grounds.parallel.map(evaluate_all, groups), strict=True):
            if found is not None:
                self.tried[group[0].names] = found
            left += [group[i] for i in later]
        return left

    def _fitted(self, move: SearchMove, rival: float) -> LikelihoodFit:
        """Fit the model of a move by maximum likelihood, and from the equivalent solution with the same response at one speed.

        A move screened by output error is first fitted by output error.
        """
        screened, of_parent = move.screened, move.parent.likelihood_fit
        self.grounds.report("+".join((*move.parent.names, screened.effect.name)))
        start = screened.start
        if move.by_output_error:
            start = fit_output_error(screened.problem, start, of_parent.fitted.weights).x
        ml_fit = self.grounds.fit(screened.problem, start, of_parent.noise, rival=rival)
        return prefer_smaller_equivalent(ml_fit, screened.effect)

    def _refit_parent(self) -> None:
        """Keep the parent fitted again from its best child's parameters where that has more evidence, and its children with it.

        The cost may have several local minima. The leading children are then fitted again from the new parameters.
        """
        parent, leading = self.tried[self.key], self.tried.children(self.key)[:LEADING_CHILDREN]
        if not leading:
            return
        again = self.grounds.fit_from(parent, leading[0])
        if again.log_likelihood <= parent.log_likelihood + MIN_LIKELIHOOD_GAIN:
            return
        better = score_model(again, self.grounds.validation)
        if parent.output_error_fit is not None:
            better = with_free_run(better, parent.output_error_fit, self.grounds.floor)
        if better.log_evidence <= parent.log_evidence:
            return
        self.tried[self.key] = better
        fits = self.grounds.parallel.map(lambda child: self.grounds.fit_from(child, better), leading)
        self.tried.update({frozenset(h.names): self.grounds.better(h, fit) for h, fit in zip(leading, fits, strict=True)})

    def _leading(self) -> list[Names]:
        """Return the children worth refining: the best few, and the one with most evidence on the training runs.

        The latter may rank low only because a wrong speed law spoils it on the validation runs.
        """
        children = self.tried.children(self.key)
        best = sorted(children, key=lambda h: -h.training_evidence)[:1]
        names = list(dict.fromkeys(frozenset(h.names) for h in (*children[:LEADING_CHILDREN], *best)))
        if self.key == self.tried.known:
            return [n for n in names if self._is_worth_refining(self.tried[n], children[0])]
        return [frozenset(h.names) for h in children if self._stays_in_question(h, children[0])]

    def _stays_in_question(self, h: ScoredModel, best: ScoredModel) -> bool:
        """Whether a model is a rival of its best sibling by log evidence, or has a clearly lower error on fitted and unseen runs.

        Its evidence may be lower only because the vehicle has another variant of its effect.
        """
        if best.log_evidence - h.log_evidence < RIVAL_LOG_ODDS:
            return True
        return leaves_error(best, self.grounds.floor) and errs_less(h, best, MAX_ERROR_RATIO)

    def _is_worth_refining(self, h: ScoredModel, best: ScoredModel) -> bool:
        """Whether a child may overtake its best sibling in another variant or under another speed law.

        Any child may while the sibling leaves a visible error. Otherwise a child that explains less than half of the parent's
        error is not the missing effect in any variant.
        """
        if worst_error(best, self.grounds.floor) > SUFFICIENT_ERROR_RATIO or self._stays_in_question(h, best):
            return True
        return self.grounds.explained_share(self.tried[self.key], h) >= MAIN_EXPLAINED_SHARE

    def _is_lost(self, children: Sequence[ScoredModel]) -> bool:
        """Whether the parent's error is large and no child gains evidence: any child may be the missing effect in a variant."""
        large = self.grounds.error_ratio(self.tried[self.key]) > MISSING_ERROR_RATIO
        return large and not any(gains_evidence(self.tried[self.key], child) for child in children)

    def _try_laws_and_variants(self, names: Sequence[Names]) -> None:
        """Try some children under another speed law and with other variants; keep what has more evidence.

        Where no child gains evidence over all runs and the parent's error is large, all children are tried.
        """
        tried, parent = self.tried, self.tried[self.key]
        lost = self._is_lost([tried[n] for n in names])
        names = [frozenset(c.names) for c in tried.children(self.key)] if lost else names
        helping = [n for n in names if lost or gains_any_evidence(parent, tried[n])]
        under_other_law(names, tried, self.grounds)
        try_variants([VariantRequest(tried[n], n - self.key) for n in helping], tried, self.grounds)
