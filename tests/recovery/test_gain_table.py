"""The table of gains in short: a hull of every kind, identified at one speed, given gains, and steered by them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from truth.gain_table import Outcome, evaluate, identified, table
from truth.maneuvering.hulls import KINDS, Hull, draw_hull

from fieldsid.errors import ModelError
from fieldsid.schedule.make import design_schedule
from fieldsid.schedule.wish import Wish

SEED = 7


def at_one_speed(number: int) -> Hull:
    hull = draw_hull(number, SEED)
    return Hull(hull.kind, hull.of, hull.rudder_limit, hull.speeds[2:3])


def test_the_table_counts_what_was_said_never_to_settle_and_what_was_refused():
    one = Outcome(0, "flat", 2.0, True, 1.0, 20.0, 10.0, 9.0, 14.0, 11.0, 0.0, 0.1, 50.0)
    never = replace(one, step_deg=90.0, said=np.inf, said_low=np.inf, said_high=np.inf)
    nothing = replace(one, draw=1, kind="tall", said=np.nan, flown=np.nan, refused="no gain")
    assert one.as_said
    assert not never.as_said
    assert not replace(one, flown=13.0).as_said
    assert replace(one, flown=13.0).in_band
    lines = table([one, never, nothing])
    assert lines[1].split()[:6] == ["all", "2", "1", "55", "100", "50"]
    assert any("none designed: no gain" in line for line in lines)
    unsaid = table([one, replace(one, step_deg=90.0, said=np.nan)])
    assert unsaid[1].split()[:3] == ["all", "1", "1"]
    assert any(line.split() == ["90", "deg", "1", "none", "said"] for line in unsaid)


@pytest.mark.slow
@pytest.mark.parametrize("number", range(len(KINDS)), ids=list(KINDS))
def test_hulls_of_every_kind_settle_within_what_was_said_and_none_hunts(number):
    rows = evaluate(at_one_speed(number), number, SEED, "pd", "pulses")
    assert rows
    for row in rows:
        said = f"said {row.said:.1f} s ({row.said_low:.1f} .. {row.said_high:.1f})"
        print(f"{row.speed:.2f} m/s {row.step_deg:.0f} deg: {said}, flown {row.flown:.1f} s")
        assert not row.refused
        assert not row.hunts
        assert row.overshoot < 0.25
        if np.isnan(row.said):  # of pulses alone: whether the fin checks a turn that tight
            assert row.extrapolated
            assert not row.stable
            continue
        assert row.in_band
        assert row.as_said or row.said_high > 1.25 * row.said


@pytest.mark.slow
def test_an_unstable_hull_gets_no_proportional_gain_and_is_told_what_holds_it():
    number = list(KINDS).index("unstable")
    hull = at_one_speed(number)
    source, runs = identified(hull, number, SEED, "pulses")
    with pytest.raises(ModelError, match="unstable") as caught:
        design_schedule(source, hull.rudder_limit, wish=Wish("p"), runs=runs)
    assert "`--controller pd`" in caught.value.hint
