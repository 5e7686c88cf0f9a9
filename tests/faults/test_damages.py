"""No finding on good logs, and damages that cannot be told; of 200 logs by name: `python tests/faults/damages.py`."""

from __future__ import annotations

import pytest
from faults.damages import DAMAGES, findings, good_log


@pytest.mark.parametrize("seed", [*range(3), *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(3, 6))])
def test_a_good_log_has_no_finding(tmp_path, seed):
    assert findings(good_log(seed), tmp_path) == set()


def test_what_cannot_be_decided_says_by_what_it_would_be():
    assert all(d.decides for d in DAMAGES if not d.told_by)
