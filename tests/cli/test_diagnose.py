"""`sysid diagnose`: the hidden effect is named with the contract's numbers, kept for `plan`, drawn; bad input is refused."""

from __future__ import annotations

from contextlib import chdir

import hidden_lag
import pytest
from cli import trial
from in_time import in_time

from fieldsid.effects import forget_effects
from fieldsid.logs import save_run
from fieldsid.models.axis import Axis
from fieldsid.models.model import save_model
from fieldsid.planning.discriminate.rivals import rivals_from
from fieldsid.records.reading import load_record


@pytest.fixture(scope="module")
def logs(tmp_path_factory):
    return hidden_lag.files(tmp_path_factory.mktemp("lag"))


OWN = "name: own\nmoment: '{}'\ncoefficients: {{k_own: {{unit: rad/s^2, low: 0, high: 20, start: 1.0}}}}\n"


def own_effect(folder, moment):
    """Write an effect of one's own in a folder."""
    (folder / "effects").mkdir(exist_ok=True)
    (folder / "effects" / "own.yaml").write_text(OWN.format(moment))


@pytest.fixture(scope="module")
def kept(run_shared, logs, tmp_path_factory):
    """The folder of a diagnosis and its figure, and what it is as JSON; no axis is named."""
    folder = tmp_path_factory.mktemp("kept")
    places = ("-o", folder / "d.yaml", "--figure", folder / "d.png", "--json")
    return folder, run_shared("diagnose", *logs.train, "--validate", logs.unseen, *places).json


@pytest.fixture(scope="module")
def in_words(run_shared, logs, tmp_path_factory):
    """What the same diagnosis says in words where an effect of the working folder cannot be read."""
    folder = tmp_path_factory.mktemp("words")
    own_effect(folder, "k_own * rr")
    try:
        with chdir(folder):
            return run_shared("diagnose", *logs.train, "--axis", "yaw", "--validate", logs.unseen)
    finally:
        forget_effects()


def test_the_hidden_effect_is_named_first_and_kept_and_drawn(kept):
    folder, body = kept
    assert body["schema"] == "fieldsid/diagnose/1"
    assert (body["verdict"], body["effects"]) == ("effect", ["servo_lag"])
    first = body["candidates"][0]
    assert first["effect"] == "servo_lag"
    assert first["parameters"]["lag"] == pytest.approx(hidden_lag.LAG, rel=0.1)
    assert 0.0 <= first["explained"] <= 1.0
    assert {"probability", "train", "validation", "evidence", "confusable_with"} <= set(first)
    assert body["final"]["validation"]["rate_rms_rad_s"] < 0.5 * body["base"]["validation"]["rate_rms_rad_s"]
    assert body["noise_floor"]["rate_rad_s"] == pytest.approx(hidden_lag.SENSOR, rel=0.2)
    assert {"condition", "share_of_error", "rms_ratio", "t_start_s", "t_end_s"} <= set(body["where"][0])
    assert set(body["skipped"]) >= {"roll_coupling", "prop_moment"}
    assert (folder / "d.png").read_bytes()[:4] == b"\x89PNG"
    record = load_record(folder / "d.yaml", "fieldsid/diagnosis")
    assert [len(i["sha256"]) for i in record["inputs"]] == [64] * 3
    assert rivals_from(folder / "d.yaml", ("servo_lag", "delay"))[0].effects == ("servo_lag",)


def test_the_axis_is_that_of_what_the_runs_excite(kept):
    assert kept[1]["axis"] == "yaw"


@pytest.mark.slow  # a model names its axis in test_a_model_of_the_other_axis_is_refused
def test_the_axis_is_that_of_the_model(run_cli, logs, tmp_path):
    run_cli("identify", *logs.train, "--joint", "--no-figures", "-o", tmp_path)
    body = run_cli("diagnose", *logs.train, "--model", tmp_path / "joint_yaw.yaml", "--validate", logs.unseen, "--json").json
    assert (body["axis"], body["effects"]) == ("yaw", ["servo_lag"])


def test_text_says_verdict_candidates_place_what_was_skipped_and_what_to_do(logs, in_words):
    assert in_words.code == 0
    out = in_words.out
    assert max(map(len, trial.below(out))) <= 80
    assert out.startswith("effect: servo_lag: the error on unseen runs falls from")
    assert "servo_lag: the fin follows" in out
    assert out.count("falls from") == out.count("the fin follows") == 1
    for part in ("as it is", "evidence: log", "where the model as it is fails", "not tried: ", "needs roll, which the log lacks"):
        assert part in out
    then = out.splitlines()[2]
    assert then.startswith("next: sysid identify ")
    assert then.endswith(f"--add servo_lag --validate {logs.unseen}")


def test_a_users_effect_that_cannot_be_read_takes_no_part(in_words):
    assert in_words.out.startswith("effect: servo_lag: ")
    assert "`effects/own.yaml`: there is no signal or coefficient `rr`; it takes no part\n  found: k_own * rr\n" in in_words.err


def test_a_model_of_the_other_axis_is_refused(run_cli, logs, tmp_path):
    model = save_model(trial.vehicle(Axis.PITCH), tmp_path / "pitch.yaml")
    answer = run_cli("diagnose", *logs.train, "--axis", "yaw", "--model", model)
    assert answer.code == 2
    assert "is a pitch model" in answer.err


def test_an_output_that_exists_is_refused_before_the_work(run_cli, logs, tmp_path):
    (tmp_path / "d.yaml").write_text("mine")
    answer = run_cli("diagnose", *logs.train, "--axis", "yaw", "-o", tmp_path / "d.yaml")
    assert (answer.code, answer.out) == (2, "")
    assert "add `--force`" in answer.err
    assert (tmp_path / "d.yaml").read_text() == "mine"


def test_runs_too_short_to_hold_a_part_back_are_said_to_be_judged_on_themselves(run_cli, tmp_path):
    run = hidden_lag.runs()[0][0].between(0.0, 9.0)
    path = save_run(run, tmp_path / "short.parquet")
    answer = run_cli("diagnose", path, "--axis", "yaw")
    assert answer.code == 0
    assert "[nothing_held_back]" in answer.err


def test_a_run_cannot_be_learned_from_and_judge(run_cli, logs):
    answer = run_cli("diagnose", *logs.train, "--axis", "yaw", "--validate", logs.train[0])
    assert answer.code == 2
    assert "is given twice" in answer.err


@pytest.mark.parametrize(
    "share",
    [
        pytest.param(0.0, id="constant", marks=pytest.mark.slow),
        pytest.param(1e-4, id="the servo's own step", marks=pytest.mark.slow),
        pytest.param(0.02, id="a third of a degree"),
    ],
)
@pytest.mark.parametrize("place", ["learned from", "to judge by"])
def test_a_run_whose_fin_hardly_moves_is_refused_at_once_and_named(run_cli, logs, tmp_path, share, place):
    run = hidden_lag.runs()[0][0]
    still = hidden_lag.replace(run, name="still", signals={**run.signals, "rudder_rad": share * run["rudder_rad"]})
    path = save_run(still, tmp_path / "still.parquet")
    given = (logs.train[0], path) if place == "learned from" else (logs.train[0], "--validate", path)
    with in_time(20):
        answer = run_cli("diagnose", *given, "--axis", "yaw")
    assert answer.code == (1 if place == "learned from" else 2)  # of several to learn from the others are used
    assert "`rudder_rad` of run 'still' never leaves its trim" in answer.err
    assert "hint: leave that run out, or fly an excitation: `sysid plan --axis yaw`" in answer.err
    assert "never leaves its trim" in run_cli("identify", path, "--axis", "yaw", "-o", tmp_path).err


@pytest.fixture
def own(tmp_path, monkeypatch):
    """Write the moment of an effect of one's own in the working folder."""
    monkeypatch.chdir(tmp_path)
    yield lambda moment: own_effect(tmp_path, moment)
    forget_effects()


@pytest.mark.parametrize(
    ("moment", "says"),
    [
        ("k_own / (r - r)", "divides by zero at t = 0.000 s"),
        ("k_own * exp(50 * abs(r))", "grows without bound"),
    ],
)
def test_a_users_effect_that_fails_in_flight_is_refused_with_the_place(run_cli, logs, own, moment, says):
    own(moment)
    answer = run_cli("diagnose", *logs.train, "--axis", "yaw", "--validate", logs.unseen)
    assert (answer.code, answer.out) == (2, "")
    assert says in answer.err
    assert "\nhint: " in answer.err
    assert moment in answer.err
