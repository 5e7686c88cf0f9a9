"""The paper's tables 2 and 3 as truth, flown as its experiment was: every estimator gives them back."""

from __future__ import annotations

import numpy as np
import pytest
from truth.paper import PITCH, YAW, YawRow, paper_run

from fieldsid.fitting.fit import estimators, fit
from fieldsid.logs.run import Run
from fieldsid.models.axis import NAMES, Axis
from fieldsid.models.record import record_of

NOISE = np.deg2rad(0.3)
ROWS = [*YAW, *PITCH]
METHODS = sorted(estimators())


def record(row, **noise):
    log = paper_run(row, **noise)
    time = log.pop("time_s")
    return record_of(Run("paper", time, log), Axis.YAW if isinstance(row, YawRow) else Axis.PITCH)


def truth(row) -> dict[str, float]:
    axis = Axis.YAW if isinstance(row, YawRow) else Axis.PITCH
    return {n: getattr(row, n) for n in NAMES[axis].base}


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("row", [YAW[0], YAW[4], PITCH[0], PITCH[3]], ids=lambda r: f"{type(r).__name__}_{r.speed}")
def test_without_noise_the_parameters_come_back_to_a_thousandth(row, method):
    log = record(row)
    found = fit([log], log.axis, method=method).model.base
    scale = {"C0": 0.01, "c23": 0.1}
    for name, value in truth(row).items():
        assert found[name] == pytest.approx(value, rel=1e-3, abs=1e-3 * scale.get(name, 0.0)), name


@pytest.mark.parametrize("method", METHODS)
def test_with_noise_the_truth_is_inside_the_error_bars(method):
    """All ten rows of the tables, 0.3 deg and 0.3 deg/s: 35 intervals, three or four of a row moving together."""
    scores = []
    for seed, row in enumerate(ROWS):
        log = record(row, angle_noise=NOISE, rate_noise=NOISE, seed=seed)
        model = fit([log], log.axis, method=method).model
        scores += [(model.values[n] - v) / model.std_error(n) for n, v in truth(row).items()]
    assert np.mean(np.abs(scores) < 1.96) >= 0.8
    assert np.abs(scores).max() < 4.0
    assert 0.5 < np.std(scores) < 1.5
