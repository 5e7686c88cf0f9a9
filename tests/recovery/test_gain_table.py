"""The table of gains in short: a hull of every kind, identified at one speed, given gains, and steered by them."""

from __future__ import annotations

import pytest
from truth.gain_table import AT_LEAST_S, WITHIN, evaluate, identified
from truth.maneuvering.hulls import KINDS, Hull, draw_hull

from fieldsid.errors import ModelError
from fieldsid.schedule.design import Wish
from fieldsid.schedule.make import design_schedule

SEED = 7


def at_one_speed(number: int) -> Hull:
    hull = draw_hull(number, SEED)
    return Hull(hull.kind, hull.of, hull.rudder_limit, hull.speeds[2:3])


@pytest.mark.parametrize("number", range(len(KINDS)), ids=list(KINDS))
def test_hulls_of_every_kind_settle_within_what_was_said_and_none_hunts(number):
    rows = evaluate(at_one_speed(number), number, SEED, "pd")
    assert rows
    for row in rows:
        print(
            f"{row.speed:.2f} m/s {row.step_deg:.0f} deg: said {row.said:.1f} .. {row.said_most:.1f} s, flown {row.flown:.1f} s"
        )
        assert not row.refused
        assert not row.hunts
        assert row.overshoot < 0.25
        if row.step_deg == pytest.approx(20.0):
            most = max(row.said, row.said_most)
            assert row.flown <= most + max(WITHIN * most, AT_LEAST_S)


def test_an_unstable_hull_gets_no_proportional_gain_and_is_told_what_holds_it():
    number = list(KINDS).index("unstable")
    hull = at_one_speed(number)
    source, runs = identified(hull, number, SEED)
    with pytest.raises(ModelError, match="unstable") as caught:
        design_schedule(source, hull.rudder_limit, wish=Wish("p"), runs=runs)
    assert "`--controller pd`" in caught.value.hint
