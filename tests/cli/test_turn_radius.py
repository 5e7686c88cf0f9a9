"""`sysid turn-radius` as a user meets it: the contract's keys, speeds, refusals, figures."""

from __future__ import annotations

import pytest
from cli import trial
from cli.test_fit import table

ROW = {
    "speed_m_s",
    "side",
    "radius_m",
    "interval95",
    "steady_radius_m",
    "u_turn_radius_m",
    "u_turn_time_s",
    "yaw_rate_max_rad_s",
    "method",
    "extrapolated",
    "trust",
    "settle_with",
}


def test_json_has_the_keys_of_the_contract_for_both_sides(run_cli, tmp_path):
    body = run_cli("turn-radius", table(tmp_path), "--rudder-max", "0.26", "--json").json
    assert body["schema"] == "fieldsid/turn-radius/1"
    assert len(body["rows"]) == 10
    assert all(set(row) >= ROW for row in body["rows"])
    assert {row["side"] for row in body["rows"]} == {"port", "starboard"}


@pytest.mark.parametrize(("text", "count"), [("0.5:2.5:0.1", 21), ("1.0,1.6", 2), ("1.5", 1)])
def test_speeds_are_a_range_or_a_list(run_cli, tmp_path, text, count):
    body = run_cli("turn-radius", table(tmp_path), "--rudder-max", "0.26", "--speeds", text, "--json").json
    assert len(body["rows"]) == 2 * count


@pytest.mark.parametrize("text", ["a", "1:2", "2:1:0.1", "0,1", "1:2:0", "0.1:9:0.001"])
def test_speeds_that_cannot_be_meant_are_refused(run_cli, tmp_path, text):
    answer = run_cli("turn-radius", table(tmp_path), "--rudder-max", "0.26", "--speeds", text)
    assert answer.code == 2
    assert "--speeds" in answer.err


def test_without_a_rudder_limit_a_table_is_refused(run_cli, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    answer = run_cli("turn-radius", table(tmp_path))
    assert answer.code == 2
    assert "--fin-max 0.26" in answer.err


def test_the_vehicles_rudder_limit_is_taken(run_cli, tmp_path, monkeypatch):
    (tmp_path / "vehicle.yaml").write_text("name: pandan\nrudder_max_rad: 0.3\n")
    monkeypatch.chdir(tmp_path)
    assert run_cli("turn-radius", table(tmp_path), "--json").json["rudder_max_rad"] == 0.3


def test_text_fits_80_columns_and_says_what_would_settle_it(run_cli, tmp_path):
    answer = run_cli("turn-radius", table(tmp_path), "--rudder-max", "0.26", "-o", tmp_path / "out")
    assert answer.code == 0
    assert "what would settle it: turning_circle" in answer.out
    assert max(map(len, trial.below(answer.out))) <= 80
    assert (tmp_path / "out" / "turn_radius.png").is_file()
    assert (tmp_path / "out" / "turn_radius.yaml").read_text().startswith("schema: fieldsid/turn-radius/1")
    lines = answer.out.splitlines()
    head = next(i for i, line in enumerate(lines) if line.startswith("side "))
    rows = [line for line in lines[head + 1 :] if line.startswith(("port", "starboard"))]
    assert lines[head + 1 : head + 1 + len(rows)] == rows  # no word of a row is folded
    assert all({"measured", "identified", "extrapolated"} & set(row.split()) for row in rows)


def test_a_band_too_wide_for_a_number_is_told_as_a_band_everywhere(run_cli, tmp_path):
    asked = ("turn-radius", table(tmp_path), "--rudder-max", "0.26", "--speeds", "1.5")
    answer, body = run_cli(*asked), run_cli(*asked, "--json").json
    assert all(r["band_only"] and r["trust"] == "extrapolated" and r["radius_m"] > 0.0 for r in body["rows"])
    assert any("the band is wider than" in b for b in body["rows"][0]["because"])
    low, high = body["rows"][0]["interval95"]
    assert high - low > 0.35 * body["rows"][0]["radius_m"]
    headline, _, following = answer.out.splitlines()[:3]
    assert headline.startswith("tightest turn between ")
    assert headline.endswith("extrapolated: one and a half circles tell it")
    assert following.startswith("next: sysid schedule design ")
    rows = [line for line in answer.out.splitlines() if line.startswith(("port", "starboard"))]
    assert all("(" in row for row in rows)
    assert "radius in brackets: these runs tell the band" in answer.out


@pytest.mark.parametrize(("old", "new", "word"), [("-0.86", "0.86", "sign of b2"), ("1.11", "-1.11", "a22 <= 0")])
def test_impossible_parameters_are_refused(run_cli, tmp_path, old, new, word):
    path = table(tmp_path)
    path.write_text(path.read_text().replace(old, new))
    answer = run_cli("turn-radius", path, "--rudder-max", "0.26")
    assert answer.code == 2
    assert word in answer.err
    assert "\nhint: " in answer.err


def test_a_pitch_table_has_no_turning_radius(run_cli, tmp_path):
    answer = run_cli("turn-radius", table(tmp_path, "pitch"), "--rudder-max", "0.26")
    assert answer.code == 2
    assert "yaw axis" in answer.err
