"""A drop-out is found, and a log of few digits is not taken for one."""

import numpy as np
import pytest

from fieldsid.logs.convert.faults.dropouts import without_dropouts


def jumpy(seed: int, digit: float, count: int = 6000) -> np.ndarray:
    """A rate (n,) that is quiet for most of the time and shakes in between, logged in steps of `digit`."""
    random = np.random.default_rng(seed)
    shaking = np.repeat(random.random(count // 50) < 0.2, 50)
    return digit * np.round((0.003 + 0.2 * shaking) * random.standard_normal(count) / digit)


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("digit", [0.01, 0.001])
def test_numbers_of_few_digits_to_which_a_shaking_sensor_jumps_are_no_drop_outs(seed, digit):
    assert not without_dropouts("yaw_rate_rad_s", jumpy(seed, digit))[1]


@pytest.mark.parametrize("number", [0.0, -999.0, 9999.0])
@pytest.mark.parametrize("digit", [0.01, 1e-6])
def test_one_number_that_comes_time_and_again_is_one(number, digit):
    random = np.random.default_rng(1)
    values = digit * np.round((0.5 + 0.2 * np.sin(0.02 * np.arange(2000)) + 0.002 * random.standard_normal(2000)) / digit)
    values[random.choice(1990, 12, replace=False)] = number
    _, found = without_dropouts("yaw_rate_rad_s", values)
    assert [n.data["number"] for n in found] == [number]
