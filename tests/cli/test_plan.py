"""`sysid plan` as a user types it: what is printed, what is written, and what is refused."""

from __future__ import annotations

import json
from contextlib import redirect_stdout
from io import StringIO

import numpy as np
import pytest
from moos_helm import script

from fieldsid.cli.app import main
from fieldsid.planning import request
from fieldsid.planning.design.leg import error_in_words
from fieldsid.planning.output.plan_file import load_plan
from fieldsid.rounding import number
from fieldsid.templates import template_path

QUICK = ("plan", "--speeds", "1.4", "--window", "22")


def said(*more):
    """What a plan that is made says on standard output."""
    out = StringIO()
    with redirect_stdout(out):
        assert main([*QUICK, *more]) == 0
    return out.getvalue()


@pytest.fixture(scope="module")
def limited(tmp_path_factory):
    """A plan inside many limits: its folder, and what is said of it in one line."""
    folder = tmp_path_factory.mktemp("plan") / "p"
    limits = ("--area", "200x60", "--max-roll", "20deg", "--depth-band", "2:6")
    return folder, " ".join(said(*limits, "--want", "a22=10%", "-o", str(folder)).split())


@pytest.fixture(scope="module")
def written(limited):
    return limited[0]


@pytest.fixture(scope="module")
def told():
    """What is said of one plan in words and as JSON; it is searched for once."""
    search, found = request.make_plan, []

    def make_plan(*asked):
        found[:] = found or [search(*asked)]
        return found[0]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(request, "make_plan", make_plan)
        return said(), json.loads(said("--json"))


@pytest.fixture(scope="module")
def printed(told):
    return told[0]


@pytest.fixture(scope="module")
def as_json(told):
    return told[1]


def test_a_plan_is_printed_with_errors_minutes_metres_and_risk(printed):
    for word in ("a22", "b2", "C0", "minutes", "risk", "m;", "pulses need"):
        assert word in printed
    assert "next: sysid plan" in printed
    assert "-o " in printed
    said = " ".join(printed.split())
    assert "errors as of a log at 20 Hz, the rate of the commands, with the noise believed: " in said


def rows_of(printed):
    return {line.split()[1]: line for line in printed.splitlines() if line.startswith("1.40")}


def test_the_error_of_a_trim_that_may_be_zero_is_no_share_of_it(printed, written):
    rows = rows_of(printed)
    assert rows["a22"].count(" %") == rows["b2"].count(" %") == 2
    assert "%" not in rows["C0"]
    assert rows["C0"].count("+/-") == 3
    plan = load_plan(written / "plan.yaml")
    e = plan.legs[0].expected["C0"]
    assert error_in_words(e.value, e.std_error, e.relative) == f"+/- {number(e.std_error, 2)}"


@pytest.mark.parametrize(
    ("value", "std_error", "scale", "said"),
    [(2.0, 0.1, 2.0, "5.0 %"), (-2.0, 0.1, 2.0, "5.0 %"), (0.0, 0.0024, 0.23, "+/- 0.0024"), (0.02, 0.0024, 0.23, "+/- 0.0024"),
     (0.1, 0.08, 0.1, "+/- 0.080")],
)  # fmt: skip
def test_an_error_is_a_share_only_of_a_value_that_is_not_zero(value, std_error, scale, said):
    assert error_in_words(value, std_error, std_error / scale) == said


def test_json_is_one_object_with_every_parameters_expected_error(as_json):
    body = as_json
    assert body["schema"] == "fieldsid/plan/1"
    leg = body["legs"][0]
    assert set(leg["expected"]) == {"a22", "b2", "C0"}
    assert all(leg["expected"][n]["std_error"] > 0 for n in leg["expected"])
    assert body["minutes"] > 0
    assert body["metres"] > 0
    assert 0 <= body["break_probability"] <= 0.05
    assert {"signal", "kind", "limit", "unit", "says"} == set(leg["abort"][0])


def test_everything_is_written_and_the_plan_reads_back(written):
    names = {p.name.split("_", 3)[-1] if p.name.startswith("leg") else p.name for p in written.iterdir()}
    assert {"plan.yaml", "plan.png"} <= names
    for end in (".csv", "_bag", "dune.ini", "ardupilot.lua", "moos_timer_script.moos", "moos_oparea.bhv"):
        assert any(n.endswith(end) for n in names), end
    assert (written / "plan.png").stat().st_size > 20_000
    plan = load_plan(written / "plan.yaml")
    assert plan.want == {"a22": pytest.approx(0.1)}
    assert plan.legs[0].expected["a22"].relative <= 0.1


def test_a_second_plan_does_not_replace_the_first_without_force(run_cli, written):
    before = (written / "plan.yaml").read_bytes()
    answer = run_cli(*QUICK, "-o", written)
    assert answer.code == 2
    assert "--force" in answer.err
    assert (written / "plan.yaml").read_bytes() == before


@pytest.mark.slow
def test_rivals_are_told_apart_with_odds(run_cli):
    assert "tells deadband and stall apart at odds of" in run_cli("plan", "--separate", "deadband,stall").out.splitlines()[0]
    body = run_cli("plan", "--separate", "deadband,stall", "--json").json
    assert body["separation"]["decides"] is True
    assert set(body["separation"]["pairs"]) == {"deadband>stall", "stall>deadband"}
    assert "tells them apart" in body["says"][0]


@pytest.mark.slow
def test_rivals_get_a_leg_at_every_speed_inside_the_default_limits_and_circles_where_asked(run_cli):
    body = run_cli("plan", "--separate", "servo_lag,delay", "--speeds", "1.0,1.4", "--window", "22", "--radius", "--json").json
    assert [leg["speed_m_s"] for leg in body["legs"]] == [1.0, 1.4, 1.0, 1.0, 1.4, 1.4]
    assert [leg["purpose"] for leg in body["legs"]].count("turn radius") == 4
    assert body["envelope"]["heading"] == pytest.approx(np.radians(60.0))
    for leg, found in zip(body["legs"], body["separations"], strict=False):
        assert leg["excursions"]["heading"] < np.radians(66.0)
        assert leg["parameters"] == found["parameters"]  # the odds are those of what is flown
        assert {"signal": "yaw_rad", "kind": "deviation"}.items() <= next(a for a in leg["abort"] if "yaw" in a["signal"]).items()


@pytest.mark.slow
@pytest.mark.parametrize(("axis", "more"), [("yaw", ("--radius",)), ("pitch", ("--depth-band", "1:8"))])
def test_every_leg_is_written_as_fins_in_every_format_rules_and_circles_too(run_cli, tmp_path, axis, more):
    body = run_cli(*QUICK, "--axis", axis, *more, "--course", "30deg", "-o", tmp_path / "p", "--json").json
    for i, leg in enumerate(body["legs"], 1):
        assert leg.get("replay_break_probability") is None or leg["replay_break_probability"] <= 0.05
        events, _ = script(next((tmp_path / "p").glob(f"leg{i:02d}*timer_script.moos")).read_text())
        assert max(abs(float(v)) for _, n, v in events if n.startswith("DESIRED")) > 5.0
        assert next((tmp_path / "p").glob(f"leg{i:02d}*dune.ini")).read_text().count(",") > 10
        assert ", false }" in next((tmp_path / "p").glob(f"leg{i:02d}*ardupilot.lua")).read_text()


def test_what_a_maneuver_does_not_show_is_no_number(run_cli):
    out = run_cli(*QUICK, "--separate", "current,trim_drift", "--max-heading", "none").out
    assert "inf" not in out
    assert "nan" not in out
    assert "heading NOT LIMITED" in " ".join(out.split())


def test_every_limit_is_printed_and_what_has_none_is_named(limited):
    _, out = limited
    for words in ("fin 14.9 deg (0.26 rad), trim included", "fin rate NOT LIMITED", "heading 60 deg (1.05 rad)",
                  "track NOT LIMITED", "pitch NOT LIMITED", "roll 20 deg (0.349 rad)", "depth 2 to 6 m",
                  "area 200 m along, 30 m to either side", "only to be watched in flight: depth"):  # fmt: skip
        assert words in out, words


@pytest.mark.slow
def test_the_limits_of_circles_are_their_own(run_cli):
    circles = " ".join(run_cli(*QUICK, "--radius").out.split())
    assert "turning_circle at 1.4 m/s: heading 1440 deg (25.1 rad)" in circles


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--want", "a22=0.02%"), "--want a22="),
        pytest.param(("--want", "a22=2%", "--minutes", "0.5"), "--minutes", marks=pytest.mark.slow),
        pytest.param(("--want", "a22=0.4%", "--minutes", "3"), "--want a22=", marks=pytest.mark.slow),
        (("--want", "d2=5%"), "b2"),
        (("--area", "20x10"), "--area"),
        (("--area", "wide"), "200x60"),
        (("--max-heading", "0"), "above zero"),
        (("--fin-max", "0"), "above zero"),
        (("--fin-max", "20"), "20deg"),
        (("--max-roll", "30"), "30deg"),
        (("--speeds", "140"), "m/s"),
        (("--speeds", "fast"), "not a number"),
        (("--prior", "submarine"), "torpedo"),
        (("--window", "7"), "--window"),
        (("--rate", "0"), "--rate"),
        (("--max-heading", "0.1deg"), "widen"),
        (("--max-heading", "60"), "60 deg is 1.047 rad, 60 rad is 3438 deg"),
        (("--max-heading", "400deg"), "at most `--max-heading 360deg`, or write `--max-heading none` to let circles in"),
        (("--radius", "--max-heading", "90deg"), "--max-heading"),
        (("--radius", "--open-loop"), "--open-loop"),
        pytest.param(("--radius", "--max-track", "5"), "--max-track", marks=pytest.mark.slow),
        (("--model", "a.yaml", "--prior", "torpedo"), "give one"),
        (("--separate", "delay,servo_lag", "--want", "a22=5%"), "--want"),
        (("--separate", "delay,servo_lag", "--minutes", "0.5"), "--minutes"),
        (("--from", "a.yaml", "--prior", "torpedo"), "leave the latter out"),
        (("--write", "csv"), "-o DIR"),
        (("--write", "cvs", "-o", "/dev/null/new"), "csv"),
        (("--axis", "pitch", "--radius"), "--axis yaw"),
        (("--separate", "delay"), "delay,servo_lag"),
        (("--separate", "delay+servo_lag"), "delay,servo_lag"),
        (("--separate", "delay,lag"), "servo_lag"),
        pytest.param(("--radius", "--area", "100x15"), "--area", marks=pytest.mark.slow),
    ],
)
def test_what_cannot_be_done_is_refused_with_what_would_be_possible(run_cli, arguments, words):
    answer = run_cli(*QUICK, *arguments)
    assert answer.code == 2
    assert answer.out == ""
    assert answer.err.startswith("error: ")
    assert "  found: " in answer.err
    assert "hint: " in answer.err
    assert words in answer.err


def test_the_vehicles_own_limits_and_signs_are_kept(run_cli, tmp_path):
    vehicle = tmp_path / "vehicle.yaml"
    vehicle.write_text("name: pandan\nrudder_max_rad: 0.2\nfin_rate_rad_s: 0.8\npositive_rudder: starboard\nspeed_max_m_s: 2.0\n")
    body = run_cli(*QUICK, "--vehicle", vehicle, "--json").json
    assert body["vehicle"] == "pandan"
    assert body["envelope"]["fin"] == 0.2
    assert body["envelope"]["fin_rate"] == 0.8
    assert body["legs"][0]["expected"]["b2"]["value"] > 0
    refused = run_cli(*QUICK, "--vehicle", vehicle, "--fin-max", "0.3")
    assert refused.code == 2
    assert "0.2" in refused.err
    assert run_cli("plan", "--speeds", "3", "--vehicle", vehicle).code == 2


PITCH = template_path("plan/priors/torpedo_pitch.yaml")


def test_a_model_of_the_other_axis_is_refused_in_every_mode(run_cli):
    for more in ((), ("--separate", "delay,servo_lag")):
        answer = run_cli(*QUICK, "--model", PITCH, "--axis", "yaw", *more)
        assert answer.code == 2
        assert "pitch" in answer.err


def test_an_unstable_prior_is_refused(run_cli, tmp_path):
    prior = tmp_path / "prior.yaml"
    prior.write_text(template_path("plan/priors/torpedo_yaw.yaml").read_text().replace("value: 1.1", "value: -0.2"))
    answer = run_cli(*QUICK, "--model", prior)
    assert answer.code == 2
    assert "unstable" in answer.err


def test_a_plan_is_the_same_as_text_and_as_json(printed, as_json):
    rows = rows_of(printed)
    for name, e in as_json["legs"][0]["expected"].items():
        assert error_in_words(e["value"], e["std_error"], e["relative"]) in rows[name]


@pytest.mark.slow
def test_the_same_seed_gives_the_same_plan_to_the_last_digit():
    assert said("--json", "--seed", "5") == said("--json", "--seed", "5")


def test_on_the_axis_of_its_model_and_without_rules_every_leg_can_be_replayed_from_its_table(run_cli):
    body = run_cli(*QUICK, "--model", PITCH, "--open-loop", "--json").json
    assert body["axis"] == "pitch"
    assert body["envelope"]["pitch"] == pytest.approx(np.radians(30.0))
    assert body["legs"][0]["maneuver"] not in {"zigzag", "turning_circle"}
    assert "expected_fin_rad" not in body["legs"][0]
