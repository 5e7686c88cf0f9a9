"""The evaluation budget of a search."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from fieldsid.runtime.evaluation_counter import EvaluationCounter

MAX_EVALUATIONS_PER_RUN, MAX_EVALUATIONS_WHERE_VISIBLE = 1800, 3500
"""Simulations, linearisations and filter passes of each run, on average: where the best model leaves no visible error, and where
it leaves one. After them only the model that leads is expanded, and only while it leaves one: what is missing is found on that
way, and what else it could be beside it. On 170 cases of the second bank 1500 to 2500 named the same first as 3500, in half to
two thirds of the time; 1500 throughout left a hull of other hands unexplained that 3500 explains."""


@dataclass(slots=True)
class Budget:
    """The evaluations of each run that a search may use, and whether a move was left out for lack of them.

    `most` where the best model leaves no visible error, `where_visible` where it does.
    """

    runs: int
    most: float = MAX_EVALUATIONS_PER_RUN
    where_visible: float = MAX_EVALUATIONS_WHERE_VISIBLE
    is_exhausted: bool = False
    evaluations: EvaluationCounter = field(default_factory=EvaluationCounter)

    def remaining(self, is_visible: Callable[[], bool]) -> bool:
        """Whether evaluations are left, by whether an error is visible; if none, the budget is marked as exhausted."""
        used = self.evaluations.count / self.runs
        lasts = used < self.most or (used < self.where_visible and is_visible())
        self.is_exhausted = self.is_exhausted or not lasts
        return lasts
