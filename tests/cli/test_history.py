"""`sysid history`: the line of a model as table, JSON and figure, with a warning for every file that is not what it was."""

from __future__ import annotations

from hashlib import sha256

import hidden_lag
import pytest
from cli import trial


@pytest.fixture(scope="module")
def line(tmp_path_factory):
    """A model and two extensions of it, the second kept although it does not pay."""
    from fieldsid.cli.app import main

    folder = tmp_path_factory.mktemp("line")
    logs, parent = hidden_lag.files(folder), trial.model_file(folder)
    common = [*map(str, logs.train), "--validate", str(logs.unseen)]
    assert main(["extend", str(parent), *common, "--add", "servo_lag"]) == 0
    child = folder / "truth+servo_lag.yaml"
    assert main(["extend", str(child), *common, "--add", "quadratic_damping", "--keep"]) == 0
    return folder / "truth+servo_lag+quadratic_damping.yaml"


def test_the_error_is_told_before_and_after_each_addition(run_cli, line, tmp_path):
    body = run_cli("history", line, "--figure", tmp_path / "h.png", "--json").json
    first, lag, quadratic = body["generations"]
    assert body["schema"] == "fieldsid/history/1"
    assert body["intact"] is True
    assert (first["effects"], first["added"]) == ([], [])
    assert lag["over_floor"]["after"] < 1.1 < lag["over_floor"]["before"]
    assert quadratic["over_floor"]["before"] == pytest.approx(lag["over_floor"]["after"], rel=0.01)
    assert quadratic["kept_by"] == "--keep"
    assert (tmp_path / "h.png").read_bytes()[:4] == b"\x89PNG"


@pytest.mark.parametrize(("suffix", "first"), [(".svg", b"<?xml"), (".pdf", b"%PDF-")])
def test_the_figure_is_of_the_kind_that_its_name_says(run_cli, line, tmp_path, suffix, first):
    assert run_cli("history", line, "--figure", tmp_path / f"h{suffix}").code == 0
    assert (tmp_path / f"h{suffix}").read_bytes().startswith(first)


def test_text_is_a_table_effect_by_effect(run_cli, line):
    answer = run_cli("history", line)
    assert answer.code == 0
    assert "+ servo_lag" in answer.out
    assert "+ quadratic_damping: kept because of --keep; judged on zigzag" in answer.out
    assert answer.err == ""


def test_a_model_nobody_extended_has_no_history_yet(run_cli, tmp_path):
    answer = run_cli("history", trial.model_file(tmp_path), "--figure", tmp_path / "h.png")
    assert answer.code == 0
    assert "nothing was added yet" in answer.out
    assert "no figure to draw" in answer.err
    assert not (tmp_path / "h.png").exists()


def test_a_model_whose_runs_were_searched_in_vain_goes_on_to_its_use(run_cli, tmp_path):
    log = trial.flown(tmp_path)
    (fit,) = run_cli("identify", log, "--axis", "yaw", "-o", tmp_path, "--no-figures", "--json").json["fits"]
    asked = ("history", fit["model"], "--quiet")
    assert run_cli(*asked).out.splitlines()[2].startswith("next: sysid diagnose ")
    held = f"schema: fieldsid/diagnosis/1\ninputs:\n- path: run7.parquet\n  sha256: {sha256(log.read_bytes()).hexdigest()}\n"
    (tmp_path / "diagnosis.yaml").write_text(f"{held}effects: []\n")
    assert run_cli(*asked).out.splitlines()[2].startswith("next: sysid turn-radius ")
    (tmp_path / "diagnosis.yaml").write_text(f"{held}effects: [servo_lag]\n")
    assert run_cli(*asked).out.splitlines()[2].startswith("next: sysid diagnose ")


def test_a_parent_that_is_missing_or_changed_is_said_on_stderr(run_cli, line, tmp_path):
    for name in ("truth+servo_lag.yaml", line.name):
        (tmp_path / name).write_bytes((line.parent / name).read_bytes())
    copy = tmp_path / line.name
    assert run_cli("history", copy).err == ""
    middle = line.parent / "truth+servo_lag.yaml"
    before = middle.read_bytes()
    try:
        middle.write_bytes(before + b"\n")
        (tmp_path / middle.name).unlink()
        assert "has changed since its child was made from it [parent_changed]" in run_cli("history", copy).err
        middle.unlink()
        answer = run_cli("history", copy)
        assert "is missing: the line is not known before it [parent_missing]" in answer.err
        assert "starts from servo_lag" in answer.out
    finally:
        middle.write_bytes(before)


def test_a_file_that_is_no_model_is_refused(run_cli, tmp_path):
    (tmp_path / "x.yaml").write_text("schema: fieldsid/diagnosis/1\n")
    answer = run_cli("history", tmp_path / "x.yaml")
    assert answer.code == 2
    assert "is not a fieldsid/model file" in answer.err
