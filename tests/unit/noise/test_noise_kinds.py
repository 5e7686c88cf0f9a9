"""The table of noises agrees with the record of a noise, and each kind's filter with the one of all processes."""

from __future__ import annotations

from dataclasses import fields

import numpy as np
import pytest
from scipy.stats import norm

from fieldsid.models.model import Noise
from fieldsid.noise.innovations import innovations
from fieldsid.noise.kalman.univariate import kalman_filter
from fieldsid.noise.noise_kinds import NOISE_FIELDS, NOISE_KINDS, NOISE_PARAMETERS

NOISE = Noise(0.004, 0.006, 0.01, 1.3, 0.003, 0.005, 0.8)


def test_the_table_has_the_fields_of_a_noise_and_their_defaults():
    assert tuple(f.name for f in fields(Noise)) == (*NOISE_FIELDS, "own_moment")  # which is whitened after the filter
    plain = Noise(1.0, 1.0)
    assert all(getattr(plain, n) == p.absent for n, p in NOISE_PARAMETERS.items() if n not in ("angle", "rate"))
    assert all(p.low < p.high for p in NOISE_PARAMETERS.values())


@pytest.mark.parametrize("name", NOISE_KINDS)
def test_a_kind_is_filtered_as_the_noise_of_all_processes_without_the_others(name):
    kind = NOISE_KINDS[name]
    assert set(kind.fields) <= set(NOISE_FIELDS)
    noise = np.array([getattr(NOISE, n) if n in kind.fields else p.absent for n, p in NOISE_PARAMETERS.items()])
    series = np.random.default_rng(5).standard_normal((1, 2, 80)) * 0.01
    steps, ok = np.full(79, 0.1), np.ones((2, 80), dtype=bool)
    own, full = np.empty_like(series), np.empty_like(series)
    logs = innovations(steps, ok, 0.7, 0.0, noise, series, own)
    # a sensor without any noise would have an infinite weight
    there = np.array([max(v, 1e-9) for v in noise])
    assert logs == pytest.approx(kalman_filter(steps, ok, 0.7, 0.0, there, series, full, np.empty((2, 80))), rel=1e-6)
    np.testing.assert_allclose(own, full, rtol=1e-5, atol=1e-7)


def test_ninety_five_of_a_hundred_lie_within_the_usual_limits_of_a_number():
    for parameter in NOISE_PARAMETERS.values():
        median, precision = parameter.log_prior
        if parameter.usual is None:
            assert precision == 0.0
        else:
            within = np.diff(norm.cdf(np.log(parameter.usual), median, precision**-0.5))
            assert within == pytest.approx(0.95, abs=0.006)
