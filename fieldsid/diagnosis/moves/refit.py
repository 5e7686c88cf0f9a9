"""Refits of a set of effects from its subsets: at least as likely as any with one effect fewer, and with events at its times."""

from __future__ import annotations

from collections.abc import Sequence

from fieldsid.diagnosis.evidence.likelihood_fit import MIN_LIKELIHOOD_GAIN, LikelihoodFit
from fieldsid.diagnosis.evidence.scored_model import ScoredModel
from fieldsid.diagnosis.moves.add_effect import starts_apart
from fieldsid.diagnosis.moves.archive import Archive
from fieldsid.diagnosis.moves.grounds import Grounds
from fieldsid.fitting.initial.effect_screen import carry_parameters


def refit_from_parts(models: Sequence[ScoredModel], tried: Archive, grounds: Grounds) -> bool:
    """Fit each model that is less likely than a subset of it again, from that subset; return whether any model improved.

    The fit of the subset is newer, from other variants or another law, and shows an optimum that the model has missed.
    """
    missed = list[tuple[ScoredModel, ScoredModel]]()
    for h in models:
        subset = max((w for _, w in tried.without_each(h)), key=lambda w: w.log_likelihood, default=h)
        if subset.log_likelihood > h.log_likelihood + MIN_LIKELIHOOD_GAIN:
            missed.append((h, subset))

    def refitted(pair: tuple[ScoredModel, ScoredModel]) -> ScoredModel:
        h, subset = pair
        found = grounds.better(h, _fit_from_subset(h, subset, grounds))
        return found.evaluate_errors() if found.log_evidence > h.log_evidence + MIN_LIKELIHOOD_GAIN else h

    found = grounds.parallel.map(refitted, missed)
    tried.update({frozenset(h.names): h for h in found})
    return any(h.log_evidence > before.log_evidence for h, (before, _) in zip(found, missed, strict=True))


def with_events_of_parts(h: ScoredModel, effect: str, tried: Archive, grounds: Grounds) -> ScoredModel:
    """Return a model fitted again with each event at its time in a subset that has an effect too, where that is better.

    A scan takes the times of an event in all runs from one linearisation. Beside another effect that fits a part of what the
    event does, it takes a wrong time in some run, and no descent leaves it.
    """
    for part in (w for _, w in tried.without_each(h) if effect in w.names):
        for place, slot in enumerate(h.likelihood_fit.fitted.problem.layout.parameters):
            fitted = h.likelihood_fit.fitted
            times = carry_parameters(fitted.problem.layout, part.likelihood_fit.fitted.vector, fitted.vector)
            if slot.is_event and starts_apart(times[place], fitted.x[place]):
                start = fitted.x.copy()
                start[place] = times[place]
                h = grounds.better(h, grounds.fit(fitted.problem, start, h.likelihood_fit.noise))
    return h


def _fit_from_subset(h: ScoredModel, subset: ScoredModel, grounds: Grounds) -> LikelihoodFit:
    """Fit a model from a subset of it, in the variants and under the law of the subset; other parameters start at the model's."""
    of_model, of_subset = h.likelihood_fit.fitted, subset.likelihood_fit.fitted
    subset_effects = {e.name: e for e in subset.effects}
    problem = of_subset.problem.with_effects([subset_effects.get(e.name, e) for e in h.effects])
    return grounds.fit(problem, carry_parameters(problem.layout, of_subset.vector, of_model.vector), subset.likelihood_fit.noise)
