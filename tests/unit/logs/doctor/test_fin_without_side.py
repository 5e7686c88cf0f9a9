"""A fin that is logged as a size without its side is said; one that goes to one side only, or is small there, is not."""

import numpy as np
import pytest
from numpy.typing import NDArray

from fieldsid.logs.doctor.examine import examine
from fieldsid.logs.run import Run

TIME = 0.1 * np.arange(2400)


def run_with(fin: NDArray[np.float64], shown: NDArray[np.float64]) -> Run:
    rate = np.zeros(TIME.size)
    for i in range(TIME.size - 1):
        rate[i + 1] = rate[i] + 0.1 * (0.9 * fin[i] - 0.8 * rate[i])
    return Run("log", TIME, {"yaw_rad": np.cumsum(0.1 * rate), "yaw_rate_rad_s": rate, "rudder_rad": shown})


PULSES = 0.2 * (TIME % 12.0 < 4.0) * np.where(TIME % 24.0 < 12.0, 1.0, -1.0)


@pytest.mark.parametrize(
    ("fin", "shown", "is_said"),
    [(PULSES, abs(PULSES), True), (PULSES, -abs(PULSES), True), (PULSES, PULSES, False), (abs(PULSES), abs(PULSES), False),
     (PULSES + 0.2, PULSES + 0.2, False)],
    ids=["a size", "a negative size", "both sides", "one side", "a fin that is trimmed"],
)  # fmt: skip
def test_a_size_without_its_side_is_said(fin, shown, is_said):
    codes = [n.code for n in examine(run_with(fin, shown))]
    assert ("no_side" in codes) == is_said
