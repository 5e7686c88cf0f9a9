"""The evaluation budget of a search."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from fieldsid.runtime.evaluation_counter import EvaluationCounter

MAX_EVALUATIONS_PER_RUN, MAX_EVALUATIONS_WHERE_UNEXPLAINED = 2500, 6500
"""Simulations, linearisations and filter passes of each run, on average: where what is found could stand as a verdict, and where
it leaves a visible error, or most of one unexplained. Both are those of usual runs."""
USUAL_SAMPLES, FIXED_COST_SAMPLES = 1000, 1800
"""Samples of a usual run, and those that cost what an evaluation does whatever the length of its run: by least squares over 486
diagnoses of hard cases of the second bank, of 480 to 3000 samples a run."""


@dataclass(slots=True)
class Budget:
    """The evaluations of each run that a search may use, and whether a move was left out for lack of them.

    `most` where what is found could stand, `where_unexplained` where it could not, of runs of `samples` samples on average.
    """

    runs: int
    samples: float = USUAL_SAMPLES
    most: float = MAX_EVALUATIONS_PER_RUN
    where_unexplained: float = MAX_EVALUATIONS_WHERE_UNEXPLAINED
    is_exhausted: bool = False
    evaluations: EvaluationCounter = field(default_factory=EvaluationCounter)

    def remains(self, is_unexplained: Callable[[], bool]) -> bool:
        """Whether evaluations are left, by whether what is found leaves too much; if none, the budget is marked as exhausted."""
        lasts = self.used < self.most or (self.used < self.where_unexplained and is_unexplained())
        self.is_exhausted = self.is_exhausted or not lasts
        return lasts

    @property
    def used(self) -> float:
        """The evaluations of each run so far, as many of usual runs as would have taken as long."""
        dearer = (FIXED_COST_SAMPLES + self.samples) / (FIXED_COST_SAMPLES + USUAL_SAMPLES)
        return self.evaluations.count / self.runs * dearer
