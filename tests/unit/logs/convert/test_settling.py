"""What a step before the first sample tells: pole and end of a signal that settles, and nothing of one that does not."""

import numpy as np
import pytest

from fieldsid.errors import DataError
from fieldsid.fitting.fit import check
from fieldsid.logs.convert.settling import settling_of
from fieldsid.logs.run import Run
from fieldsid.logs.segments import segment
from fieldsid.models.axis import Axis
from fieldsid.models.record import record_of

TIME = np.arange(0.0, 100.0, 0.2)


@pytest.mark.parametrize("pole", [0.03, 0.2, 1.0])
@pytest.mark.parametrize("begin", [0.0, 0.02])
def test_pole_and_end_come_back_from_the_signal_and_from_its_integral(pole, begin):
    rng, end = np.random.default_rng(1), 0.05
    gone = np.exp(-pole * TIME)
    rate = end + (begin - end) * gone + 1e-4 * rng.standard_normal(TIME.size)
    angle = 1.0 + end * TIME + (begin - end) * (1.0 - gone) / pole + 1e-4 * rng.standard_normal(TIME.size)
    assert settling_of(TIME, rate) == pytest.approx((pole, end), rel=0.02)
    assert settling_of(TIME, angle, integrated=True) == pytest.approx((pole, end), rel=0.02)


def test_of_noise_alone_nothing_is_told():
    noise = np.random.default_rng(2).standard_normal(TIME.size)
    assert settling_of(TIME, 0.3 + noise) is None
    assert settling_of(TIME, 0.3 * TIME + noise, integrated=True) is None


@pytest.mark.parametrize("signal", ["yaw_rate_rad_s", "yaw_rad"])
def test_a_step_before_the_log_is_said_with_what_it_tells(signal):
    fin, pole, authority = 0.1, 0.05, 0.01
    settled, gone = authority * fin / pole, np.exp(-pole * TIME)
    motion = {"yaw_rate_rad_s": settled * (1.0 - gone), "yaw_rad": settled * (TIME - (1.0 - gone) / pole)}
    run = Run("step", TIME, {signal: motion[signal], "rudder_rad": np.full(TIME.size, fin)})
    for refused in (lambda: segment(run, "yaw"), lambda: check([record_of(run, Axis.YAW)], Axis.YAW)):
        with pytest.raises(DataError, match="its step is before the first sample") as error:
            refused()
        assert "a22 = 0.05 1/s" in error.value.found
        assert "b2 is 0.01 1/s^2" in error.value.found


@pytest.mark.parametrize("fin", [0.0, 0.1])
def test_a_fin_that_stands_while_the_course_is_steady_is_at_its_trim(fin):
    run = Run("still", TIME, {"yaw_rad": 0.01 * TIME, "rudder_rad": np.full(TIME.size, fin)})
    with pytest.raises(DataError, match="never leaves its trim"):
        segment(run, "yaw")
