"""A jump of the fin's authority: noticed in time where there is one, and nowhere else."""

from __future__ import annotations

import json
from functools import cache

import numpy as np
import pytest
from online_flights import STEP_S, TRUTH, fed, flown

from fieldsid.models.axis import NAMES, Axis
from fieldsid.online import OnlineIdentifier
from fieldsid.online.authority_jump import MAX_SECONDS_AFTER

BEFORE_S = 65.0
"""Where the second flight begins: a while after the end of the first, as a swap takes."""
AUTHORITY = {"yaw": "b2", "pitch": "d2"}


def then(online, samples, begin, speed=float("nan")):
    """When a jump was first told while samples came, at the speed given; NaN where none was."""
    known, told = online.estimate().jump, float("nan")
    for i, (time, *rest) in enumerate(zip(*(np.asarray(s).tolist() for s in samples), strict=True)):
        online.update(begin + time, *rest, speed)
        if i % 10 == 0 and np.isnan(told) and online.estimate().jump is not known:
            told = begin + time
    return told


@cache
def after_a_flight(axis):
    """The state of an identifier that a flight before the jump was fed to."""
    return json.dumps(fed(OnlineIdentifier(axis), flown(axis, seed=3)).state())


JUMPS = ((0.0, 1.0), (0.5, 1.0), (0.7, 1.0), (1.5, 1.0), (0.7, 0.7), (0.7, 0.8), (0.5, 0.5), (1.4, 1.4))
IN_PITCH = JUMPS[1::4]
"""Those that the normal suite has in pitch too."""


@pytest.mark.parametrize(
    ("axis", "factor", "damped"),
    [
        *(("yaw", *jump) for jump in JUMPS),
        *(pytest.param("pitch", *jump, marks=() if jump in IN_PITCH else pytest.mark.slow) for jump in JUMPS),
    ],
)
def test_a_jump_is_told_within_twenty_seconds_of_excitation_and_the_estimate_is_of_what_came_since(axis, factor, damped):
    online = OnlineIdentifier.from_state(json.loads(after_a_flight(axis)))
    told = then(online, flown(axis, seed=4, factor=factor, damped=damped), BEFORE_S)
    assert told <= BEFORE_S + MAX_SECONDS_AFTER
    now = online.estimate()
    assert abs(now.jump.time - BEFORE_S) < 4.0
    assert abs(now.jump.factor - factor) < 4.0 * now.jump.std_error
    damping = NAMES[Axis(axis)].damping
    for name, share in ((damping, damped), (AUTHORITY[axis], factor)):
        if factor or name == AUTHORITY[axis]:  # of a fin that turns nothing no damping shows
            assert abs(now.values[name] - share * TRUTH[axis][name]) < 4.0 * now.std_errors[name]


@pytest.mark.parametrize("flights", [1, pytest.param(8, marks=pytest.mark.slow)])
@pytest.mark.parametrize("axis", ["yaw", "pitch"])
@pytest.mark.parametrize("colour", [0.0, 0.9])
def test_noise_alone_is_no_jump(axis, colour, flights):
    found = [fed(OnlineIdentifier(axis), flown(axis, count=2400, seed=s, colour=colour)).estimate().jump for s in range(flights)]
    assert found == [None] * flights


@pytest.mark.parametrize(
    ("seed", "shaken"), [(26, {"sea": (0.05, 5.0)}), *((s, {"gust": (40.0, 42.0, 0.1)}) for s in (2, 7, 11))]
)
def test_a_disturbance_is_no_jump_whether_it_lasts_or_passes(seed, shaken):
    assert fed(OnlineIdentifier("yaw"), flown(count=1000, seed=seed, **shaken)).estimate().jump is None


def test_another_speed_is_no_jump():
    online = OnlineIdentifier("yaw")
    for i, faster in enumerate((1.0, 1.5, 0.7)):
        assert np.isnan(then(online, flown(seed=i, faster=faster), i * BEFORE_S, speed=1.4 * faster))


def test_a_saved_state_notices_it_as_well():
    before, after = flown(seed=3), flown(seed=4, factor=0.6)
    online = fed(OnlineIdentifier("yaw"), before)
    again = OnlineIdentifier.from_state(json.loads(json.dumps(online.state(), allow_nan=False)))
    assert then(again, after, BEFORE_S) == then(online, after, BEFORE_S)
    assert again.estimate() == online.estimate()
    assert OnlineIdentifier.from_state(json.loads(json.dumps(online.state()))).estimate() == online.estimate()


def test_a_flight_that_begins_anew_uses_only_what_is_kept():
    online = fed(OnlineIdentifier("yaw"), flown(seed=3))
    then(online, flown(seed=4, factor=0.5), BEFORE_S)
    assert online.estimate().used * STEP_S < 65.0
