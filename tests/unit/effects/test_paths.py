"""Paths in pieces: what is rebuilt from ends, mean and moment has them, and is the path where that was made of pieces."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fieldsid.effects._paths import PASSED_RAD, join, split
from fieldsid.models.fin_path import FinPath

SHARES = st.floats(0.0, 1.0)
STEP_S = 0.05


def pieces_of(path: FinPath) -> np.ndarray:
    out = np.empty((3, 4))
    return out[: split(np.array([STEP_S]), path.start, path.end, path.first, path.last, out)]


def joined(pieces: np.ndarray) -> np.ndarray:
    lines, out = np.column_stack([pieces[:, 1:3], pieces[:, 1:3]]), np.empty((1, 4))
    join(len(pieces), pieces, lines, out)
    return out[0]


def line_of(knots: list[tuple[float, float]]) -> FinPath:
    """The line of a path through (share, angle) knots, by fine sampling."""
    fine = (np.arange(200_000) + 0.5) / 200_000
    angle = np.interp(fine, [k[0] for k in knots], [k[1] for k in knots])
    mean, half = angle.mean(), 6.0 * np.mean(angle * (fine - 0.5))
    return FinPath(*(np.array([v]) for v in (mean - half, mean + half, knots[0][1], knots[-1][1])))


@given(SHARES, SHARES, st.floats(-0.5, 0.5), st.floats(-0.5, 0.5))
def test_a_path_held_straight_and_held_is_rebuilt_as_it_was(one, other, first, last):
    leaves, arrives = min(one, other), max(one, other)
    path = line_of([(0.0, first), (leaves, first), (arrives + 1e-9, last), (1.0 + 2e-9, last)])
    pieces = pieces_of(path)
    assert pieces[:, 0].sum() == pytest.approx(STEP_S, rel=1e-5)
    assert pieces[:, 1:3].min() >= min(first, last) - PASSED_RAD
    assert pieces[:, 1:3].max() <= max(first, last) + PASSED_RAD
    np.testing.assert_allclose(joined(pieces)[:2], [path.start[0], path.end[0]], atol=2e-4 * abs(last - first) + PASSED_RAD)


@given(st.floats(0.02, 0.98), st.floats(0.02, 0.98), st.floats(-0.5, 0.5), st.floats(-0.5, 0.5))
def test_a_path_with_one_bend_keeps_its_mean_and_passes_neither_end(at, share, first, last):
    path = line_of([(0.0, first), (at, first + share * (last - first)), (1.0, last)])
    pieces = pieces_of(path)
    line = joined(pieces)
    assert 0.5 * (line[0] + line[1]) == pytest.approx(path.mean[0], abs=2e-6)
    assert pieces[:, 1:3].min() >= min(first, last) - PASSED_RAD
    assert pieces[:, 1:3].max() <= max(first, last) + PASSED_RAD


def test_an_exponential_is_rebuilt_with_its_mean_and_its_moment():
    fine = np.linspace(0.0, 1.0, 400)
    path = line_of(list(zip(fine, -np.expm1(-fine / 0.4), strict=True)))
    np.testing.assert_allclose(joined(pieces_of(path))[:2], [path.start[0], path.end[0]], atol=1e-5)


def test_a_path_that_comes_back_is_left_as_its_line():
    path = FinPath(np.array([0.3]), np.array([0.3]), np.array([0.0]), np.array([0.01]))
    np.testing.assert_allclose(pieces_of(path), [[STEP_S, 0.3, 0.3, 0.0]])
