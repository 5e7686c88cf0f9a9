"""A small blind bank: hidden effects named, nothing named where nothing is hidden, strangers called unexplained.

The quick suite has one case of each kind; the cases that once went wrong are slow, as each takes a search of its own.
The whole bank of 200 cases is `python tests/benchmarks/hidden_effects.py --cases 200`.
"""

from __future__ import annotations

import numpy as np
import pytest
from truth import maneuvers
from truth.bank import Case, make_case
from truth.logbook import flown
from truth.noise import Clock
from truth.physics import Physics

from fieldsid.diagnosis import Diagnosis, diagnose
from fieldsid.diagnosis.data.applicable_effects import applicable_effects
from fieldsid.diagnosis.search.accepted_sets import core_of
from fieldsid.diagnosis.search.search import Search
from fieldsid.effects import all_effects
from fieldsid.logs.run import Run
from fieldsid.models.axis import Axis
from fieldsid.models.record import record_of
from fieldsid.records.keys import body_of
from fieldsid.runtime import worker_pool

SEED = 2026
WANDERING = 24
"""Index of a log without an effect whose sensors wander."""
CHANNELS = (("angle", "rad"), ("rate", "rad_s"))


def runs_of(logs: list[dict[str, np.ndarray]], tag: str) -> list[Run]:
    """Return the bank's logs as runs."""
    return [
        Run(f"{tag}{i}", np.asarray(log["time_s"], float), {k: np.asarray(v, float) for k, v in log.items() if k != "time_s"})
        for i, log in enumerate(logs)
    ]


def visible_case(kind: str, first: int) -> Case:
    """Return the first case of a kind from an index on whose effect can be seen (or that hides none)."""
    index = first
    while True:
        case = make_case(index, SEED, kind=kind)
        if case.visible or kind == "none":
            return case
        index += 1


def diagnosed(case: Case) -> Diagnosis:
    """Return the diagnosis of a case."""
    return diagnose(runs_of(case.training, "train"), Axis(case.axis), runs_of(case.validation, "unseen"))


@pytest.mark.slow  # the normal suite asks it of the case of tests/recovery/test_verdict_properties.py
@pytest.mark.parametrize("first", [10, 0, 20, 30])
def test_a_single_hidden_effect_is_among_the_first_three_and_its_error_falls(first: int) -> None:
    case = visible_case("single", first)
    found = diagnosed(case)
    leading = [set(c.effects) for c in found.candidates[:3]]
    assert any(set(case.accepts) & names for names in leading), (case.effects, leading)
    assert found.verdict in ("effect", "undecided", "unexplained")
    assert found.final.validation.rate_rms_rad_s <= found.base.validation.rate_rms_rad_s * 1.001


@pytest.mark.parametrize("first", [0, pytest.param(10, marks=pytest.mark.slow)])
def test_nothing_is_named_where_nothing_is_hidden(first: int) -> None:
    found = diagnosed(visible_case("none", first))
    assert found.verdict in ("sufficient", "disturbed")
    assert found.effects == ()
    assert found.final == found.base


@pytest.mark.slow
def test_sensors_that_wander_are_noise_and_nothing_is_missing() -> None:
    """The floor that is printed is the one that decides: over the white part alone the error is 1.7 times the noise."""
    case = make_case(WANDERING, 701, kind="none")
    found = diagnosed(case)
    assert found.verdict == "sufficient"
    assert found.base.validation.over(found.noise_floor) < 1.15
    assert found.noise_floor.angle == pytest.approx(case.floor["angle_rad"], rel=0.15)


@pytest.mark.slow
def test_an_effect_that_the_others_have_made_idle_is_left_out() -> None:
    case = visible_case("pair", 0)
    axis = Axis(case.axis)
    training, unseen = ([record_of(r, axis) for r in runs_of(logs, "run")] for logs in (case.training, case.validation))
    catalogue, _ = applicable_effects(all_effects(axis).values(), [*training, *unseen])
    work = Search(training, unseen, axis, catalogue)
    found = work.best()
    longer = work.grow(found, forced=True)[0]
    assert len(longer.names) == len(found.names) + 1 == 3
    assert core_of(longer, work.tried, work.floor) == frozenset(found.names)


@pytest.mark.slow  # the normal suite has a catalogue without the cause in tests/unit/diagnosis/search/test_budget.py
def test_a_cause_that_no_catalogue_has_is_not_given_a_name() -> None:
    found = diagnosed(visible_case("uncatalogued", 0))
    assert found.verdict == "unexplained"
    assert found.effects == ()
    assert "no effect of the catalogue" in found.says


@pytest.mark.slow
@pytest.mark.parametrize(("seed", "index"), [(126, 114), (126, 119), (126, 38), (126, 44)], ids=("servo", "fin", "roll", "wave"))
def test_an_effect_of_another_shape_is_followed_down_to_the_floor(seed: int, index: int) -> None:
    case = make_case(index, seed)
    found = diagnosed(case)
    assert (found.verdict, found.effects) == ("effect", case.effects)
    after = found.final.validation
    for channel, error in (("angle_rad", after.angle_rms_rad), ("rate_rad_s", after.rate_rms_rad_s)):
        assert error < 1.06 * case.floor[channel]


@pytest.mark.parametrize(
    ("seed", "index", "colour"),
    [
        pytest.param(
            132,
            75,
            None,
            id="far off",
            marks=[
                pytest.mark.slow,
                pytest.mark.xfail(
                    strict=True, reason="the pair leads by 24 nats, and its coupling is not accepted where 15 x is left"
                ),
            ],
        ),
        pytest.param(132, 84, "ar1", id="many ends", marks=pytest.mark.slow),
        pytest.param(136, 100, None, id="play behind a slow fin", marks=pytest.mark.slow),
        pytest.param(138, 102, None, id="another trim for one than for both", marks=pytest.mark.slow),
    ],
)
def test_a_pair_of_which_neither_alone_looks_like_itself_is_found(seed: int, index: int, colour: str | None) -> None:
    case = make_case(index, seed, colour=colour)
    assert len(case.effects) == 2
    found = diagnosed(case)
    assert set(found.effects) == set(case.effects)
    over = np.mean([getattr(found.final.validation, f"{c}_rms_{unit}") / case.floor[f"{c}_{unit}"] for c, unit in CHANNELS])
    assert over < 1.3


@pytest.mark.slow
@pytest.mark.parametrize("index", [131, 8], ids=("linear", "square"))
def test_a_propeller_trimmed_away_beside_a_moment_that_stays_is_named(index: int) -> None:
    """Neither law of the trim holds then: a part goes with the square of the speed, and one does not."""
    case = make_case(index, 135)
    assert case.effects == ("prop_moment",)
    assert not case.details["bent_fin"]
    found = diagnosed(case)
    assert (found.verdict, found.effects) == ("effect", case.effects)
    assert found.final.validation.angle_rms_rad < 1.15 * case.floor["angle_rad"]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("seed", "index"),
    [
        pytest.param(136, 15, id="no better yet"),
        pytest.param(136, 50, id="stands in"),
        pytest.param(136, 29, id="another end"),
        pytest.param(171, 62, id="other times of an event"),
    ],
)
def test_a_single_effect_is_found_whatever_law_of_the_trim_or_end_of_the_fit_hid_it(seed: int, index: int) -> None:
    case = make_case(index, seed)
    found = diagnosed(case)
    assert (found.verdict, found.effects) == ("effect", case.effects)
    assert found.final.validation.angle_rms_rad < 1.06 * case.floor["angle_rad"]


@pytest.mark.slow
def test_an_effect_that_promises_nothing_in_the_textbooks_form_is_found_in_another() -> None:
    case = make_case(91, 157)
    assert case.effects == ("prop_moment",)
    found = diagnosed(case)
    assert (found.verdict, found.effects) == ("effect", case.effects)
    assert found.final.validation.angle_rms_rad < 1.15 * case.floor["angle_rad"]


@pytest.mark.slow
def test_a_current_is_found_from_runs_of_several_speeds_and_none_is_moved_to_another() -> None:
    case = make_case(131, 142)
    found = diagnosed(case)
    assert (found.verdict, found.effects) == ("effect", case.effects)
    assert found.final.validation.angle_rms_rad < 1.06 * case.floor["angle_rad"]
    assert "own_speed" not in {n.code for n in found.notes}


@pytest.mark.slow
def test_a_dead_zone_is_named_beside_a_lag_of_more_evidence_that_lowers_no_error() -> None:
    """The lag of a servo has more evidence than the dead zone, which has the error: neither hides the other."""
    physics, clock = Physics(damping=0.95, authority=-1.7, deadband_width=0.011, servo_tau=0.06), Clock(0.05, 1500)
    plans = (
        maneuvers.pulses(clock.time, 0.18, 0.12),
        maneuvers.three_two_one_one(clock.time, 0.12),
        maneuvers.circle(clock.time, 0.12),
        maneuvers.zigzag(clock.time, 0.12, 0.1),
    )
    logs = [
        flown(physics, clock, plan, angle_noise=0.005, rate_noise=0.006, gust=0.01, seed=seed) for seed, plan in enumerate(plans)
    ]
    kept = [{name: log[name] for name in ("time_s", "yaw_rad", "yaw_rate_rad_s", "rudder_rad", "surge_m_s")} for log in logs]
    found = diagnose(runs_of(kept[:3], "train"), Axis.YAW, runs_of(kept[3:], "unseen"))
    assert set(found.effects) == {"deadband", "servo_lag"}


@pytest.mark.slow
@pytest.mark.forks
def test_a_second_core_changes_no_digit(monkeypatch: pytest.MonkeyPatch) -> None:
    case = visible_case("pair", 41)
    shared = diagnosed(case)
    monkeypatch.setattr(worker_pool, "can_fork", lambda: False)
    assert body_of(diagnosed(case)) == body_of(shared)
