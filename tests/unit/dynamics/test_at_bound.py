"""A coefficient on its bound is shown without an error, by the model's own table and by that of `sysid identify`."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from cli import trial

from fieldsid.dynamics.at_bound import at_bound
from fieldsid.models.axis import Axis
from fieldsid.rounding import RADIANS
from fieldsid.views._words import parameter_block


def backlash(gap):
    model = trial.vehicle(Axis.YAW, "backlash", gap=gap)
    return replace(model, free=("b2", "gap"), covariance=np.diag([0.01, 0.02]))


def test_of_a_model_those_are_named_that_stand_on_an_end_of_their_range():
    assert at_bound(backlash(0.0)) == {"gap"}
    assert at_bound(backlash(0.05)) == frozenset()


def test_a_table_of_parameters_gives_it_no_error():
    rows = {row[1]: row[2:5] for row in parameter_block([("", backlash(0.0))]).rows}
    assert rows["gap"] == ("0 (at its bound)", "", "-")
    assert rows["b2"][2] != "-"


def test_an_estimate_on_its_bound_is_the_value_alone():
    assert RADIANS.estimate(20.0, 14.0, (-7.4, 47.4), "1/s^2", at_bound=True) == ("20.00 (at its bound)", "1/s^2", "-")
    assert RADIANS.estimate(20.0, 14.0, (-7.4, 47.4), "1/s^2") == ("20 +/- 14", "1/s^2", "-7.4 .. 47.4")
