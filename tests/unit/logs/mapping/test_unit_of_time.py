"""A time in whole numbers that states no unit is read without a word only where its step and the motion leave one unit."""

import numpy as np
import pytest

from fieldsid.errors import MappingError
from fieldsid.logs import load_run
from fieldsid.logs.inspection import inspect_log

SECONDS = 0.004 * np.arange(5000)
TURNING = {"heading_deg": 20.0 * np.sin(0.5 * SECONDS), "rudder_deg": 10.0 * np.sign(np.cos(0.5 * SECONDS))}


def written(path, time, columns, name="time"):
    rows = zip(time.tolist(), *(np.round(c, 6).tolist() for c in columns.values()), strict=True)
    path.write_text("\n".join([",".join([name, *columns]), *(",".join(map(repr, row)) for row in rows)]) + "\n")
    return path


def test_a_counter_that_may_be_in_s_or_ms_is_refused_with_both_readings(tmp_path):
    log = written(tmp_path / "log.csv", 4 * np.arange(5000), TURNING)
    with pytest.raises(MappingError) as caught:
        load_run(log, recognise=True)
    assert "in doubt: time (`time` states no unit" in caught.value.hint
    assert "4 s a sample and 0.00017 rad/s at most in s, or 0.004 s a sample and 0.17 rad/s at most in ms" in caught.value.hint
    assert [n.code for n in inspect_log(log).notes] == ["time_unit"]


def test_whole_seconds_in_which_a_vehicle_turns_are_not_in_doubt(tmp_path):
    slow = {name: column[::250] for name, column in TURNING.items()}
    long = {name: np.tile(column, 4) for name, column in slow.items()}
    run = load_run(written(tmp_path / "log.csv", np.arange(80), long), recognise=True)
    assert run.time[-1] == 79.0


@pytest.mark.parametrize("name", ["time_ms", "time [ms]"])
def test_a_unit_that_is_stated_is_not_in_doubt(tmp_path, name):
    run = load_run(written(tmp_path / "log.csv", 4 * np.arange(5000), TURNING, name), recognise=True)
    np.testing.assert_allclose(run.time, SECONDS, atol=1e-9)


def test_a_rate_that_agrees_leaves_one_unit(tmp_path):
    columns = TURNING | {"yaw_rate_deg_s": 10.0 * np.cos(0.5 * SECONDS)}
    run = load_run(written(tmp_path / "log.csv", 4 * np.arange(5000), columns), recognise=True)
    np.testing.assert_allclose(run.time, SECONDS, atol=1e-9)


@pytest.mark.parametrize("factor", [10.0, 0.5])
def test_a_scale_that_differs_is_said_of_angle_rate_and_time(tmp_path, factor):
    columns = TURNING | {"yaw_rate_deg_s": 10.0 / factor * np.cos(0.5 * SECONDS)}
    notes = {n.code: n.message for n in load_run(written(tmp_path / "l.csv", SECONDS, columns, "time_s"), recognise=True).notes}
    said = f"yaw_rad is read at {factor:g} times its true size, or yaw_rate_rad_s or the time at {1 / factor:g} times"
    assert any(said in message for message in notes.values()), notes
