"""Several fins for one plane, runs in several tables: what inspect proposes is imported and identified without an edit."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
import several_fins as made

from fieldsid.logs import load_run

LOGS = (
    made.x_tail, made.x_tail_by_pulses, made.twin_rudders, made.plus_tail, made.differential_thrust, made.moos_x_tail,
    made.neptus, made.ulog_tables, made.rostopic, made.simulator,
)  # fmt: skip


def imported(run_cli, log, folder):
    inspected = run_cli("inspect", str(log), "--write-mapping", str(folder / "m.yaml"), "--json")
    run_cli("import", str(log), "--mapping", str(folder / "m.yaml"), "-o", str(folder / "run.parquet"), "--json")
    return load_run(folder / "run.parquet"), inspected.json


@pytest.fixture(scope="module")
def brought(run_shared, tmp_path_factory):
    """Return a function that gives the folder of a log with its run in it, and the same as `imported`; each once."""

    @cache
    def once(log):
        folder = tmp_path_factory.mktemp(log.__name__)
        return folder, *imported(run_shared, log(folder), folder)

    return once


def signs(item):
    return [round(entry["scale"] / abs(item["sum"][0]["scale"])) for entry in item["sum"]]


def evidence(record, signal):
    return next(
        f for f in record["findings"] if f["code"] == "evidence" and f["data"].get("signal") == signal and "fins" in f["data"]
    )


@pytest.mark.parametrize("log", LOGS, ids=lambda f: f.__name__)
def test_the_truth_comes_back_within_a_hundredth(run_cli, brought, log):
    folder, _, record = brought(log)
    done = run_cli("identify", str(folder / "run.parquet"), "--axis", "yaw", "--no-figures", "--json")
    values = {name: p["value"] for name, p in done.json["fits"][0]["parameters"].items()}
    scale = 1.0
    if log is made.differential_thrust:
        scale = record["mapping"]["signals"]["rudder_rad"]["sum"][1]["scale"] / made.PER_NEWTON
    assert values["a22"] == pytest.approx(made.A22, rel=0.01)
    assert abs(values["b2"]) == pytest.approx(made.B2 / scale, rel=0.01)


def test_an_x_tail_is_told_apart_in_both_planes_and_says_why(brought):
    _, run, record = brought(made.x_tail)
    signals = record["mapping"]["signals"]
    assert signs(signals["rudder_rad"]) == [1, 1, -1, -1]
    assert signs(signals["elevator_rad"]) == [1, -1, 1, -1]
    np.testing.assert_allclose(run["rudder_rad"], made.RUDDER, atol=1e-6)
    np.testing.assert_allclose(run["elevator_rad"], made.ELEVATOR, atol=1e-6)
    found = evidence(record, "rudder_rad")
    assert found["data"]["fins"] == {"fin1": 0.25, "fin2": 0.25, "fin3": -0.25, "fin4": -0.25}
    assert "1/4 fin1 + 1/4 fin2 - 1/4 fin3 - 1/4 fin4" in found["message"]
    assert "they moved in 2 patterns only" in found["message"]


def test_fins_that_only_moved_together_are_said_to(run_cli, tmp_path):
    fins = {f"fin{k}": made.of(np.degrees(sign * made.RUDDER)) for k, sign in enumerate(made.ONE, 1)}
    log = made.table(tmp_path / "x.csv", {"time_s": made.of(made.TIME), **made.angles(made.motion(made.RUDDER)), **fins})
    _, record = imported(run_cli, log, tmp_path)
    assert signs(record["mapping"]["signals"]["rudder_rad"]) == [1, 1, -1, -1]
    assert "together only" in evidence(record, "rudder_rad")["message"]


def test_thrusters_make_the_yaw_command_and_the_thrust(brought):
    _, _, record = brought(made.differential_thrust)
    signals = record["mapping"]["signals"]
    assert [(e["column"], np.sign(e["scale"])) for e in signals["rudder_rad"]["sum"]] == [
        ("thruster_port", -1),
        ("thruster_stbd", 1),
    ]
    assert [e["scale"] for e in signals["thrust"]["sum"]] == [0.5, 0.5]


def test_thrusters_in_shares_of_one_are_not_converted(run_cli, tmp_path):
    parts = {"thruster_left": made.of(0.5 + made.RUDDER), "thruster_right": made.of(0.5 - made.RUDDER)}
    log = made.table(tmp_path / "x.csv", {"time_s": made.of(made.TIME), **made.angles(made.motion(made.RUDDER)), **parts})
    _, record = imported(run_cli, log, tmp_path)
    assert [e["scale"] > 0.0 for e in record["mapping"]["signals"]["rudder_rad"]["sum"]] == [False, True]
    assert all("unit" not in e for e in record["mapping"]["signals"]["rudder_rad"]["sum"])


def test_of_many_outputs_the_one_that_turns_the_vehicle_is_named(brought):
    _, _, record = brought(made.ulog_tables)
    assert record["mapping"]["signals"]["rudder_rad"] == {"topic": "actuator_outputs_0", "field": "output[2]"}


def test_a_fin_of_another_share_keeps_it(run_cli, tmp_path):
    apart = made.steps(21, 0.1, 1.5, 5.0)
    fins = {"fin1": made.of(made.RUDDER + apart), "fin2": made.of(made.RUDDER - 2.0 * apart)}  # 2/3 and 1/3
    log = made.table(tmp_path / "x.csv", {"time_s": made.of(made.TIME), **made.angles(made.motion(made.RUDDER)), **fins})
    _, record = imported(run_cli, log, tmp_path)
    assert [e["scale"] for e in record["mapping"]["signals"]["rudder_rad"]["sum"]] == [0.6667, 0.3333]


def test_fins_without_an_effect_are_not_proposed(run_cli, tmp_path):
    fins = {f"fin{k}": made.of(made.steps(30 + k, 0.2, 1.5, 5.0)) for k in range(3)}
    log = made.table(tmp_path / "x.csv", {"time_s": made.of(made.TIME), **made.angles(made.motion(made.RUDDER)), **fins})
    inspected = run_cli("inspect", str(log), "--json").json
    assert not [f for f in inspected["findings"] if "fins" in f["data"]]


def test_two_rudders_with_the_same_numbers_are_one(run_cli, tmp_path):
    sides = {f"rudder_{side}_deg": made.of(np.degrees(made.RUDDER)) for side in ("port", "stbd")}
    log = made.table(tmp_path / "x.csv", {"time_s": made.of(made.TIME), **made.angles(made.motion(made.RUDDER)), **sides})
    inspected = run_cli("inspect", str(log), "--json").json
    assert inspected["mapping"]["signals"]["rudder_rad"]["column"] == "rudder_port_deg"


def test_a_folder_of_tables_is_identified_as_recognised_and_by_its_mapping(run_cli, tmp_path):
    log, asked = made.simulator(tmp_path), ("--axis", "yaw", "--no-figures", "--json")
    recognised = run_cli("identify", str(log), *asked)
    assert "read as: " in recognised.err
    run_cli("inspect", str(log), "--write-mapping", str(tmp_path / "m.yaml"))
    mapped = run_cli("identify", str(log), "-m", str(tmp_path / "m.yaml"), *asked)
    assert "read as: " not in mapped.err
    for done in (recognised, mapped):
        assert done.json["fits"][0]["parameters"]["a22"]["value"] == pytest.approx(made.A22, rel=0.01)


def test_tables_are_joined_by_name(run_cli, tmp_path):
    log = made.simulator(tmp_path)
    tables = [str(log / "run3_states.csv"), str(log / "run3_inputs.csv")]
    found = run_cli("inspect", "--join", *tables, "--write-mapping", str(tmp_path / "m.yaml"))
    assert f"next: sysid import --join {tables[0]} {tables[1]} --mapping {tmp_path / 'm.yaml'} -o runs/" in found.out
    done = run_cli("import", "--join", *tables, "--mapping", str(tmp_path / "m.yaml"), "-o", str(tmp_path / "runs"), "--json")
    assert [r["file"] for r in done.json["runs"]] == [str(tmp_path / "runs" / "run3.parquet")]
    np.testing.assert_allclose(load_run(tmp_path / "runs" / "run3.parquet")["rudder_rad"], made.RUDDER, atol=1e-6)


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (("inspect", "a.csv", "b.csv"), "`inspect` takes one log"),
        (("inspect", "--join", "a.csv"), "nothing to join"),
        (("import", "--join", "a.csv", "-o", "runs"), "nothing to join"),
        (("import", "--join", "-", "a.csv", "-o", "runs"), "standard input"),
    ],
)
def test_what_cannot_be_joined_is_refused(run_cli, words, says):
    refused = run_cli(*words)
    assert refused.code == 2
    assert says in refused.err


def test_measured_fins_stand_beside_the_commanded(run_cli, tmp_path):
    late = [np.concatenate([np.zeros(4), fin[:-4]]) for fin in made.x_fins()]  # 0.2 s behind
    told = {f"fin{k}_cmd_deg": made.of(np.degrees(fin)) for k, fin in enumerate(made.x_fins(), 1)}
    seen = {f"fin{k}_feedback_deg": made.of(np.degrees(fin)) for k, fin in enumerate(late, 1)}
    motion = made.angles(made.motion(np.concatenate([np.zeros(4), made.RUDDER[:-4]])))
    log = made.table(tmp_path / "x.csv", {"time_s": made.of(made.TIME), **motion, **seen, **told})
    run, _ = imported(run_cli, log, tmp_path)
    np.testing.assert_allclose(run["rudder_rad"], made.RUDDER, atol=1e-6)
    np.testing.assert_allclose(run["rudder_measured_rad"][4:], made.RUDDER[:-4], atol=1e-6)


def test_the_side_may_stand_first(run_cli, tmp_path):
    sides = {"port_rudder": made.of(np.degrees(made.RUDDER) + 3.0), "starboard_rudder": made.of(np.degrees(made.RUDDER) - 3.0)}
    log = made.table(tmp_path / "x.csv", {"time_s": made.of(made.TIME), **made.angles(made.motion(made.RUDDER)), **sides})
    run, _ = imported(run_cli, log, tmp_path)
    np.testing.assert_allclose(run["rudder_rad"], made.RUDDER, atol=1e-6)


@pytest.mark.parametrize(("names", "middle", "reach"), [(("left", "right"), 40, 30), (("motor_l", "motor_r"), 90, 60)])
def test_thrusters_called_by_their_side_and_in_bytes_are_read_alike(run_cli, tmp_path, names, middle, reach):
    apart = made.RUDDER / 0.2 * reach
    sides = dict(zip(names, ([round(v) for v in middle + sign * apart] for sign in (-1.0, 1.0)), strict=True))
    log = made.table(tmp_path / "x.csv", {"time_s": made.of(made.TIME), **made.angles(made.motion(made.RUDDER)), **sides})
    run, record = imported(run_cli, log, tmp_path)
    entries = record["mapping"]["signals"]["rudder_rad"]["sum"]
    assert entries[0]["scale"] == -entries[1]["scale"] < 0.0
    assert entries[0].get("unit") == entries[1].get("unit")
    scale = run["rudder_rad"] @ made.RUDDER / (made.RUDDER @ made.RUDDER)
    np.testing.assert_allclose(run["rudder_rad"], scale * made.RUDDER, atol=0.02)


@pytest.mark.parametrize("late_s", [0.0, 0.4])
def test_an_x_tail_is_told_apart_by_noisy_angles_alone(run_cli, tmp_path, late_s):
    late, rng = round(late_s / made.STEP), np.random.default_rng(12)
    found = made.motion(*(np.roll(command, late) for command in (made.RUDDER, made.ELEVATOR)), noise=False)
    seen = {f"{n}_deg": made.of(found[n] + 1.0 * rng.standard_normal(made.TIME.size)) for n in ("heading", "pitch")}
    fins = {f"fin{k}": made.of(np.degrees(fin)) for k, fin in enumerate(made.x_fins(), 1)}
    signals = run_cli("inspect", str(made.table(tmp_path / "x.csv", {"time_s": made.of(made.TIME), **seen, **fins})), "--json")
    signals = signals.json["mapping"]["signals"]
    assert signs(signals["rudder_rad"]) == [1, 1, -1, -1]
    assert signs(signals["elevator_rad"]) == [1, -1, 1, -1]
