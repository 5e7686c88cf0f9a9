"""Logs as they come from the water: cut, swapped, empty, in another unit. Each is read, or refused with what helps; no bug."""

from __future__ import annotations

import os
import subprocess
import sys
import warnings

import numpy as np
import pytest
from cli import trial

from fieldsid.logs import load_run, save_run
from fieldsid.logs.convert.conditioning import likely_unit
from fieldsid.models.axis import Axis
from fieldsid.models.record import record_of
from fieldsid.turning.steady.speed_loss import _root, fit_surge

COLUMNS = ("time_s", "yaw_rad", "yaw_rate_rad_s", "rudder_rad", "surge_m_s")


@pytest.fixture(scope="module")
def rows(tmp_path_factory):
    folder = tmp_path_factory.mktemp("clean")
    lines = save_run(load_run(trial.flown(folder)), folder / "clean.csv").read_text().splitlines()
    assert tuple(lines[0].split(",")) == COLUMNS
    return [line.split(",") for line in lines[1:]]


def written(folder, rows, column=None, change=lambda _i, value: value):
    """Write the rows with the cells of one column changed."""
    place = COLUMNS.index(column) if column else 0
    table = [[*r[:place], str(change(i, r[place])), *r[place + 1 :]] for i, r in enumerate(rows)]
    path = folder / "log.csv"
    path.write_text("\n".join(",".join(r) for r in [list(COLUMNS), *table]) + "\n")
    return path


SPOILT = {
    "zero": lambda _i, _v: 0.0,
    "one that is huge": lambda i, v: 1e300 if i == 50 else v,
    "one that is infinite": lambda i, v: "-inf" if i == 50 else v,
    "huge": lambda _i, v: 1e200 * float(v),
    "tiny": lambda _i, v: 1e-200 * float(v),
    "a thousand times": lambda _i, v: 1000.0 * float(v),
    "missing at first": lambda i, v: "" if i < 300 else v,
    "every other one missing": lambda i, v: "nan" if i % 2 else v,
    "negative": lambda _i, v: -float(v),
    "a word": lambda i, v: "abc" if i == 50 else v,
    "words": lambda _i, _v: "abc",
}


RARER, OF_RARER = ("yaw_rate_rad_s", "surge_m_s"), ("zero", "one that is huge", "a word")
"""Columns of which the normal suite spoils some ways alone: those of time, heading and rudder have all."""


def is_rare(column, how):
    return column in RARER and how not in OF_RARER


@pytest.mark.parametrize(
    ("column", "how"),
    [pytest.param(c, how, marks=pytest.mark.slow if is_rare(c, how) else ()) for c in COLUMNS for how in SPOILT],
)
def test_a_spoilt_column_is_no_bug_and_no_noise_on_stderr(run_cli, tmp_path, rows, column, how):
    log = written(tmp_path, rows, column, SPOILT[how])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for words in (["inspect", log], ["identify", log, "--axis", "yaw"], ["import", log, "-o", tmp_path / "runs", "--force"]):
            answer = run_cli(*words)
            assert answer.code in (0, 2), answer.err
            assert (answer.code == 0) == ("error: " not in answer.err)
            assert answer.code == 0 or "\nhint: " in answer.err


@pytest.mark.parametrize(
    ("column", "how", "hint"),
    [
        ("time_s", "zero", "check that this is the time; if it is, log it with more digits"),
        ("time_s", "negative", "check that this is the time, and sort the samples by it"),
        ("time_s", "words", "check which column is the time"),
        ("yaw_rad", "words", "map another column, or leave the signal out"),
        ("time_s", "one that is huge", "--salvage"),
        ("time_s", "a word", "--salvage"),
        ("yaw_rad", "a word", "--salvage"),
    ],
)
def test_salvage_is_advised_where_it_leaves_a_log(run_cli, tmp_path, rows, column, how, hint):
    answer = run_cli("identify", written(tmp_path, rows, column, SPOILT[how]), "--axis", "yaw")
    assert answer.code == 2
    assert hint in answer.err
    assert ("--salvage" in answer.err) is (hint == "--salvage")


@pytest.mark.parametrize("value", ["1e300", "-1e12"])
def test_what_no_sensor_gives_counts_as_missing(tmp_path, rows, value):
    run = load_run(written(tmp_path, rows, "rudder_rad", lambda i, v: value if i in (50, 60) else v))
    (note,) = (n for n in run.notes if n.code == "infinite")
    assert note.data == {"signal": "rudder_rad", "count": 2}
    assert np.flatnonzero(np.isnan(run["rudder_rad"])).tolist() == [50, 60]


@pytest.mark.parametrize(
    ("step", "unit"), [(50.0, "ms"), (5e4, "us"), (5e7, "ns"), (2.0, ""), (1e12, ""), (20.0, "ms"), (1e5, "us")]
)
def test_a_step_of_time_tells_its_unit(step, unit):
    assert likely_unit(step) == (f"set its unit, probably `unit: {unit}`" if unit else "")


def test_time_in_another_unit_is_told(run_cli, tmp_path, rows):
    log = written(tmp_path, rows, "time_s", SPOILT["a thousand times"])
    (note,) = (n for n in load_run(log).notes if n.code == "time_unit")
    assert note.message == "time goes on by 50 s a sample (limit 5 s): set its unit, probably `unit: ms`"
    answer = run_cli("identify", written(tmp_path, rows, "time_s", lambda _i, v: 1e9 * float(v)), "--axis", "yaw")
    assert "the time column goes on by 5e+07 s a sample" in answer.err
    assert "hint: set its unit, probably `unit: ns`" in answer.err


@pytest.mark.parametrize(("speed", "code"), [(0.0, "no_speed"), (-1.4, "no_speed"), (1400.0, "no_speed"), (1.4, None)])
def test_a_speed_that_no_vehicle_has_is_not_taken_for_one(run_cli, tmp_path, rows, speed, code):
    log = written(tmp_path, rows, "surge_m_s", lambda _i, _v: speed)
    record = record_of(load_run(log), Axis.YAW)
    assert np.isnan(record.speed) == ("surge" not in record.signals) == (code is not None)
    (fit,) = run_cli("identify", log, "--axis", "yaw", "--json").json["fits"]
    assert (code in {w["code"] for w in fit["warnings"]}) == (code is not None)
    assert abs(fit["parameters"]["a22"]["value"] - 1.1) < 0.05


def test_a_constant_signal_is_judged_for_its_size_and_sign_too(tmp_path, rows):
    for speed, found in ((1400.0, "unit"), (-1.4, "speed_sign")):
        codes = {n.code for n in load_run(written(tmp_path, rows, "surge_m_s", lambda _i, _v, u=speed: u)).notes}
        assert {"constant", found} <= codes


@pytest.mark.parametrize("how", ["zero", "tiny", "a thousand times"])
@pytest.mark.parametrize("column", ["rudder_rad", "time_s", "surge_m_s"])
def test_the_loss_of_speed_of_a_spoilt_run_is_no_bug(run_cli, tmp_path, rows, column, how):
    log = written(tmp_path, rows, column, SPOILT[how])
    asked = ["turn-radius", trial.model_file(tmp_path), "--rudder-max", 0.3, "--method", "simulated", "--runs", log]
    assert run_cli(*asked).code in (0, 2)


def test_the_root_of_a_covariance_is_choleskys_and_stands_rounding():
    rng = np.random.default_rng(3)
    half = rng.normal(size=(3, 3)) * np.array([[1e-5], [1.0], [1e4]])
    np.testing.assert_allclose(_root(half @ half.T), np.linalg.cholesky(half @ half.T), rtol=1e-9)
    flat = np.outer([1.0, 1e-3, 0.0], [1.0, 1e-3, 0.0])
    np.testing.assert_allclose(_root(flat) @ _root(flat).T, flat, atol=1e-15)


def test_a_run_without_a_speed_says_nothing_of_its_loss(tmp_path, rows):
    assert fit_surge([load_run(written(tmp_path, rows, "surge_m_s", SPOILT["zero"]))]) is None


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda rows: rows[:1], "too few samples"),
        (lambda rows: rows[:3], "never leaves its trim"),
        (lambda rows: [["nan"] * 5 for _ in rows], "holds no table of numbers"),
        (lambda rows: rows[::-1], "time goes backwards"),
        (lambda rows: rows + rows, "time goes backwards"),
        (lambda rows: [*rows[:50], [*rows[50], "1"], *rows[51:]], "does not fit its 5 columns"),
        (lambda rows: rows[:0], "has no rows"),
    ],
)
def test_a_log_that_cannot_be_used_says_why(run_cli, tmp_path, rows, make, says):
    answer = run_cli("identify", written(tmp_path, make(rows)), "--axis", "yaw")
    assert (answer.code, answer.out) == (2, "")
    assert says in answer.err
    assert "\nhint: " in answer.err


def test_a_file_without_an_end_of_line_is_refused_before_it_is_taken_apart(run_cli, tmp_path):
    for name, text in {"one.csv": "1," * 400_000, "wide.csv": ",".join(f"c{i}" for i in range(100_000)) + "\n1\n"}.items():
        (tmp_path / name).write_text(text)
        for words in (["inspect", tmp_path / name], ["import", tmp_path / name, "-o", tmp_path / "runs"]):
            answer = run_cli(*words)
            assert answer.code == 2
            assert "a line of it has no end" in answer.err
            assert len(answer.err) < 1000


@pytest.mark.parametrize("step", [-0.1, 0.0])
def test_a_time_that_never_rises_is_said_by_inspect_too(run_cli, tmp_path, step):
    rows = "".join(f"{10 + step * i},{0.1 * i},0.{i % 3}\n" for i in range(100))
    (tmp_path / "log.csv").write_text("time_s,yaw_rad,rudder_rad\n" + rows)
    answer = run_cli("inspect", tmp_path / "log.csv")
    assert answer.code == 2
    assert "99 of 100 samples were left out, time repeats or goes back there" in answer.err


def test_a_console_without_a_files_letters_shows_their_codes(tmp_path):
    log = tmp_path / "l\u00f6g \u2693.csv"
    log.write_text("time_s,yaw_rad,rudder_rad\n" + "".join(f"{0.1 * i:.1f},{0.1 * i},0.{i % 3}\n" for i in range(100)))
    said = os.environ | {"PYTHONIOENCODING": "ascii", "LC_ALL": "C", "PYTHONUTF8": "0"}
    done = subprocess.run([sys.executable, "-m", "fieldsid", "inspect", log], env=said, capture_output=True, check=False)
    assert done.returncode == 0, done.stderr
    assert b"holds 2 signals" in done.stdout
    assert b"\\" in done.stdout.split(b"holds")[0]
