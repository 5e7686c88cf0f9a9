"""An error put at a known place is found there: phase, side, fin, time, and the worst stretch."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fieldsid.comparison.conditions import conditions
from fieldsid.comparison.localize import places, stretches
from fieldsid.dynamics.free_run import command_record
from fieldsid.models.axis import Axis

TIME = np.arange(0.0, 40.0, 0.05)
FIN = np.select([(TIME >= 10) & (TIME < 13), (TIME >= 13) & (TIME < 16)], [0.2, -0.2], 0.0)
RATE = -FIN * 1.5


def record(axis=Axis.YAW, **signals):
    made = command_record(axis, TIME, FIN, speed=1.5, signals=signals)
    seen = np.ones(TIME.size, dtype=bool)
    return replace(made, angle=0.02 * TIME, angle_ok=seen, rate_ok=seen)


def found(square, made=None):
    return places(TIME, square, np.ones(TIME.size, dtype=bool), conditions(made or record(), RATE, 0.0))


def share(square, words, made=None):
    (place,) = [p for p in found(square, made) if p.condition == words]
    return place.share_of_error


@pytest.mark.parametrize(
    ("start", "end", "words"),
    [
        (10.1, 10.9, "phase: onset"),
        (11.5, 12.5, "phase: hold"),
        (17.5, 25.0, "phase: recovery"),
        (2.0, 8.0, "phase: before"),
        (13.1, 15.9, "side: starboard"),
        (10.1, 12.9, "side: port"),
        (30.5, 39.5, "time: 30 .. 40 s"),
    ],
)
def test_all_of_an_error_is_ascribed_to_the_condition_it_was_put_at(start, end, words):
    square = np.where((start <= TIME) & (end >= TIME), 1.0, 0.0)
    assert share(square, words) == pytest.approx(1.0)


def test_pitch_has_noses_and_yaw_has_sides():
    words = {c.words for c in conditions(record(Axis.PITCH), RATE, 0.0)}
    assert {"side: nose up", "side: nose down"} <= words
    assert "side: port" not in words


def test_the_first_place_has_the_most_error_above_its_share_of_time():
    places_ = found(np.where((TIME >= 10) & (TIME < 11), 1.0, 0.01))
    excess = [p.share_of_error - p.share_of_samples for p in places_]
    assert excess == sorted(excess, reverse=True)
    assert places_[0].condition in {"phase: onset", "fin: above 0.13 rad off trim", "rate: above 0.2 rad/s"}


def test_shares_of_one_kind_add_up_and_ratios_follow_from_them():
    rng = np.random.default_rng(2)
    phases = [p for p in found(rng.normal(size=TIME.size) ** 2) if p.condition.startswith("phase")]
    assert sum(p.share_of_error for p in phases) == pytest.approx(1.0)
    assert all(p.rms_ratio == pytest.approx(np.sqrt(p.share_of_error / p.share_of_samples)) for p in phases)


def test_the_worst_time_of_a_place_lies_around_the_error():
    square = np.where((TIME >= 13.2) & (TIME < 13.4), 1.0, 0.0)
    (onset,) = [p for p in found(square) if p.condition == "phase: onset"]
    assert onset.start_s <= 13.2
    assert 13.4 <= onset.end_s + 0.05 <= 14.1


def test_helpers_make_conditions_only_where_they_move():
    still = {c.words for c in conditions(record(), RATE, 0.0)}
    moving = {c.words for c in conditions(record(surge=1.5 - 0.01 * TIME, depth=0.1 * TIME), RATE, 0.0)}
    assert not any(w.startswith(("speed", "depth")) for w in still)
    assert sum(w.startswith("speed") for w in moving) == 2
    assert sum(w.startswith("depth") for w in moving) == 2


def test_worst_stretches_do_not_overlap_and_start_with_the_worst():
    square = np.where((TIME >= 10) & (TIME < 11), 4.0, 0.0) + np.where((TIME >= 30) & (TIME < 31), 1.0, 0.0)
    one, two = stretches(TIME, square, np.ones(TIME.size, dtype=bool))
    assert one.start_s <= 10.0
    assert one.end_s >= 10.94
    assert two.start_s <= 30.0
    assert two.end_s >= 30.94
    assert one.share_of_error == pytest.approx(0.8)


def test_a_perfect_run_fails_nowhere():
    assert found(np.zeros(TIME.size)) == ()
    assert stretches(TIME, np.zeros(TIME.size), np.ones(TIME.size, dtype=bool)) == ()


def test_samples_that_were_not_measured_count_for_nothing():
    ok = TIME < 20
    square = np.where(TIME >= 20, 100.0, 1.0)
    assert places(TIME, square, ok, conditions(record(), RATE, 0.0))[0].share_of_error <= 1.0
    assert all(s.end_s < 22.0 for s in stretches(TIME, square, ok))
