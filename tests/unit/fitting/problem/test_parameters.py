"""Which runs form one speed group, and what the law of a joint fit takes from them."""

from __future__ import annotations

import numpy as np
import pytest

from fieldsid.dynamics.free_run import command_record
from fieldsid.effects import pick_effect
from fieldsid.fitting.problem.parameters import layout_of, speed_groups
from fieldsid.models.axis import Axis
from fieldsid.models.effect import with_variant

TIME = np.arange(100) * 0.05


def runs(*speeds):
    return [command_record(Axis.YAW, TIME, np.zeros(100), speed=u, name=f"u{u}") for u in speeds]


@pytest.mark.parametrize(
    ("speeds", "of_run"),
    [
        ((1.0, 1.05, 1.6), (0, 0, 1)), ((1.6, 1.0), (1, 0)), ((1.0, 1.06, 1.12), (0, 0, 0)), ((1.4,), (0,)),
        ((1.0, float("nan")), (0, 0)),
    ],
)  # fmt: skip
def test_runs_within_eight_percent_of_a_neighbour_form_a_group(speeds, of_run):
    assert speed_groups(runs(*speeds)).of_run == of_run


@pytest.mark.parametrize(("width", "of_run"), [(0.08, (0, 0, 0)), (0.03, (0, 0, 1))])
def test_a_narrower_group_takes_less(width, of_run):
    assert speed_groups(runs(1.0, 1.02, 1.08), width=width).of_run == of_run


def test_the_reference_is_the_group_nearest_the_median_of_the_groups():
    groups = speed_groups(runs(1.0, 1.4, 2.0, 2.1))
    assert groups.speeds[groups.reference] == pytest.approx(1.4)


def test_several_groups_have_an_authority_each_and_share_the_exponent():
    layout = layout_of(runs(1.0, 1.5, 2.2), Axis.YAW, ())
    assert layout.names == ("a22", "b2@1", "b2", "b2@2.2", "C0", "damping_exponent")
    law = layout.law({"b2": -1.5, "b2@1": -0.7, "b2@2.2": -3.0, "damping_exponent": 0.9})
    assert law.points == ((1.0, -0.7), (1.5, -1.5), (2.2, -3.0))
    assert law.damping_exponent == 0.9


def test_runs_of_a_group_keep_speeds_of_their_own_however_near():
    assert speed_groups(runs(1.0, 1.004)).run_speeds == (1.0, 1.004)


def test_snapped_runs_count_as_flown_at_their_groups_speed():
    assert speed_groups(runs(1.0, 1.05), snapped=True).run_speeds == pytest.approx((1.025, 1.025))


def test_the_one_cross_state_is_that_of_the_effect_whose_textbook_has_it():
    flow, sway = pick_effect("crossflow_drag"), pick_effect("sway_coupling")
    shared = with_variant(flow, flow.variants[0])
    alone, both = layout_of(runs(1.4), Axis.YAW, [flow]), layout_of(runs(1.4), Axis.YAW, [sway, flow])
    assert alone.effects == (flow,)
    assert both.effects == (sway, shared)
    for layout in (alone, both):
        assert sum(p.name == "rate_before" for p in layout.parameters) == 1
    assert layout_of(runs(1.4), Axis.YAW, [flow, sway]).effects == (shared, sway)
    # whichever leaves, the other has a state
    assert layout_of(runs(1.4), Axis.YAW, [shared]).effects == (flow,)
    formed = with_variant(sway, sway.variants[0])
    assert layout_of(runs(1.4), Axis.YAW, [formed, flow]).effects == (formed, shared)
