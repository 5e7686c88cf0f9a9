"""The count of evaluations of a search: runs simulated, linearised or filtered. It is the same on every machine.

A search that ends for lack of effort ends by this count and not by the clock: one log then has one answer.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(slots=True, eq=False)
class EvaluationCounter:
    """Evaluations so far, those of the forked workers that have answered included; passed to whatever evaluates."""

    count: int = 0

    def add(self, runs: int = 1) -> None:
        """Count runs that were evaluated."""
        self.count += runs
