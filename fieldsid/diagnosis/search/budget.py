"""The evaluation budget of a search."""

from __future__ import annotations

from dataclasses import dataclass, field

from fieldsid.runtime.evaluation_counter import EvaluationCounter

MAX_EVALUATIONS_PER_RUN = 3500
"""Simulations, linearisations and filter passes of each run, on average, after which no further move is evaluated."""


@dataclass(slots=True)
class Budget:
    """The evaluations that a search over some runs may use, and whether a move was left out for lack of them."""

    runs: int
    most: float
    is_exhausted: bool = False
    evaluations: EvaluationCounter = field(default_factory=EvaluationCounter)

    def remaining(self) -> bool:
        """Whether evaluations are left; if not, the budget is marked as exhausted."""
        lasts = self.evaluations.count < self.most * self.runs
        self.is_exhausted = self.is_exhausted or not lasts
        return lasts
