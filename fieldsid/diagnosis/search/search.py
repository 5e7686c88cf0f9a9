"""The search over sets of effects: best first, by forward steps, exchanges and backward elimination over one archive."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from itertools import chain

import numpy as np

from fieldsid.diagnosis.evidence.acceptance import errs_less, gains_any_evidence, lacks, leaves_error, lowers_error, worst_error
from fieldsid.diagnosis.evidence.likelihood_fit import LikelihoodFit, fit_maximum_likelihood
from fieldsid.diagnosis.evidence.noise_kind import fit_other_noise
from fieldsid.diagnosis.evidence.scored_model import ScoredModel, prefer_output_error, score_model
from fieldsid.diagnosis.residual_tests.residual_tests import residuals_reject
from fieldsid.diagnosis.search.add_effect import MAX_EFFECTS_LATER, Addition, likelihood_linearisation, may_gain
from fieldsid.diagnosis.search.model_spec import Assumptions, ModelSpec
from fieldsid.diagnosis.search.move_evaluation import MoveEvaluation
from fieldsid.diagnosis.search.variant_search import VariantRequest
from fieldsid.diagnosis.thresholds import MAX_ERROR_RATIO, MISSING_ERROR_RATIO, RIVAL_LOG_ODDS
from fieldsid.fitting.initial.effect_screen import carry_parameters, linearise_at, scan_points, shifts_time
from fieldsid.fitting.optimise.levenberg_marquardt import cost_of
from fieldsid.models.effect import Effect, Stage, with_variant

MAX_STARTS_IN_SERIES = 4
"""Scan points, those of the lowest cost, that an actuator and a hidden state are fitted from together."""
MAX_IDLE_EXPANSIONS = 2
"""Expansions beyond the budget that may lower no error: the last of three effects that show together only is the third."""
EXCHANGES_IN_ANY_CASE = 2
"""Leading models that are exchanged whatever was spent: what comes to lead by the first may itself be mistaken for another."""
MAX_JOINED = 3
"""Sets that are fitted again with what the leading model has besides, a fit each, and rivals of it that are grown."""


@dataclass(slots=True)
class Search(MoveEvaluation):
    """A best-first search over the sets of catalogued effects."""

    def best(self) -> ScoredModel:
        """Return the accepted set of effects with the highest log evidence."""
        self._expand()
        self._grow_rivals()
        if self.leaves_visible_error():
            pairs = [*self._all_in_series(), *self._all_beside()]
            self._fit_pairs(pairs)
            self._join_pairs(pairs)
        self._exchange_leaders()
        if self.may_follow_leading():
            self._vary_states_in_series()
            self._expand()
            self._exchange_leaders()
        found = self.best_admissible()
        nothing = frozenset(found.names) == self.root  # the textbook variants may all be screened out
        if (
            self.error_ratio(found) > MISSING_ERROR_RATIO
            and self.may_go_on()
            and (nothing or residuals_reject(found.likelihood_fit, self.parallel))
        ):
            self._try_added([Addition(self.base(), [e for e in self._untried(self.base()) if nothing and e.variants])])
            self._try_laws_and_variants(self.root, [], every=True)
            self._expand()
        if self._is_expandable(leading := self._most_evident()):
            self._add_most_promising(leading)
            self._exchange_leaders()
        self._lift_under_other_trim_law()
        self.share_own_moments()
        while self._drop_each(found := self.best_admissible()):
            self.share_own_moments()
        return found

    def _expand(self) -> None:
        """Expand the leading models, best first, until each of them is expanded or predicts to within the sensors' noise."""
        self.base()
        while (leading := self._next_to_expand()) is not None:
            began = self.budget.used
            self._join_children(self.forward_step(leading), leading)
            self._drop_each(self._most_evident())
            self._fit_from_parts()
            self.share_own_moments()
            self.update_noise_floor(self.best_admissible().likelihood_fit.fitted)
            lowest = self.tried.lowest_errors
            lowest.append(min([worst_error(self.best_admissible(), self.floor), *lowest[-1:]]))
            self.budget.last_expansion = self.budget.used - began
            if self._switch_noise_or_trim():
                self.base()

    def _join_children(self, children: Sequence[ScoredModel], parent: ScoredModel) -> None:
        """Add to the best of a model's children what others have added, where that helps alone or with it.

        Of several effects that are missing each may show beside the others only, and to expand one set after another costs many
        times as much as a fit of what is at hand. What was joined is tried in its variants, as the best of other children are.
        """
        best = next(iter(children), parent)
        if not (gains_any_evidence(parent, best) and leaves_error(best, self.floor)):
            return
        left = [h for h in children[1:] if gains_any_evidence(parent, h) or lowers_error(parent, h)][:MAX_JOINED]
        while left and self.may_go_on(leading=True):
            joined = self._joined(best, left)
            # each is added to the best so far: what was fitted without the first that helps is fitted again
            helped = next((i for i, h in enumerate(joined) if h.log_evidence > best.log_evidence), len(left) - 1)
            self.tried.update({frozenset(h.names): h for h in joined[: helped + 1]})
            best, left = max(best, joined[helped], key=lambda h: h.log_evidence), left[helped + 1 :]
        if best is not children[0] and self.may_go_on(leading=True):
            self._try_variants([VariantRequest(best)])

    def _joined(self, best: ScoredModel, others: Sequence[ScoredModel]) -> list[ScoredModel]:
        """Return a model with what each of others has besides, fitted from their numbers.

        Itself where that set was tried, or comes before in the list, and where one effect more promises no log evidence.
        """
        sets, linearisation = [frozenset((*best.names, *h.names)) for h in others], likelihood_linearisation(best)

        def join(i: int) -> ScoredModel:
            here, there = best.likelihood_fit.fitted, others[i].likelihood_fit
            new = [e for e in others[i].effects if e.name not in best.names]
            if sets[i] in self.tried or sets[i] in sets[:i] or (len(new) == 1 and not may_gain(best, linearisation, *new)):
                return best
            problem = here.problem.with_effects([*best.effects, *new])
            start = carry_parameters(problem.layout, here.vector, there.fitted.vector)
            ml_fit = fit_maximum_likelihood(problem, start, there.noise, self.resolution_floor, self.noise_kind)
            joined = score_model(ml_fit, self.validation)
            leads = joined.log_evidence > best.log_evidence
            return (prefer_output_error(joined, self.floor) if leads else joined).evaluate_errors()

        return self.parallel.map(join, range(len(others)))

    def _grow_rivals(self) -> None:
        """Add to the accepted sets that predict as well as the model of the highest evidence what may bring them above it.

        Where that leaves the noise alone the search has ended, and an effect whose numbers pass for a lag of a sample has gained
        on one that lacks the lag.
        """
        best = self._most_evident()
        rivals = [h for h in self.ranked() if h is not best and self._predicts_as_well(h, best)][:MAX_JOINED]
        if self.may_go_on():
            self._try_added([self._to_rival(h, self._untried(h), best) for h in rivals])

    def _to_rival(self, h: ScoredModel, effects: Sequence[Effect], best: ScoredModel) -> Addition:
        """Return the addition to a model of the effects that, to first order, may bring it near the best by log evidence."""
        behind = max(lacks(h, best) - RIVAL_LOG_ODDS, 0.0)
        return Addition(h, effects, MAX_EFFECTS_LATER, behind=behind, near=best)

    def _predicts_as_well(self, h: ScoredModel, best: ScoredModel) -> bool:
        """Whether an accepted set of no more effects, some at least, leaves nothing missing on fitted nor on unseen runs."""
        return (
            errs_less(h, best, MISSING_ERROR_RATIO) and len(self.known) < len(h.names) <= len(best.names) and self.admissible(h)
        )

    def _exchange_leaders(self) -> None:
        """Exchange effects of the model of the highest evidence for others, then of what leads after it, expanded in its turn.

        It goes on as long as the budget lasts: what leads after an exchange differs from what led before it by less each time.
        """
        exchanged, left = self.tried.progress.exchanged, EXCHANGES_IN_ANY_CASE
        while (spec := ModelSpec.of(best := self._most_evident())) not in exchanged and (left > 0 or self.may_go_on()):
            exchanged.add(spec)
            left -= 1
            self._exchange_for_variants(best)
            self._exchange_for_lookalikes(self._most_evident())
            self._drop_each(self._most_evident())
            self.share_own_moments()
            self._expand()
            if self._is_twin(leading := self._most_evident(), best):
                exchanged.add(ModelSpec.of(leading))

    def _is_twin(self, h: ScoredModel, other: ScoredModel) -> bool:
        """Whether a model has one effect in place of one that it may be mistaken for, and is a rival of the model with that.

        What its other effects may be mistaken for was tried beside the one: beside the other it gains as much.
        """
        new, gone = ([e for e in a.effects if e.name not in b.names] for a, b in ((h, other), (other, h)))
        alike = len(new) == len(gone) == 1 and new[0].name in gone[0].mistaken_for
        return alike and h.log_evidence - other.log_evidence < RIVAL_LOG_ODDS

    def _exchange_for_variants(self, best: ScoredModel) -> None:
        """Try a model without each effect, the others of the same stage in their other variants.

        An effect may stand for such a variant: a dead time for the inertia of a servo.
        """
        asked = list[VariantRequest]()
        for gone in best.effects:
            without = self.tried.get(frozenset(best.names) - {gone.name})
            alike = {e.name for e in best.effects if e is not gone and e.stage is gone.stage and e.variants}
            if gone.name not in self.known and without is not None and alike:
                asked.append(VariantRequest(without, alike))
        self._try_variants(asked)

    def _exchange_for_lookalikes(self, best: ScoredModel) -> None:
        """Try a model with each accepted effect exchanged for what it may be mistaken for.

        Where one stands for a lag of a sample, the lag itself may have passed no screen of a model without what the others have
        since added, or ended at a worse optimum. What shifts time for long is seen to no first order by a model without: it is
        fitted from the other's numbers. So is an effect in another variant, which may stand for its textbook's and one of those.
        What comes so near that a variant could lead is tried in its variants.
        """
        self._drop_each(best)
        accepted = self.core_of(best) - self.root
        stands = [(e, [other for other in best.effects if other is not e], self._alike(e, best)) for e in best.effects]
        stands = [one for one in stands if one[0].name in accepted]
        if len(best.names) > len(self.known) + 1:
            less = [(self.tried[frozenset(best.names) - {e.name}], alike) for e, _, alike in stands]
            self._try_added([self._to_rival(h, alike, best) for h, alike in less])
            shifts = [(others, [a for a in alike if shifts_time(a)]) for e, others, alike in stands if shifts_time(e)]
            self._try_at(best, shifts)
            self._try_variants_near(best, [(others, alike) for _, others, alike in stands])
        textbook = {e.name: e for e in self.catalogue}
        formed = [([*others, textbook[e.name]], alike) for e, others, alike in stands if e.is_formed]
        self._try_at(best, formed)
        self._try_variants_near(best, formed)
        if len(best.names) == len(self.known) + 1:
            self._fit_pairs([(e, a) for effects, alike in formed for e in effects[-1:] for a in alike if _in_series(e, a)])

    def _alike(self, effect: Effect, h: ScoredModel) -> list[Effect]:
        """Return what an effect may be mistaken for and a model lacks."""
        return [e for e in self.catalogue if e.name in effect.mistaken_for and e.name not in h.names]

    def _front(self, best: ScoredModel) -> list[ScoredModel]:
        """Return the models of accepted effects whose error is clearly below that of the one with the highest evidence."""
        least = MAX_ERROR_RATIO * best.selection_errors.mean
        return [h for h in self.ranked() if h.selection_errors.mean < least and self.admissible(h)]

    def _next_to_expand(self) -> ScoredModel | None:
        """Return the base, then the leading model to expand next, the most evident first; None where all are expanded.

        The base is expanded under every kind of noise and trim law; where the budget is used up only where there is nothing else.
        """
        if self.root not in self.tried.progress.expanded and (len(self.tried) == 1 or self.may_go_on()):
            return self.base()
        best = self._most_evident()
        if self._is_expandable(best) and (self.may_go_on() or self._may_expand_leading()):
            return best
        return next((h for h in self._leading_models() if self._is_expandable(h)), None)

    def _may_expand_leading(self) -> bool:
        """Whether beyond the budget the leading model may grow: there is room, and the last few expansions lowered the error.

        That of the best accepted set: a model that gains evidence and leaves it takes up what is in no effect's form.
        """
        lowest, room = self.tried.lowest_errors, self.may_follow_leading() and self.budget.remains_for_expansion
        return room and (len(lowest) <= MAX_IDLE_EXPANSIONS or lowest[-1] < MAX_ERROR_RATIO * lowest[-1 - MAX_IDLE_EXPANSIONS])

    def _leading_models(self) -> list[ScoredModel]:
        """Return the leading models, none where the budget is used up.

        They are the model of the highest log evidence, the same without each of its effects (their expansions exchange that
        effect), and every model of accepted effects with a clearly lower error: its evidence may be lower only because it lacks a
        small effect that the best model has besides a wrong one.
        """
        if not self.may_go_on():
            return []
        best = self._most_evident()
        front = self._front(best)
        return [best, *front, *self._less(best)] if leaves_error(best, self.floor) else front

    def _is_expandable(self, h: ScoredModel) -> bool:
        """Whether a model is new, does not diverge, and leaves an error above the noise floor.

        Nothing else ends its growth: what an effect more must bring to lead is the prior against it.
        """
        is_new = frozenset(h.names) not in self.tried.progress.expanded
        return is_new and bool(np.isfinite(h.log_evidence)) and leaves_error(h, self.floor)

    def _all_in_series(self) -> list[tuple[Effect, Effect]]:
        """Return every actuator with every hidden state that it is mistaken for, one in the variant that stands for it."""
        alone = (self.tried.get(self.root | {e.name}) for e in self.catalogue)
        effects = [next(e for e in h.effects if e.name not in self.known) for h in alone if h is not None]
        pairs = ((a, b) for a in effects for b in self.catalogue if _in_series(a, b) and b.name not in self.known)
        return list({frozenset((e.name, e.is_formed) for e in pair): pair for pair in pairs}.values())

    def _all_beside(self) -> list[tuple[Effect, Effect]]:
        """Return every effect in a variant that may show beside another only, with that other."""
        left = [e for e in self.catalogue if e.name not in self.known]
        return [(with_variant(e, v), b) for e in left for v in e.variants for b in left if b.name in v.beside]

    def _vary_states_in_series(self) -> None:
        """Try the likeliest pair in series with its hidden state in other variants.

        Alone the state may gain nothing in one, as it takes up the actuator's response as well: a drift that the cross flow holds
        shows beside a slow servo only. Then the pair is tried with what the leading model has, which was found without it.
        """
        if fitted := self._fitted(self._all_in_series()):
            best = max(fitted, key=lambda h: h.log_evidence)
            self._try_variants([VariantRequest(best, {e.name for e in best.effects if e.extra_states})])
            if (varied := self.tried[key := frozenset(best.names)]) is not best:
                self.tried.progress.expanded.discard(key)  # what the textbook's leaves room for says nothing of the new one
                leading = self._most_evident()
                self._try_added([self._to_rival(varied, [e for e in leading.effects if e.name not in key], leading)])
                self._join_children(self._children(key), varied)

    def _fit_pairs(self, pairs: Sequence[tuple[Effect, Effect]]) -> None:
        """Fit an actuator and a hidden state of the hull together, from the base model's parameters and the state's scan points.

        Where both are missing either takes up the response of the other, and ends at parameters from which no descent leads to
        the two. So it is with other pairs, whose first is scanned then. Of two optima of the same effects that are rivals by
        evidence the one stands whose free run predicts better.
        """
        base, leading, under = self.base().likelihood_fit, self._most_evident(), (self.resolution_floor, self.noise_kind)
        at = linearise_at(base.fitted.problem, base.fitted.x, base.noise)
        rival = leading.likelihood_fit.log_likelihood - leading.complexity_penalty  # no set pays less than nothing

        def fit(pair: tuple[Effect, Effect]) -> list[LikelihoodFit]:
            problem = base.fitted.problem.with_effects([*base.fitted.effects, *pair])
            points = scan_points(at, next((e for e in pair if e.extra_states), pair[0]))
            starts = [carry_parameters(problem.layout, base.fitted.vector, otherwise=v) for v in points]
            best = sorted(starts, key=lambda x: cost_of(problem, x, base.noise))[:MAX_STARTS_IN_SERIES]
            ends = [fit_maximum_likelihood(problem, x, base.noise, *under, rival=rival) for x in best]
            return sorted(ends, key=lambda end: -end.log_likelihood)  # what is far behind the first is not scored

        before = dict(self.tried)
        for ml_fit in chain.from_iterable(self.parallel.map(fit, pairs)):
            self._keep(ml_fit)
        new = [h for key, h in self.tried.items() if h is not before.get(key)]
        found = [h for h in new if h.likelihood_fit.log_likelihood > rival]
        flown = self.parallel.map(lambda h: prefer_output_error(h, self.floor).evaluate_errors(), found)
        for h, known in ((h, before.get(frozenset(h.names))) for h in flown):
            self.tried[frozenset(h.names)] = h if known is None else _better_optimum(known, h)

    def _fitted(self, pairs: Sequence[tuple[Effect, Effect]]) -> list[ScoredModel]:
        """Return the models of the pairs that were tried."""
        return [h for pair in pairs if (h := self.tried.get(self.root | {e.name for e in pair})) is not None]

    def _join_pairs(self, pairs: Sequence[tuple[Effect, Effect]]) -> None:
        """Add to the model of the highest evidence the pairs that may show together only, where they gain any: see `_joined`.

        What stands for such a pair there is found idle beside it.
        """
        best, fitted = self._most_evident(), self._fitted(pairs)
        gaining = [h for h in fitted if gains_any_evidence(self.base(), h) and not set(h.names) <= set(best.names)]
        if gaining:
            joined = self._joined(best, sorted(gaining, key=lambda h: -h.log_evidence)[:MAX_JOINED])
            self.tried.update({frozenset(h.names): h for h in joined})
        self._drop_each(self._most_evident())

    def _drop_each(self, h: ScoredModel) -> bool:
        """Fit a model without each of its effects, unless that was done: later ones may have made earlier ones idle.

        The others stay in their variants. The set without it may have been tried in other variants only, or have ended at a
        worse optimum than the one that the larger model has found. Returns whether anything was fitted.
        """
        spec = ModelSpec.of(h)
        if len(h.names) <= len(self.known) + 1 or spec in self.tried.progress.thinned:
            return False
        self.tried.progress.thinned.add(spec)
        effects = [e for e in h.effects if e.name not in self.known]
        less = self.parallel.map(lambda gone: self._drop_effect(h, gone).evaluate_errors(), effects)
        self.tried.update({frozenset(w.names): w for w in less})
        return True

    def _switch_noise_or_trim(self) -> bool:
        """Start again under another kind of noise (once each), or under the other trim law, where that fits better.

        A missing effect may have biased the first choice. Likelihoods compare only under one kind of noise, and a disturbance
        that stands for coloured sensor noise lets the heading drift at no cost. The kind is asked of the most evident model, in
        whose residuals the least is missing. The best model is kept, fitted again. Both are asked once, whatever was spent: an
        effect may stand for the other law of the trim.
        """
        if self.trim_laws.known and not self.may_go_on():
            return False
        found = self.best_admissible()
        noise = partial(fit_other_noise, self._most_evident(), self.floor, self.tried.noise_kinds, self.parallel)
        ml_fit, again = self.trim_laws.best_alternative(
            found, self.tried, self.floor, self.resolution_floor, self.parallel, noise
        )
        if ml_fit is None and again is None:
            return False
        if ml_fit is not None:
            again = score_model(ml_fit, self.validation)
        elif again is not None:
            self.trim_laws.switches += 1
        if again is not None:
            self.tried.assumptions = Assumptions.of(again)
        if again is not None and frozenset(again.names) != self.root:
            known, again = self.tried.get(frozenset(again.names)), prefer_output_error(again, self.floor)
            self.tried[frozenset(again.names)] = again if known is None or again.log_evidence > known.log_evidence else known
        return True

    def _lift_under_other_trim_law(self) -> None:
        """Let what lacks one of the found effects count under the other trim law: what that explains is no evidence for it."""
        lawful = self.trim_laws.without_an_effect(self.best_admissible(), self.tried)
        self.tried.update({frozenset(h.names): prefer_output_error(h, self.floor) for h in lawful})


def _better_optimum(known: ScoredModel, h: ScoredModel) -> ScoredModel:
    """Return the one with more evidence of two fits of the same effects; of rivals the one whose free run predicts better."""
    if abs(known.log_evidence - h.log_evidence) < RIVAL_LOG_ODDS:
        return min(known, h, key=lambda one: one.selection_errors.mean)
    return max(known, h, key=lambda one: one.log_evidence)


def _in_series(effect: Effect, other: Effect) -> bool:
    """Whether two effects are mistaken for each other, one acting on the fin and one a state of the hull's."""
    alike = other.name in effect.mistaken_for
    return alike and any(a.stage is Stage.ACTUATOR and bool(b.extra_states) for a, b in ((effect, other), (other, effect)))
