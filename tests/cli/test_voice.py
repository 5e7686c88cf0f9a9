"""`--quiet` and `-v` on every command: what is said besides the result."""

from __future__ import annotations

import pytest
from cli import trial

from fieldsid.cli.console import folded
from fieldsid.cli.voice import take, voice

LONG = "run7: " + "the fin was at its limit for a long time, which says less of the authority; " * 3 + "[saturated]"


@pytest.fixture(autouse=True)
def afterwards():
    yield
    take([])


def test_a_quiet_command_gives_its_result_and_nothing_else(run_cli, tmp_path):
    run = trial.flown(tmp_path)
    loud, quiet = run_cli("live", run, "--axis", "yaw", "--speed", "0", "--state", tmp_path / "s"), None
    again = ("live", run, "--axis", "yaw", "--speed", "0", "--state", tmp_path / "s")
    assert "going on from" in run_cli(*again).err
    quiet = run_cli(*again, "--quiet")
    assert quiet.err == ""
    assert loud.out
    assert quiet.out


def test_errors_are_said_however_quiet_it_is(run_cli, tmp_path):
    answer = run_cli("identify", tmp_path / "nowhere.csv", "--axis", "yaw", "--quiet")
    assert answer.code == 2
    assert "there is no log" in answer.err


def test_a_warning_has_one_line_and_keeps_its_code():
    take(["identify"])
    assert len(folded(LONG, 80)) <= 80 - len("warning: ")
    assert folded(LONG, 80).endswith("[saturated] -v")
    assert folded("short [code]", 80) == "short [code]"


def test_with_v_it_is_whole():
    assert take(["demo", "-v"]) == ["demo", "-v"]
    assert take(["identify", "-v", "run.csv"]) == ["identify", "run.csv"]
    assert voice().is_verbose
    assert folded(LONG, 80) == LONG


def test_what_follows_two_dashes_is_no_option():
    assert take(["inspect", "--quiet", "--", "-v"]) == ["inspect", "--", "-v"]
    assert voice().is_quiet
    assert not voice().is_verbose
