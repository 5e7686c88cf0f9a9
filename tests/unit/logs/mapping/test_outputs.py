"""The output that moves the rudder is named by parameters, or by the motion that follows it; a pulse is no angle."""

import numpy as np
import pytest
from look_alikes import truth, write_dataflash_text, write_table

from fieldsid.errors import DataError
from fieldsid.logs import load_run
from fieldsid.logs.inspection import inspect_log
from fieldsid.logs.mapping.mapping_file import mapping_of
from fieldsid.models.axis import Axis
from fieldsid.models.record import record_of

pytest.importorskip("pymavlink")
TRUTH = truth(seconds=60.0)


@pytest.fixture
def text_log(tmp_path):
    return lambda *parameters: write_dataflash_text(tmp_path / "00000007.log", TRUTH, parameters)


def test_a_dataflash_log_in_its_text_form_is_read_as_the_binary_one(text_log):
    found = inspect_log(text_log(("SERVO3_FUNCTION", 26), ("SERVO3_TRIM", 1505), ("SERVO3_REVERSED", 1), ("SERVO1_FUNCTION", 70)))
    signals = found.proposal.body["signals"]
    assert found.inventory.form == "ArduPilot log"
    assert signals["yaw_rate_rad_s"]["topic"] in ("IMU[0]", "IMU[1]")
    assert signals["rudder_rad"] == {"topic": "RCOU", "field": "C3", "unit": "counts", "centre": 1505, "sign": -1}
    assert signals["thrust"]["field"] == "C1"
    np.testing.assert_allclose(np.diff(found.run["yaw_rad"]), np.diff(TRUTH["yaw_rad"]), atol=1e-5)
    np.testing.assert_allclose(found.run["yaw_rate_rad_s"], TRUTH["yaw_rate_rad_s"], atol=2e-4)


def test_of_many_outputs_the_one_that_the_yaw_rate_follows_is_the_rudder(text_log):
    found = inspect_log(text_log())
    assert found.proposal.body["signals"]["rudder_rad"] == {"topic": "RCOU", "field": "C3", "unit": "counts", "centre": 1500.0}
    (why,) = (n for n in found.notes if n.code == "evidence" and n.data["signal"] == "rudder_rad")
    assert why.data["outputs"] == 14
    assert np.corrcoef(found.run["rudder_rad"], TRUTH["rudder_rad"])[0, 1] > 0.999


def test_where_none_stands_out_the_line_that_is_missing_has_its_unit(tmp_path):
    still = {**TRUTH, "rudder_rad": 0.0 * TRUTH["rudder_rad"]}
    found = inspect_log(write_dataflash_text(tmp_path / "a.log", still))
    (note,) = (n for n in found.notes if n.code == "which_output")
    assert "unit: counts, centre: 1500}`" in note.message


def mapped(tmp_path, values, **how):
    columns = {"t": TRUTH["time_s"], "psi": TRUTH["yaw_rad"], "fin": values}
    log = write_table(tmp_path / "log.csv", columns)
    body = {"time": {"column": "t", "unit": "s"}, "signals": {"yaw_rad": {"column": "psi", "unit": "rad"},
                                                             "rudder_rad": {"column": "fin", **how}}}  # fmt: skip
    return load_run(log, mapping_of(body))


@pytest.mark.parametrize(
    ("unit", "zero", "per_rad", "largest"),
    [("us", 1500.0, 800.0, 400.0), ("1", 0.0, 2.0, 1.0), (1, 0.0, 2.0, 1.0), ("%", 0.0, 200.0, 100.0)],
)
def test_a_fin_in_pulses_or_in_shares_of_its_range_is_taken_about_its_centre(tmp_path, unit, zero, per_rad, largest):
    run = mapped(tmp_path, zero + per_rad * TRUTH["rudder_rad"], unit=unit)
    np.testing.assert_allclose(run["rudder_rad"], TRUTH["rudder_rad"] * per_rad * np.radians(30.0) / largest, atol=1e-6)
    assert "counts" in {n.code for n in run.notes}
    scaled = mapped(tmp_path, zero + per_rad * TRUTH["rudder_rad"], unit=unit, scale=1.0 / per_rad)
    np.testing.assert_allclose(scaled["rudder_rad"], TRUTH["rudder_rad"], atol=1e-6)


@pytest.mark.parametrize(("values", "unit"), [(1500.0 + 800.0 * TRUTH["rudder_rad"], "`unit: counts` and `centre: 1500`"),
                                              (np.degrees(TRUTH["rudder_rad"]), "`unit: deg`")])  # fmt: skip
def test_a_fin_of_more_than_half_a_turn_is_refused_with_its_unit(tmp_path, values, unit):
    run = mapped(tmp_path, np.round(values))
    with pytest.raises(DataError, match="no angle in rad") as error:
        record_of(run, Axis.YAW)
    assert unit in error.value.hint


@pytest.mark.parametrize(("name", "unit"), [("Rudder Cmd (%)", "%"), ("rudder_pct", "%"), ("servo_rudder_us", "us")])
def test_a_name_may_say_that_a_fin_is_in_percent_or_in_pulses(tmp_path, name, unit):
    centre, per_rad = (1500.0, 800.0) if unit == "us" else (0.0, 300.0)
    columns = {"t": TRUTH["time_s"], "heading_deg": np.degrees(TRUTH["yaw_rad"]), name: centre + per_rad * TRUTH["rudder_rad"]}
    found = inspect_log(write_table(tmp_path / "log.csv", columns))
    assert found.proposal.body["signals"]["rudder_rad"]["unit"] == unit
    assert np.corrcoef(found.run["rudder_rad"], TRUTH["rudder_rad"])[0, 1] > 0.999
    assert "counts" in {n.code for n in found.run.notes}
