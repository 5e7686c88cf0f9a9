"""The evaluation budget of a search."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from fieldsid.runtime.evaluation_counter import EvaluationCounter

MAX_EVALUATIONS_PER_RUN, MAX_EVALUATIONS_WHERE_UNEXPLAINED = 1000, 3000
"""Simulations, linearisations and filter passes of each run, on average: where what is found could stand as a verdict, and where
it leaves a visible error, or most of one unexplained. After them only the model that leads is expanded, and only while it leaves
a visible one: what is missing is found on that way, and what else it could be beside it. On 170 cases of the second bank 1500 to
2500 named the same first as 3500, in half to two thirds of the time; 1500 throughout left two hulls of other hands unexplained
that 3500 explains. On 107 hard cases of the second bank 1000, 1500 name the right effect first in 68 of 71 and both of two in 11
of 11, and of 71 errors 70, 71 come within 15 % of the noise: 1000 takes a tenth less time."""
MAX_EVALUATIONS_IN_ALL = 2 * MAX_EVALUATIONS_WHERE_UNEXPLAINED
"""The same where the leading model goes on: there a hull's roll, in no catalogue, was followed for half a minute by effects that
each lowered the error a little. Of 648 cases of the second bank six went on beyond 3300, and none gained beyond 6000. These are
evaluations of usual runs."""
USUAL_SAMPLES, FIXED_COST_SAMPLES = 1000, 1800
"""Samples of a usual run, and those that cost what an evaluation does whatever the length of its run: by least squares over 486
diagnoses of hard cases of the second bank, of 480 to 3000 samples a run."""


@dataclass(slots=True)
class Budget:
    """The evaluations of each run that a search may use, and whether a move was left out for lack of them.

    `most` where what is found could stand, `where_unexplained` where it could not, and where the leading model goes on `in_all`,
    of usual runs; `samples` is the mean length of the runs searched, `last_expansion` what the last model expanded took.
    """

    runs: int
    samples: float = USUAL_SAMPLES
    most: float = MAX_EVALUATIONS_PER_RUN
    where_unexplained: float = MAX_EVALUATIONS_WHERE_UNEXPLAINED
    in_all: float = MAX_EVALUATIONS_IN_ALL
    is_exhausted: bool = False
    last_expansion: float = 0.0
    evaluations: EvaluationCounter = field(default_factory=EvaluationCounter)

    def remaining(self, is_unexplained: Callable[[], bool]) -> bool:
        """Whether evaluations are left, by whether it leaves too much; if none, the budget is marked as exhausted."""
        lasts = self.used < self.most or (self.used < self.where_unexplained and is_unexplained())
        self.is_exhausted = self.is_exhausted or not lasts
        return lasts

    @property
    def remains_for_leading(self) -> bool:
        """Whether the leading model may still be followed beyond what a search may use."""
        return self.used < self.most_for_leading

    @property
    def remains_for_expansion(self) -> bool:
        """Whether it may be expanded there once more, if that takes what the last expansion took."""
        return self.used + self.last_expansion < self.most_for_leading

    @property
    def most_for_leading(self) -> float:
        """The evaluations of each run after which it is followed no more: those that cost as much as `in_all` of usual runs."""
        dearer = (FIXED_COST_SAMPLES + self.samples) / (FIXED_COST_SAMPLES + USUAL_SAMPLES)
        return max(self.in_all / dearer, self.where_unexplained)

    @property
    def used(self) -> float:
        """The evaluations of each run so far."""
        return self.evaluations.count / self.runs
