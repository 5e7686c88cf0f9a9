"""The evaluation budget of a search."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from fieldsid.runtime.evaluation_counter import EvaluationCounter

MAX_EVALUATIONS_PER_RUN = 3500
"""Simulations, linearisations and filter passes of each run, on average, after which no further move is evaluated."""
MISSING_BUDGET_RATIO = 2.0
"""How many times as many it may use while the best model leaves an error above MISSING_ERROR_RATIO: something is missing, and a
vehicle of several effects takes an expansion for each."""


@dataclass(slots=True)
class Budget:
    """The evaluations that a search over some runs may use, and whether a move was left out for lack of them."""

    runs: int
    most: float
    is_exhausted: bool = False
    evaluations: EvaluationCounter = field(default_factory=EvaluationCounter)

    def remaining(self, is_missing: Callable[[], bool]) -> bool:
        """Whether evaluations are left, more of them where something is missing; if not, the budget is marked as exhausted."""
        share = self.evaluations.count / self.runs
        lasts = share < self.most or (share < MISSING_BUDGET_RATIO * self.most and is_missing())
        self.is_exhausted = self.is_exhausted or not lasts
        return lasts
