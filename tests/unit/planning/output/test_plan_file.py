"""A plan as data: it reads back as it was, and whatever a file says, no command ever leaves the limits."""

from __future__ import annotations

import json
from copy import deepcopy

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from plan_legs import ENVELOPE, leg, plan
from ruamel.yaml import YAML

from fieldsid.artifacts import plain, to_yaml
from fieldsid.errors import FieldsidError
from fieldsid.logs.run import Run
from fieldsid.planning.design.leg import aborts_of, commands_of
from fieldsid.planning.output.command_files import formats, table_text, write_all
from fieldsid.planning.output.mission import render, steps_of, styles
from fieldsid.planning.output.plan_file import load_plan, save_plan


def test_a_plan_reads_back_as_it_was(tmp_path):
    made = plan()
    again = load_plan(save_plan(made, tmp_path / "plan.yaml"))
    assert again.envelope == made.envelope
    assert again.want == made.want
    for one, two in zip(made.legs, again.legs, strict=True):
        assert two.candidate == one.candidate
        assert two.window == one.window
        assert two.expected == one.expected
        assert two.heading == one.heading
        assert two.replay_risk == pytest.approx(one.replay_risk, nan_ok=True)
        for a, b in zip(commands_of(one, made.envelope), commands_of(two, again.envelope), strict=True):
            np.testing.assert_allclose(a, b, atol=1e-5)


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    """What the file of a plan holds."""
    return YAML(typ="safe").load(save_plan(plan(), tmp_path_factory.mktemp("plan") / "plan.yaml").read_text())


@pytest.mark.parametrize(
    ("path", "value"),
    [
        (("legs", 0, "parameters", "amplitude"), 0.5), (("legs", 0, "parameters", "amplitude"), float("inf")),
        (("legs", 0, "maneuver"), "loop"), (("legs", 0, "speed_m_s"), 0), (("legs", 0, "speed_m_s"), 400),
        (("legs", 0, "window", "length_s"), 20), (("legs", 0, "window", "length_s"), 1e9), (("legs", 0, "rate_hz"), 0),
        (("legs", 0, "passes"), 10_000), (("envelope", "fin"), 3.0), (("envelope", "fin"), 0), (("envelope", "heading"), "wide"),
        (("axis",), "roll"), (("legs",), []), (("legs",), "none"), (("legs", 0, "parameters", "widht"), 2.0),
        (("legs", 1, "expected_fin_rad"), ["a"]), (("schema",), "fieldsid/model/1"), (("schema",), "fieldsid/plan/2"),
        (("legs", 0, "run_up_s"), 3601.0),
        (("legs", 0, "turn_s"), 3601.0),
        (("legs", 0, "rate_hz"), 1001.0),
    ],
)  # fmt: skip
def test_a_plan_that_was_tampered_with_is_refused_in_three_parts(tmp_path, written, path, value):
    file, body = tmp_path / "plan.yaml", deepcopy(written)
    place = body
    for key in path[:-1]:
        place = place[key]
    place[path[-1]] = value
    with file.open("w") as stream:
        YAML().dump(body, stream)
    with pytest.raises(FieldsidError) as caught:
        load_plan(file)
    assert caught.value.what
    assert caught.value.hint


NUMBERS = st.one_of(st.floats(allow_nan=True, allow_infinity=True), st.integers(-(10**6), 10**6), st.text(max_size=4), st.none())


@settings(max_examples=12, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_whatever_a_file_says_the_commands_stay_inside_the_limits_it_was_accepted_with(tmp_path, data):
    body = plain(plan(leg(), leg("zigzag:duration=26", nominal=np.linspace(-0.2, 0.2, 30)), leg("chirp:duration=26")))
    body["schema"] = "fieldsid/plan/1"
    for _ in range(data.draw(st.integers(1, 3))):
        place, key = body["legs"][data.draw(st.integers(0, 2))], None
        for _ in range(3):
            key = data.draw(st.sampled_from(sorted(place)))
            if not isinstance(place[key], dict) or not place[key]:
                break
            place = place[key]
        if not isinstance(place[key], dict):
            place[key] = data.draw(NUMBERS)
    if data.draw(st.booleans()):
        body["envelope"]["fin"] = data.draw(st.floats(-1, 2))
    (tmp_path / "mutated.yaml").write_text(to_yaml(body))
    try:
        loaded = load_plan(tmp_path / "mutated.yaml")
    except FieldsidError:
        return
    assert loaded.envelope.fin <= 0.7
    for one in loaded.legs:
        _, fin, _ = commands_of(one, loaded.envelope)
        assert np.all(np.abs(fin) <= loaded.envelope.fin + 1e-12)
        assert np.all(np.abs(np.diff(fin)) <= loaded.envelope.fin_rate / one.window.rate_hz + 1e-12)


def test_commands_are_clamped_even_when_a_plan_in_memory_breaks_its_own_limit():
    wild = leg("square_pulses:amplitude=0.6,second=0.6")
    time, fin, steered = commands_of(wild, ENVELOPE)
    assert np.max(np.abs(fin)) == pytest.approx(0.26)
    assert steered[0] == 1
    assert steered[round(3.0 * 20)] == 0
    assert time[1] - time[0] == pytest.approx(0.05)


def test_a_legs_minutes_and_metres_count_run_up_window_and_turn():
    made = leg(passes=3)
    assert made.duration_s == pytest.approx(3 * (10 + 33 + 15))
    assert made.distance_m == pytest.approx(1.4 * made.duration_s)


def test_the_table_of_commands_is_read_back_as_a_log(tmp_path):
    text = table_text(plan(), leg())
    table = np.genfromtxt(text.splitlines(), delimiter=",", names=True)
    run = Run("commands", table["time_s"], {"rudder_rad": table["rudder_rad"]})
    assert len(run) == 661
    assert np.max(run["rudder_rad"]) == pytest.approx(0.26)
    assert set(np.unique(table["autopilot"])) == {0.0, 1.0}


@pytest.mark.parametrize("style", styles())
@pytest.mark.parametrize("spec", ["square_pulses", "zigzag:duration=26", "multisine:period=26"])
def test_every_mission_style_names_the_abort_conditions_and_stays_within_the_limit(style, spec):
    text = render(plan(), leg(spec), style)
    assert "abort" in text.lower()
    assert "38" in text  # the window and its grace
    assert "{{" not in text
    assert "None" not in text
    assert all(abs(s.fin) <= 0.26 for s in steps_of(plan(), leg(spec)))


def test_a_missions_steps_rebuild_the_command():
    made = leg("switched")
    time, fin, steered = commands_of(made, ENVELOPE)
    steps = steps_of(plan(), made)
    at = np.searchsorted([s.time for s in steps], time + 1e-6) - 1
    np.testing.assert_allclose([steps[i].fin for i in at], np.where(steered > 0, 0.0, fin), atol=1e-6)
    assert [steps[i].autopilot for i in at] == [bool(s) for s in steered]


def test_a_bag_of_commands_is_read_back_by_the_projects_own_reader(tmp_path):
    from rosbags.highlevel import AnyReader

    files = write_all(plan(leg()), tmp_path, ["ros2"])
    with AnyReader(files) as reader:
        topics = {c.topic: c for c in reader.connections}
        assert set(topics) == {"/rudder_command", "/autopilot", "/abort_conditions"}
        ((_, when, raw),) = reader.messages([topics["/abort_conditions"]])
        said = json.loads(reader.deserialize(raw, topics["/abort_conditions"].msgtype).data)
        assert when == reader.start_time
        assert [a["signal"] for a in said["abort"]] == [a.signal for a in aborts_of(leg(), ENVELOPE)]
        assert said["fin_max_rad"] == 0.26
        assert said["not_limited"] == ["track", "pitch"]
        fins = [reader.deserialize(raw, c.msgtype).data for c, _, raw in reader.messages([topics["/rudder_command"]])]
    np.testing.assert_allclose(fins, commands_of(leg(), ENVELOPE)[1])


def test_files_that_exist_are_replaced_only_when_forced(tmp_path):
    write_all(plan(leg()), tmp_path)
    for name in formats():
        with pytest.raises(FieldsidError, match="exists"):
            write_all(plan(leg()), tmp_path, [name])
    assert write_all(plan(leg()), tmp_path, force=True)


def test_an_unknown_format_is_answered_with_the_near_one(tmp_path):
    with pytest.raises(FieldsidError) as caught:
        write_all(plan(leg()), tmp_path, ["mos"])
    assert "moos" in caught.value.hint
