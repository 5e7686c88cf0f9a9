"""A fin whose numbers are no angle in rad is refused wherever a run is used, with the unit that they probably have."""

import numpy as np
import pytest

from fieldsid.errors import DataError
from fieldsid.logs import load_run
from fieldsid.logs.inspection import inspect_log, write_proposal
from fieldsid.logs.run import Run
from fieldsid.models.axis import Axis
from fieldsid.models.record import record_of
from fieldsid.online.samples import samples_of

TIME = 0.1 * np.arange(400)
MOVES = np.sign(np.sin(0.5 * TIME + 0.01))


def run_with(fin, name="rudder_rad"):
    return Run("log", TIME, {"yaw_rad": 0.1 * np.sin(0.3 * TIME), name: fin})


@pytest.mark.parametrize(
    ("fin", "hint"),
    [(1500.0 + 160.0 * MOVES, "`unit: counts` and `centre: 1500`"), (15.0 * MOVES, "`unit: deg`"), (128.0 + 60.0 * MOVES, "128")],
)
@pytest.mark.parametrize("name", ["rudder_rad", "rudder_measured_rad"])
def test_numbers_that_are_no_angle_are_refused(fin, hint, name):
    run = run_with(fin, name)
    for refused in (lambda: record_of(run, Axis.YAW), lambda: next(samples_of(run, Axis.YAW))):
        with pytest.raises(DataError, match="is no angle in rad") as error:
            refused()
        assert hint in error.value.hint
        assert "limit 3.14 rad" in error.value.found


def test_an_angle_and_a_spike_in_it_are_not():
    fin = 0.6 * MOVES
    fin[7] = 40.0
    assert len(record_of(run_with(fin), Axis.YAW)) == TIME.size


@pytest.mark.parametrize(("swing", "fin", "is_said"), [(2.0, 0.25, True), (2.0, 5.0, False), (40.0, 0.25, False)])
def test_a_row_of_degrees_over_numbers_in_rad_is_said(tmp_path, swing, fin, is_said):
    time = np.arange(0.0, 60.0, 0.1)
    rows = zip(time, swing * np.sin(0.3 * time), 0.3 * swing * np.cos(0.3 * time), fin * np.sign(np.cos(0.3 * time)), strict=True)
    table = ["time,heading,yaw_rate,rudder", "SEC,DEG,DEG/S,DEG", *(",".join(f"{v:.5f}" for v in row) for row in rows)]
    (tmp_path / "log.csv").write_text("\n".join(table) + "\n")
    run = load_run(tmp_path / "log.csv", write_proposal(inspect_log(tmp_path / "log.csv"), tmp_path / "m.yaml"))
    said = [n.message for n in run.notes if n.code == "unit"]
    assert bool(said) == is_said
    assert not said or "`unit: rad`" in said[0]
