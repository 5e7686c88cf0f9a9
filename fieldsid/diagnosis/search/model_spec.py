"""What identifies a model among all that a search tries: its effects with their variants, its speed and trim laws, its noise."""

from __future__ import annotations

from dataclasses import dataclass

from fieldsid.diagnosis.evidence.scored_model import ScoredModel


@dataclass(frozen=True, slots=True)
class Assumptions:
    """What models must have in common for their likelihoods to be compared: the kind of noise, and whose offset the trim is."""

    noise_kind: str
    trim_of_fin: bool

    @classmethod
    def of(cls, h: ScoredModel) -> Assumptions:
        """Return those of a model."""
        return cls(h.likelihood_fit.noise_kind, h.likelihood_fit.fitted.problem.layout.groups.trim_of_fin)


@dataclass(frozen=True, slots=True)
class ModelSpec:
    """A model without its numbers: each effect with the coefficients of its variant, how speed enters, and the assumptions.

    `by_law`: one authority that follows the law of the speed, or one for each group of runs. `snapped`: the runs of a group at
    one speed, or each at its own.
    """

    effects: frozenset[tuple[str, tuple[str, ...]]]
    variants: frozenset[str]
    by_law: bool
    snapped: bool
    assumptions: Assumptions

    @classmethod
    def of(cls, h: ScoredModel) -> ModelSpec:
        """Return that of a model."""
        groups = h.likelihood_fit.fitted.problem.layout.groups
        return cls(
            effects=frozenset((e.name, tuple(c.name for c in e.coefficients)) for e in h.effects),
            variants=frozenset(e.name for e in h.effects if e.is_formed),
            by_law=groups.by_law,
            snapped=groups.snapped,
            assumptions=Assumptions.of(h),
        )

    @property
    def names(self) -> frozenset[str]:
        """The names of its effects."""
        return frozenset(name for name, _ in self.effects)
