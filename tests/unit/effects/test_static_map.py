"""The compiled static map of a fin against its equation in numpy, its integral, and finely sampled paths."""

from __future__ import annotations

import numpy as np
import pytest

from fieldsid.effects._static_map import StaticMap, fill_lines, fill_values
from fieldsid.models.fin_path import FinPath
from fieldsid.numerics.jit import plain_of

MAPS = (
    StaticMap(beyond=1.0, edge=0.05),
    StaticMap(beyond=1.0, edge=0.05, blend=0.03, jump=0.02),
    StaticMap(proportional=1.0, beyond=-0.8, edge=0.12, blend=0.05, jump=-0.03),
    StaticMap(proportional=1.0, beyond=-1.4, edge=0.12),
    StaticMap(proportional=1.0, one_sided=0.3, square=-0.7),
)


def plain(of, d):
    """The map by its equation."""

    def corner(x):
        return np.maximum(x, 0.0) if of.blend == 0.0 else 0.5 * (x + np.sqrt(x * x + of.blend**2))

    size, side = np.abs(d), np.sign(d)
    far = side * (corner(size - of.edge) - corner(np.array(-of.edge)))
    return of.proportional * d + of.beyond * far + of.jump * side * (size > of.edge) + of.one_sided * size + of.square * d * d


@pytest.mark.parametrize("of", MAPS)
def test_a_held_fin_is_what_the_equation_makes_of_it(of):
    angles = np.concatenate([np.linspace(-0.5, 0.5, 301), [0.0, of.edge, -of.edge]])
    seen = of.through(FinPath(angles, angles), np.full(angles.size, 0.1))
    np.testing.assert_allclose(seen.mean, plain(of, angles), atol=1e-14)


@pytest.mark.parametrize("of", MAPS)
def test_the_mean_of_a_moving_fin_is_that_of_its_path_finely_sampled(of):
    rng = np.random.default_rng(3)
    start = 0.2 * rng.standard_normal(60)
    end = np.where(rng.random(60) < 0.3, start, start + 0.2 * rng.standard_normal(60))
    seen = of.through(FinPath(start, end), np.full(60, 0.1))
    fine = (np.arange(20_000) + 0.5) / 20_000
    track = plain(of, start[:, None] + (end - start)[:, None] * fine)
    np.testing.assert_allclose(seen.mean, track.mean(axis=1), atol=5e-6)
    np.testing.assert_allclose(np.stack([seen.first, seen.last]), plain(of, np.stack([start, end])), atol=1e-14)


@pytest.mark.parametrize("kernel", [fill_values, fill_lines])
def test_the_compiled_kernels_are_their_plain_python(kernel):
    rng = np.random.default_rng(4)
    start, numbers = 0.2 * rng.standard_normal(40), (1.0, -0.8, 0.12, 0.05, -0.03, 0.1, 0.2)
    ends = (start,) if kernel is fill_values else (start, start + 0.1 * rng.standard_normal(40))
    shape = 40 if kernel is fill_values else (40, 4)
    fast, slow = np.empty(shape), np.empty(shape)
    kernel(*ends, numbers, fast)
    plain_of(kernel)(*ends, numbers, slow)
    np.testing.assert_allclose(fast, slow, rtol=1e-13, atol=1e-15)


@pytest.mark.parametrize("of", MAPS)
def test_a_path_has_the_lines_of_its_pieces_one_at_a_time(of):
    rng = np.random.default_rng(5)
    moves = np.where(rng.random(80) < 0.4, 0.0, 0.1 * rng.standard_normal(80)) * np.where(rng.random(80) < 0.2, 1e-6, 1.0)
    knots = np.concatenate([[0.0], np.cumsum(moves)])
    start, end = knots[:-1].copy(), knots[1:].copy()
    start[40:] += 0.05  # a jump: the next piece does not begin where the last one ended
    numbers = (of.proportional, of.beyond, of.edge, of.blend, of.jump, of.one_sided, of.square)
    whole, alone = np.empty((80, 4)), np.empty((80, 4))
    fill_lines(start, end, numbers, whole)
    for i in range(80):
        fill_lines(start[i : i + 1], end[i : i + 1], numbers, alone[i : i + 1])
    np.testing.assert_array_equal(whole, alone)
