"""What lies in a working folder from somebody else configures no library and runs no code; streams and folder that are gone."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from contextlib import chdir
from importlib.metadata import packages_distributions
from pathlib import Path

import pytest
from cli import trial

from fieldsid.cli.app import main
from fieldsid.errors import ArtifactError
from fieldsid.logs.wrong_file import unless_log

PROGRAM = [sys.executable, "-m", "fieldsid"]
SHELL = f"{sys.executable} -m fieldsid"
LONGEST_S = 240
"""Wall time of a command, whatever else the machine does."""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    trial.flown(tmp_path)
    trial.model_file(tmp_path)
    return tmp_path


def started(*words, env=None, **given):
    """A command in a process of its own, which reads the folder as a user's does."""
    environment = {k: v for k, v in (os.environ | (env or {})).items() if v is not None}
    return subprocess.run(
        [*PROGRAM, *map(str, words)], capture_output=True, text=True, timeout=LONGEST_S, env=environment, check=False, **given
    )


def says_that_it_ran(folder):
    """A line of Python that leaves a file behind."""
    return f"open({str(folder / 'RAN')!r}, 'w').close()\n"


PYTHONS_OWN = {
    "collections", "contextlib", "functools", "importlib", "keyword", "operator", "reprlib", "traceback", "types", "warnings",
}  # fmt: skip
"""What Python 3.11 to 3.14 itself may look for in the working folder before a package begins that `python -m` runs."""


def test_no_module_of_the_folder_is_imported(folder):
    names = {*sys.stdlib_module_names, *packages_distributions(), "fieldsid_more"} - PYTHONS_OWN - {"fieldsid"}
    for name in names:
        (folder / f"{name}.py").write_text(f"open({str(folder / 'RAN')!r}, 'a').write({name!r})\n")
    done = started("identify", "run7.parquet", "--axis", "yaw")
    assert not (folder / "RAN").exists()
    assert (done.returncode, "error" in done.stderr) == (0, False)


def test_no_module_of_the_folder_is_imported_by_the_processes_of_a_batch(folder):
    for name in ("json", "numpy", "fieldsid", "runpy", "importlib"):
        (folder / f"{name}.py").write_text(says_that_it_ran(folder))
    assert main(["batch", "run7.parquet", "--axis", "yaw", "-o", "b", "--no-diagnose", "--workers", "1"]) == 0
    assert not (folder / "RAN").exists()


@pytest.mark.parametrize("effect", ["tether", "__init__"])
def test_python_among_the_effects_is_never_run(folder, run_cli, effect):
    (folder / "effects").mkdir()
    (folder / "effects" / f"{effect}.py").write_text(says_that_it_ran(folder))
    (folder / "effects" / "own.yaml").write_text(
        'name: own\nsays: a pull\naxes: [yaw]\nmoment: "k_own * rate"\n'
        "coefficients: {k_own: {unit: 1/s, low: -2, high: 2, start: 0.1}}\n"
    )
    for words in (
        ["effects", "list"],
        ["effects", "show", effect],
        ["identify", "run7.parquet", "--axis", "yaw", "--effects", "own"],
    ):
        run_cli(*words)
    assert not (folder / "RAN").exists()


def test_numba_takes_no_settings_from_the_folder(folder):
    (folder / ".numba_config.yaml").write_text("cache_dir: kept\ndisable_jit: 1\n")
    own = folder / "home"
    words = ("simulate", "truth.yaml", "--maneuver", "zigzag", "-o", "zigzag.csv")  # little of it is to be compiled
    done = started(*words, env={"NUMBA_CACHE_DIR": None, "XDG_CACHE_HOME": str(own)})
    assert (done.returncode, "numba" in done.stderr.lower()) == (0, False)
    assert not (folder / "kept").exists()
    assert list((own / "fieldsid" / "numba").rglob("*.nbi"))


def test_the_users_own_word_for_where_compiled_code_is_kept_holds(folder):
    own = folder / "mine"
    program = "from fieldsid.dynamics.linear_kernel import linear_motion; print(linear_motion.stats.cache_path)"
    for given, place in (
        ({"NUMBA_CACHE_DIR": str(own)}, own),
        ({"NUMBA_CACHE_DIR": "", "XDG_CACHE_HOME": str(own)}, own / "fieldsid" / "numba"),
    ):
        done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, env=os.environ | given, check=True)
        assert done.stdout.startswith(f"{place}{os.sep}dynamics_")


@pytest.mark.parametrize("home", ["", "relative"])
def test_a_cache_folder_is_none_of_the_working_folder(folder, monkeypatch, home):
    from fieldsid.numerics.jit import cache_folder

    monkeypatch.setenv("XDG_CACHE_HOME", home)
    monkeypatch.setenv("HOME", "not/a/home")
    monkeypatch.delenv("LOCALAPPDATA", raising=False)
    assert cache_folder() == ""


@pytest.fixture(scope="module")
def plain(tmp_path_factory):
    """The figures that are drawn of the folder's run where there are no settings."""
    place = tmp_path_factory.mktemp("plain")
    trial.flown(place)
    with chdir(place):
        assert main(["identify", "run7.parquet", "--axis", "yaw", "-o", "drawn"]) == 0
    return {p.name: p.read_bytes() for p in (place / "drawn").glob("*.png")}


@pytest.mark.parametrize("settings", ["text.usetex: True\n", pytest.param("\xff", marks=pytest.mark.slow)])
def test_matplotlib_takes_no_settings_from_the_folder(folder, plain, settings):
    (folder / "matplotlibrc").write_bytes(settings.encode("latin-1"))
    done = started("identify", "run7.parquet", "--axis", "yaw", "-o", "drawn")
    assert (done.returncode, "matplotlibrc" in done.stderr) == (0, False)
    assert plain
    assert plain == {p.name: p.read_bytes() for p in (folder / "drawn").glob("*.png")}


def test_what_draws_is_new_enough_to_run_nothing_in_its_settings():
    """From 3.11 on, matplotlib reads its settings without evaluating them: a library user's own file in a notebook's folder."""
    import matplotlib as mpl

    assert tuple(map(int, mpl.__version__.split(".")[:2])) >= (3, 11)


@pytest.mark.parametrize(
    "words",
    [
        ["compare", "nosuch.yaml", "run7.parquet"],
        *(pytest.param(w, marks=pytest.mark.slow) for w in (["history", "nothere.yaml"], ["schedule", "export", "bad.yaml"])),
    ],
)
def test_a_mistyped_file_beside_a_refused_effect_ends_at_once(folder, words):
    (folder / "effects").mkdir()
    (folder / "effects" / "tether.yaml").write_text("name: tether\nmoment: 5\ncoefficients: {}\n")
    (folder / "bad.yaml").write_text("a: b: c\n")
    done = started(*words)
    assert done.returncode == 2
    assert done.stderr.count("error: ") == 1
    assert "warning: `effects/tether.yaml`: " in done.stderr
    assert done.stderr.count("; it takes no part\n") == 1


def test_a_file_that_cannot_be_read_is_no_cause_of_itself(tmp_path):
    with pytest.raises(ArtifactError) as raised, unless_log(tmp_path / "none.yaml", "a model"):
        raise ArtifactError("cannot be read")
    assert raised.value.__cause__ is None


def test_errors_raised_from_one_another_are_told_once(run_cli, monkeypatch):
    one, other = ArtifactError("one"), ArtifactError("other")
    one.__cause__, other.__cause__ = other, one

    def broken(_topic):
        raise one

    monkeypatch.setattr("fieldsid.guide.pick_page", broken)
    monkeypatch.setattr("fieldsid.registry.refused", lambda: (other, ArtifactError("third")))
    answer = run_cli("guide", "limits")
    assert (answer.code, answer.err) == (2, "error: one\nwarning: third; it takes no part\n")


@pytest.mark.skipif(shutil.which("bash") is None, reason="needs a shell")
@pytest.mark.parametrize(
    ("line", "code", "said"),
    [
        ("effects list >&-", 2, "error: standard output is closed\n"),
        ("effects list 2>&-", 0, ""),
        ("effects list <&-", 0, ""),
        ("effects show nothing 2>&-", 2, ""),
        ("effects list <&- >&- 2>&-", 2, ""),
        pytest.param("effects list --json <&- >&-", 2, "error: standard output is closed\n", marks=pytest.mark.slow),
        pytest.param("effects show nothing 2>/dev/full", 2, "", marks=pytest.mark.slow),
        pytest.param("identify nothing.csv --axis yaw 2>&- >&-", 2, "", marks=pytest.mark.slow),
        pytest.param("--version 2>&-", 0, "", marks=pytest.mark.slow),
    ],
)
def test_a_closed_stream_is_said_or_changes_no_exit_code(folder, line, code, said):
    done = subprocess.run(["bash", "-c", f"{SHELL} {line}"], capture_output=True, text=True, timeout=LONGEST_S, check=False)
    assert done.returncode == code
    assert done.stderr.startswith(said) if said else done.stderr == ""


def test_a_command_whose_messages_nobody_gets_does_its_work(folder):
    line = f"{SHELL} identify run7.parquet --axis yaw -o m --no-figures 2>&-"
    done = subprocess.run(["bash", "-c", line], stdout=subprocess.PIPE, text=True, timeout=LONGEST_S, check=False)
    assert (done.returncode, [p.name for p in Path("m").iterdir()]) == (0, ["run7_yaw.yaml"])


@pytest.mark.skipif(not Path("/proc/self/cwd").exists(), reason="a folder in use can be deleted on Linux")
@pytest.mark.parametrize(
    "words", ["status", *(pytest.param(w, marks=pytest.mark.slow) for w in ("identify x.csv --axis yaw", "init new"))]
)
def test_a_working_folder_that_is_gone_is_said(folder, words):
    line = f"mkdir gone && cd gone && rmdir ../gone && {SHELL}"
    done = subprocess.run(["bash", "-c", f"{line} {words}"], capture_output=True, text=True, timeout=LONGEST_S, check=False)
    assert done.returncode == 2
    assert done.stderr.startswith("error: the working folder is no longer there\n  found: ")
    assert "gone\n\nhint: `cd` to one that is\n" in done.stderr
    helped = subprocess.run(["bash", "-c", f"{line} --version"], capture_output=True, text=True, timeout=LONGEST_S, check=False)
    assert helped.returncode == 0
