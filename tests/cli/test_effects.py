"""`sysid effects`: the catalogue as a user sees it."""

from __future__ import annotations

import pytest
from cli import trial

from fieldsid.effects import all_effects
from fieldsid.models.axis import Axis


@pytest.mark.parametrize("axis", list(Axis))
def test_list_names_every_effect_of_the_axis(run_cli, axis):
    body = run_cli("effects", "list", "--axis", axis, "--json").json
    assert body["schema"] == "fieldsid/effects/1"
    assert {e["name"] for e in body["effects"]} == set(all_effects(axis))


def test_list_as_text_names_them_all_in_eighty_columns(run_cli):
    out = run_cli("effects", "list").out
    assert all(name in out for name in all_effects())
    assert max(map(len, trial.below(out))) <= 80


@pytest.mark.parametrize("name", sorted(all_effects()))
def test_show_tells_all_that_a_user_may_ask(run_cli, name):
    out = run_cli("effects", "show", name).out
    for part in ("stage", "equation", "telltale", "excited by", "mistaken for", "log must have", "source", "coefficient"):
        assert part in out
    body = run_cli("effects", "show", name, "--json").json
    assert body["name"] == name
    assert [c["name"] for c in body["coefficients"]] == [c.name for c in all_effects()[name].coefficients]


def test_show_of_a_mistyped_name_gives_the_near_one(run_cli):
    answer = run_cli("effects", "show", "servo_lagg")
    assert answer.code == 2
    assert "did you mean `servo_lag`" in answer.err


def test_show_says_where_a_form_is_tried_and_what_it_needs(run_cli):
    out = " ".join(run_cli("effects", "show", "prop_moment").out.split())
    assert "it builds up behind the thrust (yaw)" in out
    assert "the rudder is trimmed against it (yaw, needs surge)" in out
    forms = run_cli("effects", "show", "prop_moment", "--json").json["forms"]
    assert [f["axes"] for f in forms] == [["yaw", "pitch"], ["yaw"], ["yaw"], ["yaw"]]
    assert forms[2]["needs"] == ["thrust", "surge"]
