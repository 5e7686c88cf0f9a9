"""Every model that a search has tried: the best of each set of effects, and what was done with it."""

from __future__ import annotations

from collections.abc import Iterator, MutableMapping
from dataclasses import dataclass, field

import numpy as np

from fieldsid.diagnosis.evidence.likelihood_fit import MIN_LIKELIHOOD_GAIN
from fieldsid.diagnosis.evidence.scored_model import ScoredModel

Names = frozenset[str]


@dataclass(slots=True)
class Archive(MutableMapping[Names, ScoredModel]):
    """The model that stands for each set of effects, in the variants, under the law and at the optimum of the most evidence.

    `known` are the effects of the base. `expanded` are the sets that effects were added to, `thinned` and `varied` the log
    evidence at which each was fitted without each of its effects and in other variants of some of them.
    """

    known: Names
    models: dict[Names, ScoredModel] = field(default_factory=dict)
    expanded: set[Names] = field(default_factory=set)
    thinned: dict[Names, float] = field(default_factory=dict)
    varied: dict[tuple[Names, Names], float] = field(default_factory=dict)

    def __getitem__(self, names: Names) -> ScoredModel:
        """Return the model that stands for some effects; raises KeyError where none was tried."""
        return self.models[names]

    def __setitem__(self, names: Names, h: ScoredModel) -> None:
        """Let a model stand for its effects."""
        self.models[names] = h

    def __delitem__(self, names: Names) -> None:
        """Let no model stand for some effects."""
        del self.models[names]

    def __iter__(self) -> Iterator[Names]:
        """Return the sets of effects that were tried, in that order."""
        return iter(self.models)

    def __len__(self) -> int:
        """Return their number."""
        return len(self.models)

    def children(self, key: Names) -> list[ScoredModel]:
        """Return the models of one effect more than a set, those of most log evidence first."""
        children = [h for k, h in self.models.items() if len(k) == len(key) + 1 and key < k]
        return sorted(children, key=lambda h: -h.log_evidence)

    def ranked(self) -> list[ScoredModel]:
        """Return all models by log evidence, the highest first, without those that diverge."""
        return sorted((h for h in self.models.values() if np.isfinite(h.log_evidence)), key=lambda h: -h.log_evidence)

    def most_evident(self) -> ScoredModel:
        """Return the model of the highest log evidence, whether or not its effects are accepted."""
        return max(self.models.values(), key=lambda h: h.log_evidence)

    def without_each(self, h: ScoredModel) -> list[tuple[str, ScoredModel]]:
        """Return each effect of a model whose absence was tried, with the model that lacks it."""
        left = ((n, frozenset(h.names) - {n}) for n in h.names if n not in self.known)
        return [(n, self.models[k]) for n, k in left if k in self.models]

    def is_varied(self, h: ScoredModel) -> bool:
        """Whether all effects of a model were tried in other variants at an evidence that it has hardly exceeded since."""
        names = frozenset(h.names)
        return h.log_evidence <= self.varied.get((names, names), -np.inf) + MIN_LIKELIHOOD_GAIN

    def is_thinned(self, h: ScoredModel) -> bool:
        """Whether a model was fitted without each of its effects at an evidence that it has hardly exceeded since."""
        return h.log_evidence <= self.thinned.get(frozenset(h.names), -np.inf) + MIN_LIKELIHOOD_GAIN
