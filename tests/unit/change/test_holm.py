"""Holm's p-values, against numbers worked by hand."""

from __future__ import annotations

import math

import pytest

from fieldsid.change.holm import adjusted


def test_the_smallest_is_multiplied_by_all_and_the_others_by_what_is_left():
    assert adjusted([0.01, 0.04, 0.03]) == pytest.approx([0.03, 0.06, 0.06])


def test_none_is_above_one_and_what_is_no_test_counts_for_nothing():
    found = adjusted([0.6, float("nan"), 0.9])
    assert found[0] == found[2] == 1.0
    assert math.isnan(found[1])
