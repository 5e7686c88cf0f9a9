"""Logs that show next to no noise are told by every channel they have."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from truth.paper import YAW, paper_run

from fieldsid.diagnosis.data.noise_floor import is_noiseless, reported_noise_floor
from fieldsid.logs.run import Run
from fieldsid.models.axis import Axis
from fieldsid.models.model import Noise
from fieldsid.models.record import record_of


def record(*, rate=True):
    log = paper_run(YAW[2], angle_noise=0.005, rate_noise=0.005, seed=1)
    made = record_of(Run("run", log.pop("time_s"), log), Axis.YAW)
    return made if rate else replace(made, rate_ok=np.zeros(len(made), dtype=bool))


@pytest.mark.parametrize(
    ("floor", "rate", "wanted"),
    [
        (Noise(1e-5, 1e-6), True, True),
        (Noise(1e-5, 4e-3), True, False),
        (Noise(1e-5, 4e-3), False, True),
        (Noise(5e-3, 1e-6), True, False),
    ],
)
def test_a_log_without_noise_has_none_in_all_that_it_measures(floor, rate, wanted):
    assert is_noiseless(floor, Noise(1e-3, 1e-3), [record(rate=rate)]) is wanted


def test_colour_of_the_sensors_is_part_of_the_floor_unless_it_is_a_trace():
    floor = reported_noise_floor(Noise(0.003, 0.003), Noise(0.003, 0.003, coloured_angle=0.004, coloured_rate=0.001))
    assert (floor.angle, floor.rate) == pytest.approx((0.005, 0.003))
