"""The evaluation budget of a search."""

from __future__ import annotations

from dataclasses import dataclass, field

from fieldsid.runtime.evaluation_counter import EvaluationCounter

MAX_EVALUATIONS_PER_RUN = 3500
"""Simulations, linearisations and filter passes of each run, on average. After it only the model that leads is expanded, and only
while it leaves a visible error: what is missing is found on that way, and what else it could be beside it."""


@dataclass(slots=True)
class Budget:
    """The evaluations that a search over some runs may use, and whether a move was left out for lack of them."""

    runs: int
    most: float
    is_exhausted: bool = False
    evaluations: EvaluationCounter = field(default_factory=EvaluationCounter)

    def remaining(self) -> bool:
        """Whether evaluations are left; if not, the budget is marked as exhausted."""
        lasts = self.evaluations.count < self.runs * self.most
        self.is_exhausted = self.is_exhausted or not lasts
        return lasts
