"""`sysid plan` as a user types it: what is printed, what is written, and what is refused."""

from __future__ import annotations

import json

import pytest

from fieldsid.planning.plan_file import load_plan

QUICK = ("plan", "--speeds", "1.4", "--window", "22")


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    from fieldsid.cli.app import main

    folder = tmp_path_factory.mktemp("plan")
    assert main([*QUICK, "--area", "200x60", "--want", "a22=10%", "-o", str(folder / "p")]) == 0
    return folder / "p"


def test_a_plan_is_printed_with_errors_minutes_metres_and_risk(run_cli):
    answer = run_cli(*QUICK)
    assert answer.code == 0, answer.err
    for word in ("a22", "b2", "C0", "minutes", "risk", "m;", "pulses need"):
        assert word in answer.out
    assert "-o DIR" in answer.err


def test_json_is_one_object_with_every_parameters_expected_error(run_cli):
    body = run_cli(*QUICK, "--json").json
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


def test_rivals_are_told_apart_with_odds(run_cli):
    body = run_cli("plan", "--separate", "deadband,stall", "--json").json
    assert body["separation"]["decides"] is True
    assert set(body["separation"]["pairs"]) == {"deadband>stall", "stall>deadband"}
    assert "tells them apart" in body["says"][0]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--want", "a22=0.02%"), "--want a22="),
        (("--want", "a22=2%", "--minutes", "0.5"), "--minutes"),
        (("--want", "a22=0.4%", "--minutes", "3"), "--want a22="),
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
        (("--axis", "pitch", "--radius"), "--axis yaw"),
        (("--separate", "delay"), "delay,servo_lag"),
        (("--separate", "delay,lag"), "servo_lag"),
        (("--radius", "--area", "100x15"), "--area"),
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


def test_an_unstable_prior_is_refused(run_cli, tmp_path):
    from fieldsid.templates import template_path

    prior = tmp_path / "prior.yaml"
    prior.write_text(template_path("plan/priors/torpedo_yaw.yaml").read_text().replace("value: 1.1", "value: -0.2"))
    answer = run_cli(*QUICK, "--model", prior)
    assert answer.code == 2
    assert "unstable" in answer.err


def test_the_same_seed_gives_the_same_plan(run_cli):
    one, two = (run_cli(*QUICK, "--json", "--seed", "5").out for _ in range(2))
    assert json.loads(one) == json.loads(two)


def test_without_rules_every_leg_can_be_replayed_from_its_table(run_cli):
    body = run_cli("plan", "--axis", "pitch", "--speeds", "1.6", "--window", "22", "--open-loop", "--json").json
    assert body["legs"][0]["maneuver"] not in {"zigzag", "turning_circle"}
    assert "expected_fin_rad" not in body["legs"][0]
