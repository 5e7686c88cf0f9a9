"""Rms and fit, by cases worked by hand; several runs are judged from their raw residuals."""

from __future__ import annotations

from dataclasses import replace
from math import isnan, sqrt

import numpy as np
import pytest

from fieldsid.dynamics.free_run import command_record
from fieldsid.fitting.predict.goodness_of_fit import goodness_of_fit
from fieldsid.fitting.predict.predict import Prediction
from fieldsid.models.axis import Axis


def prediction(measured, simulated, ok=None):
    y = np.array(measured, dtype=float)
    seen = np.ones(y.size, dtype=bool) if ok is None else np.array(ok)
    record = replace(command_record(Axis.YAW, np.arange(y.size) * 0.1, 0 * y, speed=1.0), angle=y, angle_ok=seen)
    s = np.array(simulated, dtype=float)
    return Prediction(record, s, 0 * s, 0 * s, (0.0, 0.0, 0.0), {})


def test_rms_and_fit_of_a_case_worked_by_hand():
    m = goodness_of_fit([prediction([0, 2, 4], [1, 2, 4])])
    assert m.angle_rms == pytest.approx(sqrt(1 / 3))
    assert m.angle_fit == pytest.approx(100 * (1 - 1 / sqrt(8)))
    assert isnan(m.rate_rms)
    assert isnan(m.rate_fit)


def test_samples_that_were_not_measured_count_for_nothing():
    assert goodness_of_fit([prediction([0, 2, 99], [0, 3, 0], [True, True, False])]).angle_rms == pytest.approx(sqrt(1 / 2))


def test_two_runs_are_not_the_mean_of_their_rms():
    m = goodness_of_fit([prediction([0, 1], [0, 1]), prediction([0, 1, 0, 1], [1, 0, 1, 0])])
    assert m.angle_rms == pytest.approx(sqrt(4 / 6))


def test_the_mean_of_the_measurement_has_fit_zero():
    assert goodness_of_fit([prediction([0, 2, 4], [2, 2, 2])]).angle_fit == pytest.approx(0.0)
