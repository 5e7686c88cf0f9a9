"""The better optimum of a set from its parts: no set is less likely than one of one effect fewer."""

from __future__ import annotations

from collections.abc import Sequence

from fieldsid.diagnosis.evidence.likelihood_fit import MIN_LIKELIHOOD_GAIN, LikelihoodFit
from fieldsid.diagnosis.evidence.scored_model import ScoredModel
from fieldsid.diagnosis.moves.archive import Archive
from fieldsid.diagnosis.moves.grounds import Grounds
from fieldsid.fitting.initial.effect_screen import carry_parameters


def refit_from_parts(models: Sequence[ScoredModel], tried: Archive, grounds: Grounds) -> bool:
    """Fit each model again that is less likely than a part of it, from that part; return whether one was better so.

    The part was found since, beside other effects, in other variants or under another law; the model has missed that optimum.
    """
    missed = list[tuple[ScoredModel, ScoredModel]]()
    for h in models:
        part = max((w for _, w in tried.without_each(h)), key=lambda w: w.log_likelihood, default=h)
        if part.log_likelihood > h.log_likelihood + MIN_LIKELIHOOD_GAIN:
            missed.append((h, part))

    def again(pair: tuple[ScoredModel, ScoredModel]) -> ScoredModel:
        h, part = pair
        found = grounds.better(h, _fit_from_part(h, part, grounds))
        return found.evaluate_errors() if found.log_evidence > h.log_evidence + MIN_LIKELIHOOD_GAIN else h

    found = grounds.parallel.map(again, missed)
    tried.update({frozenset(h.names): h for h in found})
    return any(h.log_evidence > before.log_evidence for h, (before, _) in zip(found, missed, strict=True))


def _fit_from_part(h: ScoredModel, part: ScoredModel, grounds: Grounds) -> LikelihoodFit:
    """Fit a model from a part of it, in that part's variants and under its law; what the part lacks is as the model has it."""
    whole, of_part = h.likelihood_fit.fitted, part.likelihood_fit.fitted
    own = {e.name: e for e in part.effects}
    problem = of_part.problem.with_effects([own.get(e.name, e) for e in h.effects])
    return grounds.fit(problem, carry_parameters(problem.layout, of_part.vector, whole.vector), part.likelihood_fit.noise)
