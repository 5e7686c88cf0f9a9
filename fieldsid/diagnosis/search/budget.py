"""The evaluation budget of a search."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from fieldsid.runtime.evaluation_counter import EvaluationCounter

MAX_EVALUATIONS_PER_RUN, MAX_EVALUATIONS_WHERE_UNEXPLAINED = 1700, 3300
"""Simulations, linearisations and filter passes of each run, on average: where what is found could stand, and where it leaves a
visible error, or most of one unexplained. After them only the model that leads is expanded, and only while it leaves a visible
one: what is missing is found on that way, and what else it could be beside it. On 170 cases of the second bank 1500 to 2500 named
the same first as 3500, in half to two thirds of the time; 1500 throughout left two hulls of other hands unexplained that 3500
explains, and on 97 cases of the second bank lost the second effect of a pair that 1600 names."""


@dataclass(slots=True)
class Budget:
    """The evaluations of each run that a search may use, and whether a move was left out for lack of them.

    `most` where what is found could stand, `where_unexplained` where it could not.
    """

    runs: int
    most: float = MAX_EVALUATIONS_PER_RUN
    where_unexplained: float = MAX_EVALUATIONS_WHERE_UNEXPLAINED
    is_exhausted: bool = False
    evaluations: EvaluationCounter = field(default_factory=EvaluationCounter)

    def remaining(self, is_unexplained: Callable[[], bool]) -> bool:
        """Whether evaluations are left, by whether it leaves too much; if none, the budget is marked as exhausted."""
        used = self.evaluations.count / self.runs
        lasts = used < self.most or (used < self.where_unexplained and is_unexplained())
        self.is_exhausted = self.is_exhausted or not lasts
        return lasts
