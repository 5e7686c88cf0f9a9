"""How much this process has worked out: runs flown, linearised or filtered. The same count on every machine.

What is given up for lack of time is to be given up by this count, not by the clock: one log then has one answer.
"""

from __future__ import annotations

_DONE = [0]


def evaluations() -> int:
    """Return how many runs have been worked out since the process began, in the copies of it that have answered as well."""
    return _DONE[0]


def count_evaluation(runs: int = 1) -> None:
    """Count runs that were worked out."""
    _DONE[0] += runs
