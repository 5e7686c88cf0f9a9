"""All models that a search has tried: the best of each set of effects, and the moves that were made from it."""

from __future__ import annotations

from collections.abc import Iterator, MutableMapping
from dataclasses import dataclass, field

import numpy as np

from fieldsid.diagnosis.evidence.likelihood_fit import MIN_LIKELIHOOD_GAIN
from fieldsid.diagnosis.evidence.scored_model import ScoredModel

Names = frozenset[str]


@dataclass(slots=True)
class Archive(MutableMapping[Names, ScoredModel]):
    """The model with the most evidence for each set of effects, over variants, speed laws and optima.

    `known` are the effects of the base. `expanded` are the sets to which effects were added. `thinned`, `refined` and
    `varied` hold the log evidence of a set when it was last fitted without each of its effects, under other laws, and with other
    variants of some of them.
    """

    known: Names
    models: dict[Names, ScoredModel] = field(default_factory=dict)
    expanded: set[Names] = field(default_factory=set)
    thinned: dict[Names, float] = field(default_factory=dict)
    refined: dict[Names, float] = field(default_factory=dict)
    varied: dict[tuple[Names, Names], float] = field(default_factory=dict)

    def __getitem__(self, names: Names) -> ScoredModel:
        """Return the model of a set of effects; raises KeyError where none was tried."""
        return self.models[names]

    def __setitem__(self, names: Names, h: ScoredModel) -> None:
        """Store the model of a set of effects."""
        self.models[names] = h

    def __delitem__(self, names: Names) -> None:
        """Delete the model of a set of effects."""
        del self.models[names]

    def __iter__(self) -> Iterator[Names]:
        """Return the sets of effects that were tried, in that order."""
        return iter(self.models)

    def __len__(self) -> int:
        """Return the number of sets of effects that were tried."""
        return len(self.models)

    def children(self, key: Names) -> list[ScoredModel]:
        """Return the models with one effect more than a set, by decreasing log evidence."""
        children = [h for k, h in self.models.items() if len(k) == len(key) + 1 and key < k]
        return sorted(children, key=lambda h: -h.log_evidence)

    def ranked(self) -> list[ScoredModel]:
        """Return all models by log evidence, the highest first, without those that diverge."""
        return sorted((h for h in self.models.values() if np.isfinite(h.log_evidence)), key=lambda h: -h.log_evidence)

    def most_evident(self) -> ScoredModel:
        """Return the model of the highest log evidence, whether or not its effects are accepted."""
        return max(self.models.values(), key=lambda h: h.log_evidence)

    def without_each(self, h: ScoredModel) -> list[tuple[str, ScoredModel]]:
        """Return each effect of a model that was left out in another model tried, with that model."""
        left = ((n, frozenset(h.names) - {n}) for n in h.names if n not in self.known)
        return [(n, self.models[k]) for n, k in left if k in self.models]

    def is_refined(self, h: ScoredModel) -> bool:
        """Return whether a model was tried under other laws and in other variants, at about its present evidence."""
        return h.log_evidence <= self.refined.get(frozenset(h.names), -np.inf) + MIN_LIKELIHOOD_GAIN

    def is_thinned(self, h: ScoredModel) -> bool:
        """Return whether a model was fitted without each of its effects, and its evidence has hardly increased since."""
        return h.log_evidence <= self.thinned.get(frozenset(h.names), -np.inf) + MIN_LIKELIHOOD_GAIN
