"""Everything a search has tried: scored models by spec, and what was done with the models of each set of effects."""

from __future__ import annotations

from collections.abc import Iterator, MutableMapping
from dataclasses import dataclass, field

from fieldsid.diagnosis.evidence.likelihood_fit import FittedProblem
from fieldsid.diagnosis.evidence.scored_model import ScoredModel
from fieldsid.diagnosis.search.model_spec import Assumptions, ModelSpec

Names = frozenset[str]


@dataclass(slots=True)
class Progress:
    """What was done under one set of assumptions, by set of effects.

    The spec that stands for it; whether it was expanded; the log evidence at which variants of its effects were tried; the specs
    that were fitted without each of their effects, and those whose effects were exchanged; the log likelihood of the part that
    its model was fitted again from.
    """

    standing: dict[Names, ModelSpec] = field(default_factory=dict)
    expanded: set[Names] = field(default_factory=set)
    evidence_at_variants: dict[tuple[Names, Names], float] = field(default_factory=dict)
    thinned: set[ModelSpec] = field(default_factory=set)
    exchanged: set[ModelSpec] = field(default_factory=set)
    likelihood_of_part: dict[Names, float] = field(default_factory=dict)


@dataclass(slots=True)
class FreeRuns:
    """Under one trim law, whatever the noise: the output-error fits of each set of effects, and the sets screened by them."""

    fits: dict[Names, list[FittedProblem]] = field(default_factory=dict)
    screened: set[Names] = field(default_factory=set)


@dataclass(slots=True)
class Archive(MutableMapping[Names, ScoredModel]):
    """All scored models by spec. As a mapping: the model that stands for each set of effects under the present assumptions.

    Only models of the same assumptions are compared; a search may come back to assumptions that it has left. `lowest_errors` are
    those over the floor after each expansion, under whatever assumptions: the error of a free run depends on none.
    """

    models: dict[ModelSpec, ScoredModel] = field(default_factory=dict)
    assumptions: Assumptions | None = None
    lowest_errors: list[float] = field(default_factory=list)
    _progress: dict[Assumptions | None, Progress] = field(default_factory=dict)
    _free_runs: dict[bool | None, FreeRuns] = field(default_factory=dict)

    @property
    def progress(self) -> Progress:
        """What was done under the present assumptions."""
        return self._progress.setdefault(self.assumptions, Progress())

    @property
    def free_runs(self) -> FreeRuns:
        """The output-error fits under the present trim law."""
        return self._free_runs.setdefault(self.assumptions.trim_of_fin if self.assumptions else None, FreeRuns())

    @property
    def noise_kinds(self) -> set[str]:
        """The kinds of noise that models were tried under."""
        return {spec.assumptions.noise_kind for spec in self.models}

    def __getitem__(self, names: Names) -> ScoredModel:
        """Return the model that stands for some effects; raises KeyError where none was tried."""
        return self.models[self.progress.standing[names]]

    def __setitem__(self, names: Names, h: ScoredModel) -> None:
        """Let a model stand for its effects, in place of the fit of the same spec."""
        spec = ModelSpec.of(h)
        self.models[spec] = h
        self.progress.standing[names] = spec

    def __delitem__(self, names: Names) -> None:
        """Let no model stand for some effects."""
        del self.progress.standing[names]

    def __iter__(self) -> Iterator[Names]:
        """Return the sets of effects that were tried, in that order."""
        return iter(self.progress.standing)

    def __len__(self) -> int:
        """Return their number."""
        return len(self.progress.standing)
