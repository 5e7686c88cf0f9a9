"""Duels: what a refitted rival cannot follow, and the maneuver that is chosen for it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fieldsid.artifacts import save_record
from fieldsid.effects import all_effects
from fieldsid.errors import ArtifactError, FieldsidError, UsageError
from fieldsid.maneuvers import parse_spec
from fieldsid.models.axis import Axis
from fieldsid.models.model import Noise
from fieldsid.planning.belief.prior_model import UNMEASURED, named_prior
from fieldsid.planning.discriminate.discriminate import AT_ONCE, BEYOND_DOUBT, Separation, separate
from fieldsid.planning.discriminate.rivals import rivals_from, rivals_named, typical
from fieldsid.planning.discriminate.t_optimality import log_odds, rival_of
from fieldsid.planning.flight.excitation import Excitation, Window, flown
from fieldsid.planning.flight.operating_point import autopilot_of, operating_point
from fieldsid.planning.safety.envelope import Envelope

PRIOR = replace(named_prior("torpedo", Axis.YAW), noise=Noise(0.005, 0.005))
ENVELOPE = Envelope(0.3)
PAIRS = [
    "servo_lag,delay", "deadband,stall", "stall,quadratic_damping", "quadratic_damping,sway_coupling", "current,trim_drift",
    "current,compass_deviation", "asymmetric_fin,trim_drift", "rate_limit,servo_lag",
]  # fmt: skip


def duel(names, spec, noise=None):
    model = PRIOR if noise is None else replace(PRIOR, noise=noise)
    scenes = [operating_point(m, 1.4) for m in rivals_named(model, names.split(","))]
    maneuver, values = parse_spec(spec)
    pilot = autopilot_of(scenes[0].base, ENVELOPE.limits)
    response = flown(scenes[0], Excitation(maneuver.name, values), Window(45.0), ENVELOPE.limits, pilot)
    first, second = (rival_of(s) for s in scenes)
    return log_odds(first, second, response), log_odds(first, first, response)


def test_a_model_leaves_nothing_of_itself():
    assert duel("servo_lag,delay", "square_pulses")[1] == pytest.approx(0.0, abs=1e-6)


def test_a_larger_model_follows_the_smaller_one():
    wider, _ = duel("none,servo_lag", "square_pulses")
    assert wider < 1.0  # held only by the weak pull towards a typical lag


def test_half_the_noise_gives_four_times_the_log_odds():
    loud, _ = duel("quadratic_damping,stall", "stairs:amplitude=0.3,steps=4,hold=4", Noise(0.02, 0.02))
    quiet, _ = duel("quadratic_damping,stall", "stairs:amplitude=0.3,steps=4,hold=4", Noise(0.01, 0.01))
    assert quiet == pytest.approx(4 * loud, rel=0.35)


def test_a_circle_shows_current_where_pulses_hardly_do():
    assert (
        duel("current,trim_drift", "turning_circle:amplitude=0.3,duration=38")[0]
        > 3 * duel("current,trim_drift", "square_pulses")[0]
    )


@pytest.mark.parametrize("names", PAIRS)
def test_a_quick_search_finds_a_maneuver_inside_the_envelope_for_every_pair(names):
    found = separate(rivals_named(PRIOR, names.split(",")), ENVELOPE, speed=1.4, fast=True)
    assert found.parameters["amplitude"] <= ENVELOPE.fin
    assert len(found.pairs) == 2
    assert found.expected_log_odds == min(found.pairs.values())
    assert found.expected_log_odds > np.log(20)
    assert found.decides
    assert len(found.says()) == 3


@pytest.mark.parametrize(
    ("odds", "verdict"),
    [
        (400.0, "current and none apart at odds of 400 to 1"),
        (1.28, "current and none apart at odds of 1.28 to 1; one pass is not enough for odds of 20 to 1, 13 are"),
        (1.001, "current and none apart at odds of 1 to 1; one pass is not enough for odds of 20 to 1, nor are 40"),
    ],
)
def test_what_a_maneuver_decides_is_said_with_the_passes_that_it_takes(odds, verdict):
    log = float(np.log(odds))
    found = Separation("prbs", parse_spec("prbs")[1], 1.4, log, {"current>none": log}, Window(), {})
    assert found.verdict() == verdict
    assert found.says()[0].endswith("tells them apart:" if found.decides else "tells them apart best:")
    assert verdict.partition("; ")[2] in found.says()[-1]
    assert len(found.says()) == (2 if found.decides else 3)


def test_several_candidates_are_evaluated_at_once_until_one_decides():
    rivals, asked = rivals_named(PRIOR, ("servo_lag", "delay")), []

    def mapped(function, candidates):
        asked.append(len(candidates))
        return [function(c) for c in candidates]

    found = separate(rivals, ENVELOPE, speed=1.4, fast=True, mapped=mapped)
    assert found == separate(rivals, ENVELOPE, speed=1.4, fast=True)
    assert set(asked[:-1]) <= {AT_ONCE}
    assert sum(asked) - AT_ONCE < len(found.alternatives) <= sum(asked)
    assert found.expected_log_odds > BEYOND_DOUBT


def test_a_full_search_is_never_worse_than_its_own_catalogue():
    rivals = rivals_named(PRIOR, ("deadband", "backlash"))
    found = separate(rivals, ENVELOPE, speed=1.4, window_s=40.0)
    assert found.expected_log_odds >= max(found.alternatives.values()) - 1e-9


def test_the_envelope_is_kept_by_what_is_proposed():
    narrow = Envelope(0.3, heading=0.5)
    found = separate(rivals_named(PRIOR, ("servo_lag", "delay")), narrow, speed=1.4, fast=True)
    for model in rivals_named(PRIOR, ("servo_lag", "delay")):
        scene = operating_point(model, found.speed)
        response = flown(scene, found.candidate, found.window, narrow.limits, autopilot_of(scene.base, narrow.limits))
        assert np.max(np.abs(response.angle)) <= 0.5 * 1.05


@pytest.mark.parametrize(
    "names", [("servo_lag",), ("servo_lag", "servo_lag"), ("servo_lag", "dlay"), ("heave_coupling", "delay")]
)
def test_rivals_that_are_no_rivals_are_refused(names):
    with pytest.raises(UsageError) as caught:
        rivals_named(PRIOR, names)
    assert caught.value.hint


def test_an_envelope_no_maneuver_fits_is_refused():
    with pytest.raises(UsageError, match="inside the envelope"):
        separate(rivals_named(PRIOR, ("servo_lag", "delay")), Envelope(0.3, heading=0.001), speed=1.4, fast=True)


def diagnosis(tmp_path, **changes):
    base = {"a22": 1.1, "b2": -0.9, "C0": 0.0}
    train = {"angle_rms_rad": 0.005, "rate_rms_rad_s": 0.005}
    body = {
        "axis": "yaw",
        "speed_m_s": 1.4,
        "noise_floor": {"angle_rad": 0.005, "rate_rad_s": 0.005},
        "candidates": [
            {"effect": "delay", "probability": 0.55, "parameters": base | {"delay": 0.2}, "train": train},
            {"effect": "servo_lag", "probability": 0.44, "parameters": base | {"lag": 0.2}, "train": train},
            {"effect": "stall", "probability": 0.01, "parameters": base, "train": train},
        ],
    }
    return save_record(tmp_path / "diagnosis.yaml", "fieldsid/diagnosis/1", body | changes)


def test_a_diagnosis_names_its_rivals(tmp_path):
    rivals = rivals_from(diagnosis(tmp_path))
    assert [m.effects for m in rivals] == [("delay",), ("servo_lag",)]
    assert rivals[0].values["delay"] == 0.2
    assert rivals[0].law.reference == 1.4
    assert [m.effects for m in rivals_from(tmp_path / "diagnosis.yaml", ("stall", "delay"))] == [("delay",), ("stall",)]


def test_a_rival_that_is_a_set_is_named_in_any_order_and_none_is_left_out(tmp_path):
    base = {"parameters": {"a22": 1.1, "b2": -0.9, "C0": 0.0}, "train": {"angle_rms_rad": 0.005, "rate_rms_rad_s": 0.005}}
    both = [{"effect": "stall+delay", "probability": 0.5} | base, {"effect": "delay", "probability": 0.5} | base]
    path = diagnosis(tmp_path, candidates=both)
    assert [m.effects for m in rivals_from(path, ("delay+stall", "delay"))] == [("stall", "delay"), ("delay",)]
    with pytest.raises(ArtifactError, match="no candidate `dely`") as caught:
        rivals_from(path, ("delay", "delay+stall", "dely"))
    assert "`delay`" in caught.value.hint


@pytest.mark.parametrize(("a", "k"), [(1.1, 0.0), (2.0, 0.3)])
def test_what_the_best_rival_leaves_is_taken_for_a_disturbance(tmp_path, a, k):
    sigma, noise, step = 0.004, 0.002, 0.02
    rng, angle, rate, moment = (
        np.random.default_rng(1),
        np.zeros(50),
        np.zeros(50),
        sigma * np.random.default_rng(2).normal(size=50),
    )
    rates = []
    for _ in range(10_000):
        angle, rate = angle + step * rate, rate + step * (moment - a * rate - k * angle)
        moment = np.exp(-step) * moment + sigma * np.sqrt(1.0 - np.exp(-2.0 * step)) * rng.normal(size=50)
        rates.append(rate)
    rms = float(np.sqrt(np.mean(np.square(rates[500:])) + noise**2))
    yaw, pitch = {"a22": a, "b2": -0.9, "C0": 0.0}, {"c22": a, "c23": k, "d2": 0.9, "Cb": 0.0}
    common = {"parameters": pitch if k else yaw, "train": {"angle_rms_rad": 0.1, "rate_rms_rad_s": rms}}
    worse = common | {"train": {"angle_rms_rad": 0.1, "rate_rms_rad_s": 2.0 * rms}}
    candidates = [{"effect": "delay", "probability": 0.5} | worse, {"effect": "servo_lag", "probability": 0.5} | common]
    floor = {"angle_rad": 0.002, "rate_rad_s": noise}
    rivals = rivals_from(diagnosis(tmp_path, axis="pitch" if k else "yaw", candidates=candidates, noise_floor=floor))
    assert [m.noise.disturbance for m in rivals] == pytest.approx([sigma, sigma], rel=0.1)


def test_a_channel_that_nothing_measured_tells_nothing(tmp_path):
    train = {"angle_rms_rad": 0.005, "rate_rms_rad_s": None}
    base = {"a22": 1.1, "b2": -0.9, "C0": 0.0}
    candidates = [{"effect": e, "probability": 0.5, "parameters": base, "train": train} for e in ("delay", "servo_lag")]
    first, _ = rivals_from(diagnosis(tmp_path, candidates=candidates, noise_floor={"angle_rad": 0.005, "rate_rad_s": None}))
    assert first.noise == Noise(0.005, UNMEASURED)


def test_what_a_diagnosis_does_not_believe_is_no_rival(tmp_path):
    common = {"parameters": {"a22": 1.1, "b2": -0.9, "C0": 0.0}, "train": {"angle_rms_rad": 0.005, "rate_rms_rad_s": 0.005}}
    sure = [{"effect": "delay", "probability": 1.0} | common, {"effect": "stall", "probability": 1e-127} | common]
    with pytest.raises(UsageError, match="no rivals") as caught:
        rivals_from(diagnosis(tmp_path, candidates=sure))
    assert caught.value.found == "delay with probability 1, stall with probability 1e-127"
    named = rivals_from(tmp_path / "diagnosis.yaml", ("delay", "stall"))
    assert [m.effects for m in named] == [("delay",), ("stall",)]


@pytest.mark.parametrize(
    "changes", [{"candidates": []}, {"candidates": [{"effect": "delay"}]}, {"axis": "x"}, {"noise_floor": {}}]
)
def test_an_incomplete_diagnosis_is_refused(tmp_path, changes):
    with pytest.raises(FieldsidError) as caught:
        rivals_from(diagnosis(tmp_path, **changes))
    assert caught.value.hint


@pytest.mark.parametrize("effect", all_effects().values(), ids=lambda e: e.name)
def test_the_typical_strength_of_an_effect_is_inside_its_bounds_and_never_nothing(effect):
    values = [typical(c) for c in effect.shared]
    assert all(c.low <= v <= c.high for c, v in zip(effect.shared, values, strict=True))
    # An effect may have no coefficient but a nuisance of every run; one that has some is never left at nothing.
    assert any(values) or not effect.shared
