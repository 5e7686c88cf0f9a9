"""The tabulator key: a script for each shell, which bash itself completes commands and options with."""

from __future__ import annotations

import shutil
import subprocess

import pytest

from fieldsid.cli.help.catalogue import entries
from fieldsid.cli.help.completion import PLACES, options, script


def completed(words, folder):
    """What bash offers for the last of some words, by the script."""
    file = folder / "script"
    file.write_text(script("bash"))
    code = f"source {file}; COMP_WORDS=({' '.join(words[:-1])} '{words[-1]}'); COMP_CWORD={len(words) - 1}; _sysid; "
    return subprocess.run(
        ["bash", "-c", code + 'echo "${COMPREPLY[@]}"'], capture_output=True, text=True, check=True
    ).stdout.split()


@pytest.mark.skipif(shutil.which("bash") is None, reason="bash is not here")
def test_bash_completes_commands_options_and_subcommands(tmp_path):
    assert completed(["sysid", "ide"], tmp_path) == ["identify"]
    assert completed(["sysid", "identify", "--met"], tmp_path) == ["--method"]
    assert "verify" in completed(["sysid", "schedule", "v"], tmp_path)


def test_every_command_has_its_options():
    known = options()
    assert set(known) == set(entries())
    assert all("--json" in words for words in known.values())


@pytest.mark.parametrize("shell", PLACES)
def test_it_is_installed_where_the_shell_looks(shell, run_cli, tmp_path, monkeypatch):
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.setenv("SHELL", f"/bin/{shell}")
    answer = run_cli("--install-completion")
    assert answer.code == 0
    assert "next: " in answer.out
    assert "identify" in (tmp_path / PLACES[shell]).read_text()


def test_another_shell_is_refused(run_cli):
    answer = run_cli("--install-completion", "tcsh")
    assert answer.code == 2
    assert "no completion for the shell `tcsh`" in answer.err
