"""The front door: help, version, exit codes, errors in three parts, and nothing heavy before it is needed."""

from __future__ import annotations

import json
import resource
import subprocess
import sys
from pathlib import Path

import pytest
from cli import trial

from fieldsid._version import __version__
from fieldsid.cli import app
from fieldsid.cli.help.catalogue import entries
from fieldsid.cli.help.command_order import COMMAND_ORDER
from fieldsid.errors import DataError

HEAVY = ("numpy", "pandas", "scipy", "numba", "matplotlib", "typer", "rich", "pyarrow", "pydantic", "rosbags")


def test_help_lists_every_command_once_in_the_order_of_the_day(run_cli):
    page = run_cli("--help")
    assert page.code == 0
    named = [line.split()[0] for line in page.out.splitlines() if line.startswith("  ") and line[2] != " "]
    placed = [n for _, names in COMMAND_ORDER for n in names if n in entries()]
    assert named == placed + [n for n in entries() if n not in placed]


def test_help_fits_eighty_columns(run_cli):
    assert [line for line in run_cli("--help").out.splitlines() if len(line) > 80] == []


@pytest.mark.parametrize("arguments", [(), ("-h",), ("help",)])
def test_other_ways_to_ask_for_help_give_the_same_page(run_cli, arguments):
    assert run_cli(*arguments).out == run_cli("--help").out


def test_help_and_version_import_nothing_heavy():
    code = (
        "import sys; from fieldsid.cli.app import main; main(['--help']); main(['--version']);"
        f"print([m for m in {HEAVY} if m in sys.modules], file=sys.stderr)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stderr.strip() == "[]"


def test_version_is_the_packages(run_cli):
    assert run_cli("--version").out == f"fieldsid {__version__}\n"


def test_python_m_fieldsid_is_the_same_program():
    done = subprocess.run([sys.executable, "-m", "fieldsid", "--version"], capture_output=True, text=True, check=True)
    assert done.stdout == f"fieldsid {__version__}\n"


def test_a_value_that_is_none_of_the_choices_is_refused_in_words_of_the_program(run_cli):
    answer = run_cli("identify", "run.csv", "--axis", "bogus")
    assert answer.code == 2
    assert answer.err.splitlines()[0] == "error: invalid value for '--axis': 'bogus' is not one of 'yaw', 'pitch'"


def test_a_reader_that_goes_away_is_no_failure():
    command = [sys.executable, "-m", "fieldsid", "effects", "list"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as program:
        program.stdout.close()  # as `| head -0` does
        said = program.stderr.read()
    assert (program.returncode, said) == (0, b"")


def test_a_mistyped_command_is_refused_with_the_near_match(run_cli):
    answer = run_cli("efects")
    assert (answer.code, answer.out) == (2, "")
    what, found, blank, hint = answer.err.splitlines()
    assert what == "error: there is no command 'efects'"
    assert found.startswith("  found: ")
    assert blank == ""
    assert hint == "hint: did you mean `effects`?"


def test_a_mistyped_option_is_refused_in_three_parts(run_cli):
    answer = run_cli("effects", "list", "--axes", "yaw")
    assert (answer.code, answer.out) == (2, "")
    assert answer.err.startswith("error: no such option: --axes")
    assert "\n  found: sysid effects list --axes yaw\n" in answer.err
    assert answer.err.splitlines()[-1].startswith("hint: did you mean `--axis")
    assert answer.err.endswith(" see `sysid effects list --help`\n")


@pytest.mark.parametrize(
    ("words", "meant"),
    [
        ("schedule export g.yaml --target ros2", "--to TARGET"),
        ("schedule export g.yaml --format=ros2", "--to TARGET"),
        ("import a.csv --out x", "--output DIR|FILE"),
        ("import a.csv --end 3", "--to S"),
        ("import a.csv --overwrite", "--force"),
        ("import a.csv --map m.yaml", "--mapping YAML"),
        ("identify a.csv --plane yaw", "--axis"),
        ("diagnose a.csv --test b.csv", "--validate RUN"),
        ("turn-radius m.yaml --max-rudder 0.3", "--fin-max ANGLE"),
        ("turn-radius m.yaml --spedes 1", "--speeds LIST"),
    ],
)
def test_an_option_in_other_words_is_led_to_ours(run_cli, words, meant):
    answer = run_cli(*words.split())
    assert answer.code == 2
    assert answer.err.splitlines()[-1].startswith(f"hint: did you mean `{meant}")
    assert "Possible options" not in answer.err


def test_an_option_that_is_like_none_is_only_shown_the_help(run_cli):
    answer = run_cli("import", "a.csv", "--xyzzy", "1")
    assert answer.err.splitlines()[-1] == "hint: see `sysid import --help`"


def test_an_interrupted_command_raises_in_the_command_that_runs_it_and_ends_with_130(run_cli, monkeypatch):
    def interrupted(_topic):
        raise KeyboardInterrupt

    monkeypatch.setattr("fieldsid.guide.pick_page", interrupted)
    with pytest.raises(KeyboardInterrupt):
        app.run(["guide"])
    answer = run_cli("guide")
    assert (answer.code, answer.out, answer.err.strip()) == (130, "", "interrupted")


def test_what_is_missing_is_shown_by_the_example_of_the_command(run_cli, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    answer = run_cli("schedule", "verify")
    assert answer.code == 2
    assert answer.err.startswith("error: missing argument 'SCHEDULE'\n")
    example = "`sysid schedule verify gains.yaml --require-phase-margin 40 -o gains.png`"
    assert answer.err.endswith(f"\nhint: {example}, or see `sysid schedule verify --help`\n")


def test_a_missing_option_is_one_line_with_what_it_takes(run_cli, tmp_path):
    answer = run_cli("batch", tmp_path / "log.csv")
    assert answer.code == 2
    assert answer.err.startswith("error: missing option '--axis'. Choose from: yaw, pitch\n")


@pytest.mark.parametrize("name", sorted(entries()))
def test_every_command_explains_itself_and_has_a_module_of_its_name(run_cli, name):
    answer = run_cli(name, "--help")
    assert answer.code == 0
    assert answer.out.startswith(f"Usage: sysid {name}")
    assert entries()[name].summary
    stem = entries()[name].module.rsplit(".", 1)[-1]
    assert stem.rstrip("_").replace("_", "-") == name


class Broken:
    """A stand-in for the dispatcher that raises what a command would."""

    def __init__(self, error):
        self.error = error

    def __call__(self, _arguments):
        raise self.error


def test_an_error_of_ours_is_two_and_has_no_trace(run_cli, monkeypatch):
    monkeypatch.setattr(app, "_dispatch", Broken(DataError("too short: 3 s", found="60 samples", hint="record 20 s")))
    answer = run_cli("identify")
    assert answer.code == 2
    assert answer.err == "error: too short: 3 s\n  found: 60 samples\n\nhint: record 20 s\n"


def test_a_bug_is_three_and_says_where_the_trace_is(run_cli, monkeypatch, tmp_path):
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    monkeypatch.setattr(app, "_dispatch", Broken(ZeroDivisionError("division by zero")))
    answer = run_cli("identify", "run7.csv")
    trace = next(tmp_path.glob("fieldsid-trace-*.txt"))
    assert answer.code == 3
    assert str(trace) in answer.err
    assert "Traceback" not in answer.err
    assert "Traceback" in trace.read_text()
    assert "sysid identify run7.csv" in trace.read_text()


def test_an_interrupt_is_130(run_cli, monkeypatch):
    monkeypatch.setattr(app, "_dispatch", Broken(KeyboardInterrupt()))
    assert run_cli("identify").code == 130


def test_an_interrupt_inside_a_command_says_so(run_cli, monkeypatch, tmp_path):
    monkeypatch.setattr("fieldsid.extension.lineage.history_of", Broken(KeyboardInterrupt()))
    answer = run_cli("history", trial.model_file(tmp_path))
    assert (answer.code, answer.err) == (130, "interrupted\n")


def test_a_reader_that_goes_away_is_no_error():
    command = f"{sys.executable} -m fieldsid effects list --json | head -c 1"
    done = subprocess.run(["bash", "-o", "pipefail", "-c", command], capture_output=True, text=True, check=False)
    assert done.stderr == ""


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full")
def test_a_full_disk_is_no_bug():
    with Path("/dev/full").open("w") as full:
        command = [sys.executable, "-m", "fieldsid", "effects", "list", "--json"]
        done = subprocess.run(command, stdout=full, stderr=subprocess.PIPE, text=True, check=False)
    assert done.returncode == 2
    assert done.stderr.startswith("error: there is no room left to write\n  found: standard output")


@pytest.mark.parametrize(("words", "code"), [("'--version'", 0), ("'efects'", 2)])
def test_the_end_comes_at_once_but_after_all_that_is_registered_for_it(words, code):
    program = (
        "import atexit, sys; from fieldsid.cli import app\n"
        f"sys.argv = ['sysid', {words}]; real = app.main\n"
        "def main():\n"
        "    atexit.register(lambda: print('registered', end=''))\n"
        "    return real()\n"
        "app.main = main\n"
        "class Late:\n"
        "    def __del__(self): print('given back piece by piece')\n"
        "late = Late()\n"
        "app.entry()\n"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert done.returncode == code
    assert done.stdout.endswith("registered")


def test_a_file_becomes_a_command_by_its_first_line(tmp_path: Path):
    (tmp_path / "dance.py").write_text('"""sysid dance: turn around."""\n')
    (tmp_path / "helper.py").write_text('"""Helps."""\n')
    assert {n: e.summary for n, e in entries(str(tmp_path)).items()} == {"dance": "turn around"}


def fastest(*arguments: str) -> float:
    """Least CPU time in s of several runs, so that a busy machine does not count."""
    times = []
    for _ in range(7):
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        subprocess.run([sys.executable, *arguments], capture_output=True, check=True)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        times.append(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)
    return min(times)


def test_help_answers_in_less_than_six_times_a_bare_python():
    assert fastest("-m", "fieldsid", "--help") < 6 * fastest("-c", "pass")


def test_an_error_under_json_is_an_object_on_stdout(run_cli, tmp_path):
    answer = run_cli("identify", tmp_path / "nowhere.csv", "--axis", "yaw", "--json")
    assert answer.code == 2
    body = json.loads(answer.out)
    assert body["schema"] == "fieldsid/error/1"
    assert body["exit_code"] == 2
    assert "there is no log" in body["what"]
    assert "there is no log" in answer.err
