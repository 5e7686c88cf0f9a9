"""The answer that is asked of a loop is the one it has, at all speeds; what cannot be had is refused with what can."""

from __future__ import annotations

import re

import numpy as np
import pytest

from fieldsid.errors import UsageError
from fieldsid.models.axis import Axis
from fieldsid.models.model import Model, Noise
from fieldsid.models.speed_law import SpeedLaw
from fieldsid.plant.parameter_source import source_of_models
from fieldsid.schedule.controller import Gains
from fieldsid.schedule.flown.response import overshoot
from fieldsid.schedule.linear_plant import FinLimits
from fieldsid.schedule.make import design_schedule
from fieldsid.schedule.plants import models_plants
from fieldsid.schedule.record import load_schedule, save_schedule
from fieldsid.schedule.rows import DESIGN_DRAWS, SEED, place_of
from fieldsid.schedule.verdict import against_constant
from fieldsid.schedule.verify import verify_schedule
from fieldsid.schedule.wish import QUICKEST, Wish, check_wish, damping_of, overshoot_of

LIMIT, SPEEDS = 0.26, [1.0, 1.4, 2.1]
ENDS = SPEEDS[::2]


def source_of(a22=0.9, b2=-0.8, lag=0.2, quadratic=0.6, spread=0.04):
    own = {"a22": a22, "b2": b2, "C0": 0.01, "lag": lag, "quadratic": quadratic}
    trained = {"speed_low": 1.0, "speed_high": 2.0, "fin_max": 0.26, "rate_max": 0.3}
    covariance, effects = np.diag([(spread * v) ** 2 for v in own.values()]), ("servo_lag", "quadratic_damping")
    model = Model(Axis.YAW, effects, own, {}, tuple(own), covariance, SpeedLaw(1.5), Noise(0.005, 0.005), trained)
    return source_of_models([model], ["m"])


def places(source, schedule):
    plants, answer = models_plants(source, FinLimits(), ()), schedule.answer.settling
    return [place_of(plants.at(u, LIMIT, DESIGN_DRAWS, SEED), schedule.wish, LIMIT, answer) for u in schedule.speeds]


def settled(source, schedule):
    return np.array([p.outcome(r.gains).settled for p, r in zip(places(source, schedule), schedule.rows, strict=True)])


@pytest.mark.parametrize("settling", [None, QUICKEST], ids=["one answer", "quickest"])
@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=pytest.mark.slow) for seed in (1, 2))])
def test_no_constant_gain_is_better_in_any_row(seed, settling):
    draw = np.random.default_rng(seed)
    a22, b2, lag = draw.uniform(-0.1, 1.5), draw.choice([-1.0, 1.0]) * draw.uniform(0.4, 3.0), draw.uniform(0.05, 0.4)
    source = source_of(a22, b2, lag, draw.uniform(0.0, 1.5), draw.uniform(0.01, 0.08))
    schedule = design_schedule(source, LIMIT, speeds=SPEEDS, wish=Wish("pd", settling=settling))
    tried = places(source, schedule)
    kp, kd = (np.array([getattr(r.gains, n) for r in schedule.rows]) for n in ("kp", "kd"))
    constants = [
        Gains(float(draw.choice(kp) * draw.uniform(0.7, 1.4)), 0.0, float(draw.choice(kd) * draw.uniform(0.6, 1.6)))
        for _ in range(12)
    ]
    one = min(constants, key=lambda g: max(p.outcome(g).cost(p.demand) for p in tried))
    for row, place in zip(schedule.rows, tried, strict=True):
        assert not place.outcome(row.gains).worse_than(place.outcome(one), place.demand)


def test_all_speeds_settle_alike_and_the_gain_falls_with_the_square_of_the_speed():
    source = source_of(a22=0.2)
    schedule = design_schedule(source, LIMIT, speeds=SPEEDS, wish=Wish("pd"))
    assert np.ptp(np.log(settled(source, schedule))) < 0.03
    power = np.polyfit(np.log(SPEEDS), np.log(np.abs(schedule.column("kp"))), 1)[0]
    assert power == pytest.approx(-2.0, abs=0.1)
    assert schedule.rows[0].binds == "fin at 20.0 deg"
    assert schedule.rows[0].fin_use == pytest.approx(1.0, abs=1e-3)
    assert all(r.binds.startswith("settling") and r.binds.endswith("as at 1 m/s") for r in schedule.rows[1:])
    checked = verify_schedule(schedule, source, draws=8)
    assert checked.worse == ()
    assert against_constant(checked).startswith("against the best constant gain, kp ")
    assert "% with the schedule" in against_constant(checked)


def test_an_answer_that_is_asked_is_the_answer_and_a_quicker_one_is_refused_with_what_is_possible():
    source = source_of()
    asked = design_schedule(source, LIMIT, speeds=ENDS, wish=Wish("pd", settling=9.0))
    assert settled(source, asked) == pytest.approx(9.0, rel=0.02)
    assert all(r.fin_use < 0.9 for r in asked.rows)
    with pytest.raises(UsageError, match=r"within 2 s at 1 m/s") as caught:
        design_schedule(source, LIMIT, speeds=ENDS, wish=Wish("pd", settling=2.0))
    assert "bound by fin at 20.0 deg; fin lag 0.2 s, delay 0 s" in caught.value.found
    possible = float(re.search(r"--settling ([0-9.]+)s", caught.value.hint).group(1))
    assert possible > 2.0
    assert design_schedule(source, LIMIT, speeds=ENDS, wish=Wish("pd", settling=possible)).answer.settling == possible


@pytest.mark.parametrize(
    ("latency", "step", "bound"),
    [
        (0.0, None, "fin at 20.0 deg; .*"),
        pytest.param(0.6, 0.03, "(damping|phase margin) .*delay 0.6 s", marks=pytest.mark.slow),
    ],
)
def test_a_bandwidth_is_kept_and_one_beyond_fin_or_latency_is_refused_with_what_is_possible(latency, step, bound):
    source, limits = source_of(), FinLimits(latency=latency)
    with pytest.raises(UsageError, match="bandwidth of 6 rad/s") as caught:
        design_schedule(source, LIMIT, speeds=ENDS, wish=Wish("pd", bandwidth=6.0, step=step), limits=limits)
    assert re.search(f"bound by {bound}", caught.value.found)
    possible = float(re.search(r"--bandwidth ([0-9.]+)rad/s", caught.value.hint).group(1))
    made = design_schedule(source, LIMIT, speeds=ENDS, wish=Wish("pd", bandwidth=possible, step=step), limits=limits)
    authority = [0.8 * (u / 1.5) ** 2 for u in ENDS]
    assert np.sqrt(np.abs(made.column("kp")) * authority) == pytest.approx(possible, rel=0.02)


def test_overshoot_step_and_share_of_the_fin_are_kept():
    source = source_of(a22=0.3)
    made = design_schedule(source, LIMIT, speeds=SPEEDS[:2], wish=Wish("pd", overshoot=0.02, step=0.5, fin_use=0.6))
    assert made.damping == pytest.approx(damping_of(0.02))
    assert max(made.column("fin_use")) == pytest.approx(0.6, abs=2e-3)
    assert abs(made.rows[0].gains.kp) * 0.5 == pytest.approx(0.6 * LIMIT, rel=2e-3)
    for place, row in zip(places(source, made), made.rows, strict=True):
        assert overshoot(place.step(row.gains)[1][..., 0], 0.5).max() < 0.022


def test_what_was_asked_comes_back_from_the_file_and_a_file_from_before_is_the_quickest(tmp_path):
    source, wish = source_of(), Wish("pd", settling=9.0, overshoot=0.1, fin_use=0.9, step=0.4)
    made = design_schedule(source, LIMIT, speeds=SPEEDS[:2], wish=wish)
    path = save_schedule(made, tmp_path / "gains.yaml")
    again = load_schedule(path)
    assert again.wish == Wish("pd", damping_of(0.1), settling=9.0, overshoot=0.1, fin_use=0.9, step=0.4)
    assert [r.binds for r in again.rows] == [r.binds for r in made.rows]
    old = re.sub(r"answer:\n(  .*\n)+", "", path.read_text())
    old = re.sub(r" *(binds|fin_use): .*\n", "", old)
    path.write_text(old)
    assert load_schedule(path).wish.settling == QUICKEST


def test_damping_and_overshoot_are_each_others_inverse():
    for damping in (0.2, 0.5, 0.7071, 0.95):
        assert damping_of(overshoot_of(damping)) == pytest.approx(damping)
    assert damping_of(0.0) == 1.0
    assert overshoot_of(1.0) == 0.0


@pytest.mark.parametrize(
    "wish",
    [
        Wish("pd", settling=4.0, bandwidth=1.0), Wish("pd", overshoot=0.9), Wish("pd", fin_use=1.2), Wish("pd", settling=-1.0),
        Wish("pd", bandwidth=0.0), Wish("pd", step=4.0),
    ],
)  # fmt: skip
def test_a_wish_that_cannot_be_meant_has_a_hint(wish):
    with pytest.raises(UsageError) as caught:
        check_wish(wish)
    assert caught.value.hint
