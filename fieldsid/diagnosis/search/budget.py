"""The evaluation budget of a search."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from fieldsid.runtime.evaluation_counter import EvaluationCounter

MAX_EVALUATIONS_PER_RUN, MAX_EVALUATIONS_WHERE_UNEXPLAINED = 2500, 6500
"""Largest numbers of simulations, linearisations and filter passes per run of usual length: where the model found could be the
verdict, and where it leaves a visible error or explains too little of one."""
USUAL_SAMPLES, FIXED_COST_SAMPLES = 1000, 1800
"""Number of samples of a usual run, and the fixed cost of an evaluation in samples: by least squares over 486 diagnoses of hard
cases of the second bank, of 480 to 3000 samples a run."""


@dataclass(slots=True)
class Budget:
    """The number of evaluations per run that a search may use, and whether a move was omitted because they were used up.

    `most` applies where the model found could be the verdict, `where_unexplained` elsewhere; `samples` is the mean length of a
    run.
    """

    runs: int
    samples: float = USUAL_SAMPLES
    most: float = MAX_EVALUATIONS_PER_RUN
    where_unexplained: float = MAX_EVALUATIONS_WHERE_UNEXPLAINED
    is_exhausted: bool = False
    evaluations: EvaluationCounter = field(default_factory=EvaluationCounter)

    def remains(self, is_unexplained: Callable[[], bool]) -> bool:
        """Return whether evaluations remain, given whether an error is unexplained; if none, mark the budget as exhausted."""
        remains_some = self.used < self.most or (self.used < self.where_unexplained and is_unexplained())
        self.is_exhausted = self.is_exhausted or not remains_some
        return remains_some

    @property
    def used(self) -> float:
        """The number of evaluations per run so far, converted to evaluations of runs of usual length."""
        cost_ratio = (FIXED_COST_SAMPLES + self.samples) / (FIXED_COST_SAMPLES + USUAL_SAMPLES)
        return self.evaluations.count / self.runs * cost_ratio
