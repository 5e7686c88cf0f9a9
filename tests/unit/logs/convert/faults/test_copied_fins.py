"""A measured fin that is the command itself is no measurement; one that follows it is."""

import numpy as np
import pytest

from fieldsid.logs.convert.faults.copied_fins import without_copied_fins

TIME = 0.05 * np.arange(400)
FIN = 0.2 * np.sign(np.sin(TIME))
GAP = np.where(TIME < 3.0, np.nan, FIN)


@pytest.mark.parametrize("fin", [FIN, GAP], ids=["whole", "gap"])
def test_a_copy_of_the_command_is_left_out(fin):
    kept, (note,) = without_copied_fins({"rudder_rad": fin, "rudder_measured_rad": fin.copy(), "yaw_rad": TIME})
    assert list(kept) == ["rudder_rad", "yaw_rad"]
    assert (note.code, note.data["signal"]) == ("copied", "rudder_measured_rad")


@pytest.mark.parametrize("measured", [np.roll(FIN, 1), FIN + 1e-6, 0.0 * FIN])
def test_what_differs_from_the_command_stays(measured):
    signals = {"elevator_rad": FIN, "elevator_measured_rad": measured}
    assert without_copied_fins(signals) == (signals, [])


def test_a_fin_that_never_moves_says_nothing():
    signals = {"rudder_rad": np.zeros(9), "rudder_measured_rad": np.zeros(9)}
    assert without_copied_fins(signals) == (signals, [])
