"""The better optimum of a set from its parts: a model holds the optimum of each set of one effect fewer."""

from __future__ import annotations

from collections.abc import Sequence

from fieldsid.diagnosis.evidence.likelihood_fit import MIN_LIKELIHOOD_GAIN
from fieldsid.diagnosis.evidence.scored_model import ScoredModel
from fieldsid.diagnosis.moves.archive import Archive
from fieldsid.diagnosis.moves.grounds import Grounds


def refit_from_parts(models: Sequence[ScoredModel], tried: Archive, grounds: Grounds) -> bool:
    """Fit each model again that is less likely than a part of it, from that part's numbers; return whether one was better so.

    The part was found since, beside other effects or in another order; the descent to the model has missed its optimum.
    """
    missed = list[tuple[ScoredModel, ScoredModel]]()
    for h in models:
        part = max(tried.parts(h), key=lambda part: part.log_likelihood, default=h)
        if part.log_likelihood > h.log_likelihood + MIN_LIKELIHOOD_GAIN:
            missed.append((h, part))

    def again(pair: tuple[ScoredModel, ScoredModel]) -> ScoredModel:
        h, part = pair
        found = grounds.better(h, grounds.fit_from(h, part))
        return found.evaluate_errors() if found.log_evidence > h.log_evidence + MIN_LIKELIHOOD_GAIN else h

    found = grounds.parallel.map(again, missed)
    tried.update({frozenset(h.names): h for h in found})
    return any(h.log_evidence > before.log_evidence for h, (before, _) in zip(found, missed, strict=True))
