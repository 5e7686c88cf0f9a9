"""A log without a mapping is read where nothing an axis needs is in doubt, and it is said how; else a mapping is asked for."""

from pathlib import Path

import numpy as np
import pytest
from look_alikes import A22, B2, truth, write_table

import fieldsid as fs
from fieldsid.face.arguments import runs_of_models
from fieldsid.plant.parameter_source import load_parameter_source

TRUTH = truth(seconds=100.0)
DEG = np.pi / 180.0
CLEAR = {"Time [s]": ("time_s", 1.0), "HeadDeg": ("yaw_rad", DEG), "GyroZ_dps": ("yaw_rate_rad_s", DEG),
         "RudderDeg": ("rudder_rad", DEG), "SpeedKts": ("surge_m_s", 1852 / 3600)}  # fmt: skip


def written(folder, **changed):
    columns = {name: TRUTH[signal] / factor for name, (signal, factor) in (CLEAR | changed).items() if signal}
    return write_table(folder / "boat.csv", columns)


def test_identify_reads_what_is_clear_and_says_how_in_one_line(run_cli, tmp_path):
    done = run_cli("identify", written(tmp_path), "--axis", "yaw", "--no-figures", "--json")
    assert done.code == 0, done.err
    fit = done.json["fits"][0]
    assert fit["parameters"]["a22"]["value"] == pytest.approx(A22, rel=0.01)
    assert fit["parameters"]["b2"]["value"] == pytest.approx(B2, rel=0.01)
    assert fit["speed_m_s"] == pytest.approx(1.5, rel=0.01)
    said = [line for line in done.err.splitlines() if line.startswith("read as: ")]
    assert said == [
        "read as: yaw from HeadDeg (deg), yaw rate from GyroZ_dps (deg/s), surge from SpeedKts (kn), rudder from RudderDeg (deg)"
    ]
    assert "read_as" not in {w["code"] for w in fit["warnings"]}


def test_columns_that_are_no_names_of_ours_join_those_that_are(run_cli, tmp_path):
    columns = {"time_s": TRUTH["time_s"], "yaw_rate_rad_s": TRUTH["yaw_rate_rad_s"], "rudder_rad": TRUTH["rudder_rad"],
               "heading_deg": np.degrees(TRUTH["yaw_rad"]), "speed_mps": TRUTH["surge_m_s"]}  # fmt: skip
    done = run_cli("identify", write_table(tmp_path / "boat.csv", columns), "--axis", "yaw", "--no-figures", "--json")
    assert done.code == 0, done.err
    assert done.json["fits"][0]["speed_m_s"] == pytest.approx(1.5, rel=0.01)
    assert "yaw from heading_deg (deg)" in done.err
    assert "ignored_columns" not in done.out


def test_a_vehicle_that_turns_in_a_plane_may_send_a_quaternion(run_cli, tmp_path):
    half = 0.5 * TRUTH["yaw_rad"]
    nil = np.zeros_like(half)
    columns = {"time": TRUTH["time_s"], "qw": np.cos(half), "qx": nil, "qy": nil, "qz": np.sin(half),
               "RudderDeg": TRUTH["rudder_rad"] / DEG, "SpeedKts": TRUTH["surge_m_s"] * 3600 / 1852}  # fmt: skip
    done = run_cli("identify", write_table(tmp_path / "boat.csv", columns), "--axis", "yaw", "--no-figures", "--json")
    assert done.code == 0, done.err
    assert done.json["fits"][0]["parameters"]["b2"]["value"] == pytest.approx(B2, rel=0.01)


def test_numbers_that_stand_for_nothing_are_missing_and_not_fitted(run_cli, tmp_path):
    odd = {"HeadDeg": (-999.25, 37), "GyroZ_dps": (0.0, 41), "SpeedKts": (9999.0, 51)}
    columns = {name: TRUTH[signal] / factor for name, (signal, factor) in CLEAR.items()}
    for name, (number, every) in odd.items():
        columns[name] = columns[name].copy()
        columns[name][5::every] = number
    done = run_cli("identify", write_table(tmp_path / "boat.csv", columns), "--axis", "yaw", "--no-figures", "--json")
    assert done.code == 0, done.err
    fit = done.json["fits"][0]
    assert fit["parameters"]["a22"]["value"] == pytest.approx(A22, rel=0.01)
    assert fit["speed_m_s"] == pytest.approx(1.5, rel=0.01)
    assert "are missing now" in next(w["message"] for w in fit["warnings"] if w["code"] == "dropouts")


def test_a_compass_slower_than_the_rows_counts_once_for_each_of_its_numbers(run_cli, tmp_path):
    columns = {name: TRUTH[signal] / factor for name, (signal, factor) in CLEAR.items()}
    del columns["GyroZ_dps"]
    columns["HeadDeg"] = columns["HeadDeg"][np.arange(TRUTH["time_s"].size) // 4 * 4]
    done = run_cli("identify", write_table(tmp_path / "boat.csv", columns), "--axis", "yaw", "--no-figures", "--json")
    assert done.code == 0, done.err
    fit = done.json["fits"][0]
    assert fit["parameters"]["a22"]["value"] == pytest.approx(A22, rel=0.01)
    assert "repeated" in {w["code"] for w in fit["warnings"]}


@pytest.mark.usefixtures("batch_here")
@pytest.mark.parametrize("command", ["diagnose", "live", "batch"])
def test_the_other_commands_read_it_too(run_cli, tmp_path, command):
    more = {"live": ("--speed", "0"), "batch": ("-o", tmp_path / "out", "--no-diagnose", "--workers", "1")}.get(command, ())
    done = run_cli(command, written(tmp_path), "--axis", "yaw", *more, "--json")
    assert done.code == 0, done.err


def test_what_is_made_of_its_model_reads_it_again(run_cli, tmp_path, monkeypatch):
    log = written(tmp_path)
    monkeypatch.chdir(tmp_path)
    models = tmp_path / "models"
    assert run_cli("identify", log, "--axis", "yaw", "--effects", "servo_lag", "-o", models, "--no-figures").code == 0
    model = str(next(models.glob("*.yaml")))
    (run,) = runs_of_models(load_parameter_source([Path(model)]))
    assert run.has("surge_m_s")
    (again,) = fs.identify(log, "yaw", effects="servo_lag")
    assert again.model.values["a22"] == pytest.approx(fs.load_model(model).values["a22"])
    turned = run_cli("turn-radius", model, "--method", "simulated")
    assert turned.code == 0, turned.err
    assert "cannot be read again" not in turned.err
    assert run_cli("report", tmp_path, "-o", tmp_path / "r.html", "--json").json["runs"] == [log.stem]


def test_what_no_axis_needs_and_has_no_unit_is_left_out_and_said(run_cli, tmp_path):
    done = run_cli("identify", written(tmp_path, SpeedKts=("", 1.0), speed=("surge_m_s", 1.0)), "--axis", "yaw", "--no-figures")
    assert done.code == 0, done.err
    assert "left out: surge (nothing tells its unit)" in done.err


@pytest.mark.parametrize(
    ("changed", "why"),
    [
        ({"RudderDeg": ("", 1.0), "rudder": ("rudder_rad", 1.0)}, "rudder_rad (nothing tells its unit)"),
        ({"GyroZ_dps": ("yaw_rate_rad_s", 1.0)}, "yaw_rad"),
        ({"RudderDeg": ("", 1.0), "port": ("rudder_rad", DEG)}, "rudder_rad (only the numbers say so)"),
    ],
    ids=["a fin without a unit", "a rate that contradicts its unit", "a fin without a name"],
)
def test_what_is_in_doubt_asks_for_a_mapping_and_says_why(run_cli, tmp_path, changed, why):
    done = run_cli("identify", written(tmp_path, **changed), "--axis", "yaw", "--no-figures")
    assert done.code == 2
    assert "sysid inspect" in done.err
    assert why in done.err


def test_an_import_still_asks_for_a_mapping(run_cli, tmp_path):
    done = run_cli("import", written(tmp_path), "-o", tmp_path / "runs")
    assert done.code == 2
    assert "--write-mapping" in done.err


def test_a_rate_of_turn_in_degrees_a_minute_is_told_by_the_heading_that_wraps(run_cli, tmp_path):
    columns = {"time": TRUTH["time_s"], "Heading": np.degrees(TRUTH["yaw_rad"] + 0.05) % 360.0,
               "ROT": 60.0 * np.degrees(TRUTH["yaw_rate_rad_s"]), "RudderAngle": TRUTH["rudder_rad"] / DEG,
               "SpeedKts": TRUTH["surge_m_s"] * 3600 / 1852}  # fmt: skip
    done = run_cli("identify", write_table(tmp_path / "boat.csv", columns), "--axis", "yaw", "--no-figures", "--json")
    assert done.code == 0, done.err
    assert "yaw rate from ROT (deg/min)" in done.err
    assert done.json["fits"][0]["parameters"]["b2"]["value"] == pytest.approx(B2, rel=0.01)


def test_names_that_say_their_frames_are_turned_into_ours(run_cli, tmp_path):
    columns = {"time": TRUTH["time_s"], "yaw_enu_rad": 0.5 * np.pi - TRUTH["yaw_rad"],
               "yaw_rate_enu_rad_s": -TRUTH["yaw_rate_rad_s"], "RudderDeg": TRUTH["rudder_rad"] / DEG,
               "SpeedKts": TRUTH["surge_m_s"] * 3600 / 1852}  # fmt: skip
    done = run_cli("identify", write_table(tmp_path / "boat.csv", columns), "--axis", "yaw", "--no-figures", "--json")
    assert done.code == 0, done.err
    assert done.json["fits"][0]["parameters"]["b2"]["value"] == pytest.approx(B2, rel=0.01)
