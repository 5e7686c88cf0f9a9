"""Of two columns of one fin the name or a note tells which one is the command; errors and references are no measurement."""

import numpy as np
import pytest
from look_alikes import truth, write_table

from fieldsid.logs import load_run
from fieldsid.logs.inspection import inspect_log
from fieldsid.logs.mapping.word_meaning import meaning_of

TRUTH = truth(seconds=30.0)
FIN, HELD = np.degrees(TRUTH["rudder_rad"]), np.degrees(np.roll(TRUTH["rudder_rad"], 3))
CANONICAL = {name: TRUTH[name] for name in ("time_s", "yaw_rad", "yaw_rate_rad_s", "surge_m_s")}


def proposed(tmp_path, columns):
    return inspect_log(write_table(tmp_path / "log.csv", columns)).proposal.body["signals"]


@pytest.mark.parametrize("plain", ["rudder_deg", "rudder", "rudder_angle"])
@pytest.mark.parametrize("command", ["rudder_des_deg", "rudder_cmd", "u_rudder"])
def test_a_fin_beside_its_command_is_the_measured_one(tmp_path, command, plain):
    columns = {"time": TRUTH["time_s"], "heading": np.degrees(TRUTH["yaw_rad"]), plain: HELD, command: FIN}
    signals = proposed(tmp_path, columns)
    assert signals["rudder_rad"]["column"] == command
    assert command == "u_rudder" or signals["rudder_measured_rad"]["column"] == plain


def test_a_command_that_never_moves_is_none(tmp_path):
    columns = {"time": TRUTH["time_s"], "heading": np.degrees(TRUTH["yaw_rad"]), "rudder_cmd": 0.0 * FIN, "rudder_deg": FIN}
    assert proposed(tmp_path, columns)["rudder_rad"]["column"] == "rudder_deg"


@pytest.mark.parametrize("first", ["e_speed", "r_speed", "gps_speed_2"])
def test_the_name_without_another_word_is_the_signal(tmp_path, first):
    columns = {"time": TRUTH["time_s"], first: 0.1 * FIN, "speed": TRUTH["surge_m_s"], "rudder": FIN}
    assert proposed(tmp_path, columns)["surge_m_s"]["column"] == "speed"


@pytest.mark.parametrize(
    ("name", "signal"),
    [("e_speed", None), ("e_heading", None), ("r_speed", None), ("r_heading", "yaw_goal_rad"), ("u_yaw", None),
     ("u_rudder", "rudder_rad"), ("r_rudder", "rudder_rad"), ("u_surge", "surge_m_s"), ("r_yaw_rate", "yaw_rate_rad_s"),
     ("r", "yaw_rate_rad_s"), ("yaw_e", "yaw_rad")],
)  # fmt: skip
def test_a_letter_of_control_before_a_name_says_what_it_is(name, signal):
    meaning = meaning_of(name)
    assert (meaning and meaning[0]) == signal


@pytest.mark.parametrize(("other", "is_said"), [("rudder_deg", True), ("rudder_des_deg", True), ("rudder_limit_deg", False)])
def test_a_table_that_is_read_as_it_is_says_that_another_column_may_be_its_fin(tmp_path, other, is_said):
    run = load_run(write_table(tmp_path / "log.csv", {**CANONICAL, "rudder_rad": TRUTH["rudder_rad"], other: HELD}))
    said = [n.message for n in run.notes if n.code == "alternatives"]
    assert bool(said) == is_said
    assert not said or f"`{other}`" in said[0]


def test_a_feedback_that_never_moves_beside_its_command_is_not_proposed(tmp_path):
    """It would be taken for the fin, and the run be refused as one without an excitation."""
    angles = {"heading_deg": np.degrees(TRUTH["yaw_rad"]), "rudder_cmd_deg": FIN, "rudder_actual_deg": 0.0 * FIN}
    found = inspect_log(write_table(tmp_path / "log.csv", {"time": TRUTH["time_s"], **angles}))
    assert "rudder_measured_rad" not in found.proposal.body["signals"]
    assert any("constant while the command moves" in n.message for n in found.proposal.notes)
