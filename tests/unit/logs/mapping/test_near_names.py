"""What a refusal says a column may be is what `inspect` takes it for; a counted quaternion is known by its length."""

import numpy as np
import pytest
from look_alikes import truth, write_table

from fieldsid.errors import MappingError
from fieldsid.logs import load_run
from fieldsid.logs.inspection import inspect_log
from fieldsid.logs.mapping.mapping_file import mapping_of

TRUTH = truth(seconds=30.0)


def test_the_hints_of_a_refusal_are_of_the_recogniser_that_inspects(tmp_path):
    columns = {"Zeit": TRUTH["time_s"], "psi (rad)": TRUTH["yaw_rad"], "yaw_rate": TRUTH["yaw_rate_rad_s"],
               "lat (rad)": 0.7 + 0 * TRUTH["x_m"], "theta": TRUTH["pitch_rad"]}  # fmt: skip
    with pytest.raises(MappingError) as error:
        load_run(write_table(tmp_path / "log.csv", columns))
    for said in ("`psi (rad)` may be `yaw_rad`", "`yaw_rate` may be `yaw_rate_rad_s`", "`theta` may be `pitch_rad`"):
        assert said in error.value.hint
    assert "elevator" not in error.value.hint


@pytest.mark.parametrize("named", ["q[{}]", "q{}", "quat_{}", "attitude.q({})"])
@pytest.mark.parametrize("order", ["wxyz", "xyzw"])
def test_a_quaternion_whose_parts_are_counted_is_one(tmp_path, named, order):
    half = 0.5 * TRUTH["yaw_rad"]
    parts = {"w": np.cos(half), "x": 0.0 * half, "y": 0.0 * half, "z": np.sin(half)}
    start = 1 if "(" in named else 0
    columns = {
        "time": TRUTH["time_s"],
        **{named.format(i + start): parts[p] for i, p in enumerate(order)},
        "rudder": TRUTH["rudder_rad"],
    }
    log = write_table(tmp_path / "log.csv", columns)
    found = inspect_log(log)
    assert found.proposal.body["signals"]["attitude"].get("order", "xyzw") == order
    run = load_run(log, mapping_of(found.proposal.body))
    np.testing.assert_allclose(np.diff(run["yaw_rad"]), np.diff(TRUTH["yaw_rad"]), atol=1e-6)


@pytest.mark.parametrize(("size", "signal"), [(300.0, "yaw_rad"), (12.0, "pitch_rad")])
def test_a_th_that_goes_round_is_a_heading_and_one_that_does_not_a_theta(tmp_path, size, signal):
    columns = {"time": TRUTH["time_s"], "TH": size * (0.5 + 0.5 * np.sin(TRUTH["time_s"])), "rudder": TRUTH["rudder_rad"]}
    signals = inspect_log(write_table(tmp_path / "log.csv", columns)).proposal.body["signals"]
    assert signals[signal] == {"column": "TH", "unit": "deg"}


@pytest.mark.parametrize(("names", "signal"), [(("v",), "surge_m_s"), (("u", "v"), "sway_m_s")])
def test_a_v_alone_is_the_speed_and_beside_a_u_the_sway(tmp_path, names, signal):
    columns = {"time": TRUTH["time_s"], "heading": np.degrees(TRUTH["yaw_rad"]), **dict.fromkeys(names, TRUTH["surge_m_s"])}
    signals = inspect_log(write_table(tmp_path / "log.csv", columns)).proposal.body["signals"]
    assert signals[signal]["column"] == "v"


@pytest.mark.parametrize(("command", "angle"), [("Set_rdr_deg", "Actual_rdr_deg"), ("rudder_order_deg", "rudder_pos_deg")])
def test_a_set_or_ordered_rudder_is_the_command_and_its_position_the_measurement(tmp_path, command, angle):
    fin = np.degrees(TRUTH["rudder_rad"])
    columns = {"time": TRUTH["time_s"], "heading": np.degrees(TRUTH["yaw_rad"]), angle: fin, command: fin}
    signals = inspect_log(write_table(tmp_path / "log.csv", columns)).proposal.body["signals"]
    assert (signals["rudder_rad"]["column"], signals["rudder_measured_rad"]["column"]) == (command, angle)


@pytest.mark.parametrize("command", ["rudder_cmd", "Rudder Order"])
def test_of_two_rudders_the_one_that_is_called_a_command_is_it(tmp_path, command):
    fin = np.degrees(TRUTH["rudder_rad"])
    columns = {"time": TRUTH["time_s"], "heading": np.degrees(TRUTH["yaw_rad"]), "Rudder Angle": fin, command: fin}
    signals = inspect_log(write_table(tmp_path / "log.csv", columns)).proposal.body["signals"]
    assert signals["rudder_rad"]["column"] == command


def test_a_fin_without_a_unit_that_is_known_by_numbers_has_one_that_is_assumed(tmp_path):
    columns = {"t": TRUTH["time_s"], "psi": TRUTH["yaw_rad"], "r": TRUTH["yaw_rate_rad_s"], "helm": 2.0 * TRUTH["rudder_rad"]}
    proposal = inspect_log(write_table(tmp_path / "log.csv", columns)).proposal
    assert proposal.body["signals"]["rudder_rad"] == {"column": "helm"}
    (assumed,) = (n for n in proposal.notes if n.code == "unit_assumed")
    assert "rudder_rad from `helm` in rad" in assumed.message


def test_a_correction_that_is_made_says_what_was_seen_and_not_what_to_set(tmp_path):
    minutes = 60.0 * np.degrees(TRUTH["yaw_rate_rad_s"])
    columns = {
        "time": TRUTH["time_s"],
        "HDG": np.degrees(TRUTH["yaw_rad"]) + 180.0,
        "ROT": minutes,
        "Rudder": TRUTH["rudder_rad"],
    }
    proposal = inspect_log(write_table(tmp_path / "log.csv", columns)).proposal
    assert proposal.body["signals"]["yaw_rate_rad_s"]["unit"] == "deg/min"
    (why,) = (n.message for n in proposal.notes if n.data.get("signal") == "yaw_rate_rad_s" and n.code == "evidence")
    assert why.endswith("as numbers in deg/min are")
