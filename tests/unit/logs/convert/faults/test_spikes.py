"""Which samples stand alone, and which only look as if they did."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fieldsid.logs.convert.faults.spikes import spikes_of

N = 1200
TIME = 0.05 * np.arange(N)


def noisy(values, seed=0, size=0.002):
    return values + size * np.random.default_rng(seed).standard_normal(N)


def zigzag():
    return 0.3 * np.abs((TIME / 4.0) % 2.0 - 1.0)


SIGNALS = {
    "zigzag": zigzag(),
    "jumps": np.where((TIME / 3.0) % 2.0 < 1.0, 0.1, -0.1),
    "turn": np.cumsum(0.05 * np.sin(0.4 * TIME)) * 0.3,
    "answers": np.convolve(np.where(np.arange(N) % 60 == 0, 1.0, 0.0), np.exp(-np.arange(40) / 4.0))[:N],
}


@pytest.mark.parametrize("name", SIGNALS)
@pytest.mark.parametrize("size", [0.0, 1e-9, 0.002])
def test_a_signal_without_spikes_has_none(name, size):
    assert spikes_of(noisy(SIGNALS[name], size=size)).places.size == 0


@pytest.mark.parametrize("digits", [5, 6, 16])
def test_a_kink_of_a_log_without_noise_is_no_spike(digits):
    fin = np.select([np.abs(TIME - 5 - 4 * k) < 0.99 for k in range(4)], [0.2, -0.2, -0.2, 0.2])
    rate = np.zeros(N)
    for k in range(N - 1):
        rate[k + 1] = rate[k] + 0.05 * (0.7 * fin[k] + 0.007 - 0.84 * rate[k])
    assert spikes_of(np.round(rate, digits)).places.size == 0


@pytest.mark.parametrize("name", ["zigzag", "jumps", "turn"])
def test_spikes_of_fifteen_spreads_are_found_and_nothing_else(name):
    places, values = np.array([17, 400, 401 + 300, 1100]), noisy(SIGNALS[name])
    values[places] += 0.002 * np.array([15.0, -15.0, 15.0, -15.0])
    found = spikes_of(values)
    assert found.places.tolist() == places.tolist()
    assert np.all(found.off > found.limit)


@pytest.mark.parametrize("size", [9999.0, 1e20, 1e300, -1.7e308])
def test_a_value_out_of_all_bounds_is_a_spike(size):
    values = noisy(zigzag())
    values[[300, 800]] = [size, -size]
    assert spikes_of(values).places.tolist() == [300, 800]


def test_a_signal_that_is_absurd_throughout_has_none():
    assert spikes_of(1.7e308 * np.sign(noisy(np.zeros(N)))).places.size == 0


def test_white_noise_of_half_a_million_samples_has_none():
    assert spikes_of(np.random.default_rng(1).standard_normal(500_000)).places.size == 0


def test_the_last_digit_of_a_coarse_log_is_no_spike():
    coarse = np.round(noisy(0.05 * np.sin(0.1 * TIME), size=0.0004) / 0.002) * 0.002
    assert spikes_of(coarse).places.size == 0


def test_more_than_a_few_are_the_signal():
    values = noisy(np.zeros(N))
    values[5:-5:40] += 0.05
    assert spikes_of(values).places.size == 0


@pytest.mark.parametrize("values", [np.zeros(0), np.zeros(500), np.r_[np.zeros(8), 9.0, np.zeros(8)]])
def test_a_short_or_constant_signal_has_none(values):
    assert spikes_of(values).places.size == 0


@given(st.floats(-1e3, 1e3), st.floats(-0.5, 0.5), st.floats(0.01, 100.0))
def test_where_the_signal_is_and_how_large_makes_no_difference(level, slope, scale):
    values = noisy(zigzag())
    values[[100, 700]] += 0.03
    assert spikes_of(scale * (values + level + slope * TIME)).places.tolist() == [100, 700]
