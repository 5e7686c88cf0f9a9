"""Stated probabilities are right as often as they say, and the residual tests reject no more often than their level.

The whole is `pytest -m slow tests/recovery/test_calibration.py`; the tables are printed by `tests/benchmarks/reliability.py` and
`tests/benchmarks/null_residuals.py`.
"""

from __future__ import annotations

import json

import numpy as np
import pytest
from benchmarks.hidden_effects import run_case
from benchmarks.null_residuals import COLOURS, TESTS, null_row
from benchmarks.reliability import Named, of_own_bank, overstated
from truth.shares import interval

LEVELS = (0.05, 0.02)
"""What the tests are asked at: the usual one, and that of a verdict."""
SEED = 601


def rejected_too_often(logs: range) -> list[str]:
    """Return the tests that reject surely more often than their level on logs without an effect, in turn in all noises."""
    rows = [null_row(index, SEED, COLOURS[index % len(COLOURS)]) for index in logs]
    hits = {(test, level): sum(row["p"][test] < level for row in rows) for test in TESTS for level in LEVELS}
    return [f"{test} < {level}: {n} of {len(rows)}" for (test, level), n in hits.items() if interval(n, len(rows))[0] > level]


@pytest.mark.slow
def test_the_residual_tests_reject_no_more_than_their_level():
    assert not rejected_too_often(range(300))


def test_a_probability_that_is_overstated_is_told_from_one_that_is_not():
    rng = np.random.default_rng(3)
    stated = rng.uniform(0.3, 1.0, 400)
    honest = [Named("", float(p), bool(rng.random() < p), visible=True) for p in stated]
    assert not overstated(honest)
    boastful = [Named("", 0.999, n.right, visible=True) for n in honest]
    assert [edge for edge, _, _ in overstated(boastful)] == [0.99]


@pytest.mark.slow
def test_of_the_verdicts_given_with_a_probability_that_share_is_right(tmp_path):
    rows = [run_case((index, SEED, None, 1.0, False)) for index in range(100)]
    file = tmp_path / "rows.json"
    file.write_text(json.dumps(rows, default=float), encoding="utf-8")
    assert not overstated(of_own_bank(file))
