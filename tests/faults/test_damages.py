"""What the doctor finds of forty kinds of damage; 200 good logs by name: `python tests/faults/damages.py`."""

from __future__ import annotations

import numpy as np
import pytest
from faults.damages import DAMAGES, findings, good_log, is_told

DECIDABLE = [d for d in DAMAGES if d.told_by]


@pytest.mark.parametrize("seed", [*range(3), *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(3, 6))])
def test_a_good_log_has_no_finding(tmp_path, seed):
    assert findings(good_log(seed), tmp_path) == set()


@pytest.mark.parametrize("damage", DECIDABLE, ids=[d.name for d in DECIDABLE])
def test_a_damage_is_told(tmp_path, damage):
    log = good_log(1002)
    damage.spoil(log, np.random.default_rng(2))
    assert is_told(damage, findings(log, tmp_path))


def test_what_cannot_be_decided_says_by_what_it_would_be():
    assert all(d.decides for d in DAMAGES if not d.told_by)
