"""A run in several tables: which of a folder are one, how they are joined, and what is not merged in silence."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose

from fieldsid.errors import LogError, MappingError
from fieldsid.logs.inspection import inspect_log
from fieldsid.logs.load import load_run
from fieldsid.logs.mapping.mapping_file import mapping_of
from fieldsid.logs.reader import reader_of
from fieldsid.logs.run import Run
from fieldsid.logs.save import save_run

TIME = 0.1 * np.arange(300)
YAW, RATE = 0.5 * np.sin(0.4 * TIME), 0.2 * np.cos(0.4 * TIME)
STAMPS = 0.03 + 0.5 * np.arange(58)
RUDDER = 0.1 * (-1.0) ** np.arange(58)
EPOCH = 1.7e9


def table(path, names, *columns, separator=","):
    path.parent.mkdir(exist_ok=True)
    rows = (separator.join(f"{v:.12g}" if isinstance(v, float) else str(v) for v in row) for row in zip(*columns, strict=True))
    path.write_text("\n".join([separator.join(names), *rows]) + "\n")
    return path


def listed(*arrays):
    return [a.tolist() for a in arrays]


def motion(path, start=0.0, name="time_s"):
    return table(path, [name, "psi (rad)", "r (rad/s)"], *listed(start + TIME, YAW, RATE))


def command(path, start=0.0, name="time_s"):
    return table(path, [name, "rudder (rad)"], *listed(start + STAMPS, RUDDER))


def mapped(motion_of, command_of):
    signals = {
        "yaw_rad": {"topic": motion_of, "field": "psi (rad)"},
        "yaw_rate_rad_s": {"topic": motion_of, "field": "r (rad/s)"},
        "rudder_rad": {"topic": command_of, "field": "rudder (rad)"},
    }
    return mapping_of({"signals": signals})


def expected(run):
    return RUDDER[np.clip(np.floor((run.time - 0.03) / 0.5 + 1e-6).astype(int), 0, 57)]


@pytest.mark.parametrize("start", [0.0, EPOCH])
def test_a_folder_is_one_run_on_one_clock(tmp_path, start):
    motion(tmp_path / "state.csv", start)
    command(tmp_path / "input.csv", start)
    run = load_run(tmp_path, mapped("state", "input"))
    known = run.time >= 0.03
    assert_allclose(run["rudder_rad"][known], expected(run)[known])
    assert_allclose(run["yaw_rad"], YAW, atol=1e-9)
    assert run.name == tmp_path.name


def test_the_same_by_name_from_two_folders_and_a_mapping_for_every_run(tmp_path):
    first = motion(tmp_path / "states" / "run7_state.csv", EPOCH), command(tmp_path / "inputs" / "run7_input.csv", EPOCH)
    run = load_run(first[0], mapped("state", "input"), joined=first[1:])
    assert run.name == "run7"
    assert_allclose(run["rudder_rad"][1:], expected(run)[1:])


def test_the_proposal_of_a_folder_can_be_imported(tmp_path):
    motion(tmp_path / "state.csv", EPOCH, "timestamp (seconds since 01/01/1970)")
    command(tmp_path / "input.csv", EPOCH, "timestamp (seconds since 01/01/1970)")
    found = inspect_log(tmp_path)
    assert {s: i["topic"] for s, i in found.proposal.body["signals"].items()} == {
        "yaw_rad": "state",
        "yaw_rate_rad_s": "state",
        "rudder_rad": "input",
    }
    assert {"joined"} <= {n.code for n in found.notes}
    assert found.run is not None


def test_the_quaternion_and_the_speed_of_one_table_of_several_are_taken(tmp_path):
    half = 0.5 * YAW
    names = ["time_s", "phi_r", "q.w", "q.x", "q.y", "q.z", "wz"]
    table(tmp_path / "run" / "imu.csv", names, *listed(TIME, 40 * YAW, np.cos(half), 0 * half, 0 * half, np.sin(half), RATE))
    table(tmp_path / "run" / "drive.csv", ["time_s", "V", "delta"], *listed(STAMPS, 1.5 + STAMPS, RUDDER))
    inspection = inspect_log(tmp_path / "run")
    signals = inspection.proposal.body["signals"]
    assert signals["attitude"] == {"topic": "imu", "field": "q.x, q.y, q.z, q.w"}
    assert (signals["surge_m_s"]["field"], "sway_m_s" in signals, "roll_rad" in signals) == ("V", False, False)
    assert not any("roll_rad is taken from" in note.message for note in inspection.proposal.notes)
    assert_allclose(load_run(tmp_path / "run", mapping_of(inspection.proposal.body))["yaw_rad"][:290], YAW[:290], atol=1e-6)


def test_devices_in_the_rows_of_one_table_are_topics_of_their_own(tmp_path):
    motion(tmp_path / "State.csv", EPOCH, "timestamp")
    rows = [(EPOCH + t, "auv", k, v * (k - 1)) for t, v in zip(STAMPS, RUDDER, strict=True) for k in range(3)]
    table(tmp_path / "SetServo.csv", ["timestamp", " system", " id", " value (rad)"], *map(list, zip(*rows, strict=True)))
    assert [c.name for c in inspect_log(tmp_path).inventory.channels] == ["SetServo[0]", "SetServo[1]", "SetServo[2]", "State"]
    signals = {
        "yaw_rad": {"topic": "State", "field": "psi (rad)"},
        "rudder_rad": {
            "sum": [
                {"topic": "SetServo[2]", "field": "value (rad)", "scale": 0.5},
                {"topic": "SetServo[0]", "field": "value (rad)", "scale": -0.5},
            ]
        },
    }
    run = load_run(tmp_path, mapping_of({"signals": signals}))
    assert_allclose(run["rudder_rad"][1:], expected(run)[1:])


def test_a_table_that_counts_from_an_epoch_is_not_joined_with_one_that_does_not(tmp_path):
    motion(tmp_path / "state.csv", EPOCH)
    command(tmp_path / "input.csv", 0.0)
    with pytest.raises(LogError, match="different clocks") as caught:
        load_run(tmp_path, mapped("state", "input"))
    assert "`state.csv` from an epoch" in caught.value.found
    assert "`input.csv` from a start of its own" in caught.value.found
    found = inspect_log(tmp_path)
    assert "clocks_apart" in {n.code for n in found.notes}
    assert found.run is None


def test_tables_that_were_never_logged_together_are_not_joined(tmp_path):
    motion(tmp_path / "state.csv", EPOCH)
    command(tmp_path / "input.csv", EPOCH + 3600.0)
    with pytest.raises(LogError, match="never logged at the same time"):
        load_run(tmp_path, mapped("state", "input"))


def test_two_clocks_of_their_own_that_do_not_fit_are_said(tmp_path):
    motion(tmp_path / "state.csv")
    command(tmp_path / "input.csv", 12.0)
    codes = {n.code for n in load_run(tmp_path, mapped("state", "input")).notes}
    assert "clock_assumed" in codes
    command(tmp_path / "input.csv", 0.0)
    assert "clock_assumed" not in {n.code for n in load_run(tmp_path, mapped("state", "input")).notes}


def test_a_folder_of_several_such_runs_says_which_tables_belong_together(tmp_path):
    for k in (1, 2, 10):
        motion(tmp_path / f"run{k}_state.csv")
        command(tmp_path / f"run{k}_input.csv")
    with pytest.raises(LogError, match="3 runs of 2 tables") as caught:
        inspect_log(tmp_path)
    assert "run1: run1_input.csv, run1_state.csv" in caught.value.found
    assert "run10: run10_input.csv, run10_state.csv" in caught.value.found
    assert "sysid inspect --join" in caught.value.hint


def test_a_folder_of_whole_runs_stays_one(tmp_path):
    for k in (1, 2):
        table(tmp_path / f"run{k}.csv", ["time_s", "yaw_rad", "rudder_rad"], *listed(TIME, YAW, RATE))
    with pytest.raises(LogError, match="is a folder, and no bag"):
        reader_of(tmp_path)


def test_tables_alike_are_devices_of_one_run_where_none_is_whole(tmp_path):
    for name, values in (("heading", YAW), ("rudder", RATE), ("elevator", 0 * RATE)):
        table(tmp_path / f"{name}.csv", ["%time", "field.data"], *listed(1e18 + 1e8 * np.arange(300), values))
    signals = inspect_log(tmp_path).proposal.body["signals"]
    assert signals["rudder_rad"] == {"topic": "rudder", "field": "field.data"}
    assert signals["yaw_rad"]["topic"] == "heading"


def test_other_files_of_a_folder_are_no_part_of_the_run(tmp_path):
    motion(tmp_path / "state.csv", EPOCH)
    command(tmp_path / "input.csv", EPOCH)
    (tmp_path / "notes.txt").write_text("wind from the west, rudder sticky\n")
    (tmp_path / "photo.csv").write_bytes(b"\x89PNG\r\n\x1a\n")
    table(tmp_path / "settings.csv", ["name", "value"], ["kp", "ki"], [1, 2])
    run = load_run(tmp_path, mapped("state", "input"))
    assert run.has("rudder_rad")
    found = inspect_log(tmp_path)
    assert any(n.code == "no_clock" and n.data["tables"] == ["settings.csv"] for n in found.notes)


def test_a_topic_or_column_that_is_not_there_is_named(tmp_path):
    motion(tmp_path / "state.csv")
    command(tmp_path / "input.csv")
    with pytest.raises(MappingError, match="no topic `inputs`"):
        load_run(tmp_path, mapped("state", "inputs"))


def test_what_is_no_table_is_not_joined(tmp_path):
    from binary_logs import write_alog

    log = write_alog(tmp_path / "x.alog", TIME, {"A": YAW})
    with pytest.raises(LogError, match="only tables are joined"):
        load_run(motion(tmp_path / "state.csv"), mapped("state", "x"), joined=[log])


def test_a_table_without_a_fin_says_which_lie_beside_it(tmp_path):
    state, _ = motion(tmp_path / "state.csv"), command(tmp_path / "input.csv")
    (note,) = [n for n in inspect_log(state).notes if n.code == "tables_beside"]
    assert f"beside it lie input.csv: where they are of the same run, `sysid inspect {tmp_path}`" in note.message
    for k in (1, 2):
        motion(tmp_path / "runs" / f"run{k}_state.csv")
        command(tmp_path / "runs" / f"run{k}_input.csv")
    (note,) = [n for n in inspect_log(tmp_path / "runs" / "run2_state.csv").notes if n.code == "tables_beside"]
    assert f"`sysid inspect --join {tmp_path / 'runs' / 'run2_input.csv'} {tmp_path / 'runs' / 'run2_state.csv'}`" in note.message


def test_a_table_with_a_fin_or_alone_says_nothing_of_others(tmp_path):
    motion(tmp_path / "state.csv")
    whole = table(tmp_path / "whole.csv", ["time_s", "yaw_rad", "rudder_rad"], *listed(TIME, YAW, RATE))
    assert "tables_beside" not in {n.code for n in inspect_log(whole).notes}
    alone = motion(tmp_path / "alone" / "state.csv")
    assert "tables_beside" not in {n.code for n in inspect_log(alone).notes}


@pytest.mark.parametrize(("unit", "in_deg"), [("rad", np.pi / 180.0), ("deg", 1.0)])
def test_latitude_and_longitude_of_joined_tables_are_metres_in_either_unit(tmp_path, unit, in_deg):
    way = 1.2 * TIME
    latitude, longitude = 41.18 + np.degrees(way * np.cos(0.3) / 6.36e6), -8.7 + np.degrees(way * np.sin(0.3) / 4.81e6)
    place = listed(TIME, in_deg * latitude, in_deg * longitude, YAW)
    table(tmp_path / "EstimatedState.csv", ["time_s", f"lat ({unit})", f"lon ({unit})", "psi (rad)"], *place)
    command(tmp_path / "SetServoPosition.csv")
    found = inspect_log(tmp_path)
    position = found.proposal.body["signals"]["position"]
    assert position.get("unit", "deg") == unit
    run = load_run(tmp_path, mapping_of(found.proposal.body))
    assert_allclose(np.hypot(run["x_m"], run["y_m"])[-1], way[-1], rtol=0.01)
    assert_allclose(np.arctan2(run["y_m"], run["x_m"])[-1], 0.3, atol=0.01)
    assert_allclose(run["yaw_rad"], YAW[: len(run)], atol=1e-9)


@pytest.mark.parametrize("suffix", [".csv", ".parquet"])
def test_tables_with_canonical_names_are_read_as_they_are_whatever_their_clocks_are_called(tmp_path, suffix):
    parts = {
        "state": {"timestamp": EPOCH + TIME, "yaw_rad": YAW, "yaw_rate_rad_s": RATE},
        "input": {"time_s": EPOCH + STAMPS, "rudder_deg": np.degrees(RUDDER)},
    }
    for name, columns in parts.items():
        frame = pd.DataFrame(columns)
        frame.to_csv(tmp_path / f"{name}.csv", index=False) if suffix == ".csv" else frame.to_parquet(
            tmp_path / f"{name}{suffix}"
        )
    run = load_run(tmp_path)
    known = run.time >= 0.03
    assert_allclose(run["rudder_rad"][known], expected(run)[known])
    assert {"joined"} <= {n.code for n in run.notes}
    table(tmp_path / "aid.csv", ["time_s", "yaw_rad"], *listed(EPOCH + TIME, YAW))
    with pytest.raises(MappingError, match="needs a mapping"):  # which yaw is meant nothing says
        load_run(tmp_path)


def test_runs_that_are_whole_each_with_columns_of_its_own_are_not_joined(tmp_path):
    table(tmp_path / "a.csv", ["time_s", "yaw_rad", "rudder_rad"], *listed(TIME, YAW, RATE))
    table(tmp_path / "b.csv", ["time_s", "yaw_rad", "yaw_rate_rad_s", "rudder_rad"], *listed(TIME, YAW, RATE, RATE))
    with pytest.raises(LogError, match="is a folder, and no bag"):
        reader_of(tmp_path)


def test_runs_that_were_imported_are_not_the_tables_of_one(tmp_path):
    for name, columns in {"a": ["yaw_rad"], "b": ["yaw_rate_rad_s", "yaw_rad"]}.items():
        save_run(Run(name, TIME, dict.fromkeys(columns, YAW)), tmp_path / f"{name}.parquet")
    with pytest.raises(LogError, match="is a folder, and no bag"):
        reader_of(tmp_path)
