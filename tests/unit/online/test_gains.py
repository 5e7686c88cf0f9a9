"""Gains of now: those of the design from what is known, with a band that holds what the true vehicle would get."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from online_flights import TRUTH, flown

from fieldsid.errors import DataError, ModelError
from fieldsid.fitting.identify import identify
from fieldsid.logs.run import Run
from fieldsid.models.axis import NAMES, Axis
from fieldsid.online import OnlineIdentifier
from fieldsid.online.progress import Watch, default_goals
from fieldsid.plant.parameter_source import source_of_models
from fieldsid.schedule.linear_plant import FinLimits
from fieldsid.schedule.make import design_schedule
from fieldsid.schedule.search.of_one_model import GAINS, Wanted, gains_of_one, wanted_of
from fieldsid.schedule.wish import Wish

FIN, SPEED = 0.35, 1.4
QUICK = Wanted(Wish("pd"), FIN, FinLimits())


def watched(axis="yaw", seed=1, count=1200, **how):
    """An identifier after a flight, the watch's last look, and the flight."""
    online, watch, samples = OnlineIdentifier(axis), Watch(default_goals(Axis(axis))), flown(axis, seed=seed, count=count, **how)
    for i, sample in enumerate(zip(*(s.tolist() for s in samples), strict=True)):
        online.update(*sample, SPEED)
        if i % 20 == 0:
            look = watch.look(online.estimate())
    return online, watch.look(online.estimate()) if count else look, samples


@pytest.mark.parametrize("axis", ["yaw", "pitch"])
def test_they_are_those_of_the_schedule_that_is_designed_of_the_same_log(axis):
    online, look, (time, fin, angle, rate) = watched(axis)
    names = NAMES[Axis(axis)]
    run = Run("log", time, {names.angle: angle, names.fin: fin, names.rate: rate, "surge_m_s": np.full(time.size, SPEED)})
    (fit,) = identify([run], Axis(axis), whole=True)
    (row,) = design_schedule(source_of_models([fit.model], ["log"]), FIN, wish=QUICK.wish).rows
    found = online.gains(look, QUICK)
    for name in GAINS:
        assert abs(getattr(found.row.gains, name) - getattr(row.gains, name)) <= 1.96 * found.std_errors[name] + 0.01
    assert found.verdict == "use"


def test_they_are_refused_while_the_estimate_has_not_settled():
    online, look, _ = watched(count=200)
    with pytest.raises(DataError, match="not settled"):
        online.gains(look, QUICK)
    with pytest.raises(DataError, match="not settled"):
        OnlineIdentifier("yaw").gains(Watch(default_goals(Axis.YAW)).look(OnlineIdentifier("yaw").estimate()))


def test_those_that_are_loaded_are_kept_where_they_serve_and_changed_where_the_fin_has_lost_half():
    online, look, _ = watched()
    loaded = design_schedule(source_of_models([online.estimate().model], ["then"]), FIN, wish=QUICK.wish)
    assert online.gains(look, wanted_of(loaded)).verdict == "keep"
    swapped, look, _ = watched(seed=5, factor=0.5)
    found = swapped.gains(look, wanted_of(loaded))
    assert found.verdict == "change"
    assert found.says.endswith("loaded: change")


@pytest.mark.parametrize(
    ("wanted", "says"),
    [
        pytest.param(replace(QUICK, wish=Wish("p")), "unstable", id="by p"),
        pytest.param(replace(QUICK, limits=FinLimits(delay=8.0)), "no pd gain", id="delay"),
    ],
)
def test_none_are_given_for_what_cannot_be_stabilised(wanted, says):
    online, _, _ = watched(count=400)
    unstable = replace(online.estimate().model, values={**TRUTH["yaw"], "a22": -0.4})
    with pytest.raises(ModelError, match=says):
        gains_of_one(unstable, SPEED, wanted)


@pytest.mark.slow
@pytest.mark.parametrize("axis", ["yaw", "pitch"])
def test_their_band_holds_the_gains_of_the_true_vehicle_as_often_as_it_says(axis):
    wanted = Wanted(Wish("pd"), FIN, FinLimits(), answer=6.0)
    held = []
    for seed in range(40):
        online, look, _ = watched(axis, seed=seed)
        found = online.gains(look, wanted)
        true = gains_of_one(replace(online.estimate().model, values=TRUTH[axis]), SPEED, wanted).row.gains
        held.append([abs(getattr(found.row.gains, n) - getattr(true, n)) <= 1.96 * found.std_errors[n] + 1e-3 for n in GAINS])
    # 40 flights of true coverage 0.95 give less than 0.83 once in 300
    assert (np.mean(held, axis=0) >= 0.83).all(), np.mean(held, axis=0)
