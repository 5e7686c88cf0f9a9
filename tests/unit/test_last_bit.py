"""No result hangs on the last bit of a sum: processors add up in different orders, and what is equal but for that is equal."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import hidden_lag
import numpy as np
import pytest

from fieldsid.diagnosis.data.holdout_split import holdout_split
from fieldsid.diagnosis.evidence import noise_kind
from fieldsid.diagnosis.moves import speed_law_search
from fieldsid.diagnosis.parallel_map import ParallelMap
from fieldsid.fitting.initial.joint_grid_search import _first_least
from fieldsid.fitting.problem.parameters import speed_groups
from fieldsid.models.axis import Axis
from fieldsid.models.model import Model, Noise, save_model
from fieldsid.models.record import record_of
from fieldsid.models.speed_law import SpeedLaw
from fieldsid.numerics.gcv_smoother import gcv_smooth
from fieldsid.numerics.shifted_correlation import shifted_correlations
from fieldsid.plant.laws.parameter_law import authority_law, other_law
from fieldsid.plant.parameter_source import load_parameter_source
from fieldsid.rounding import nine_digits

UP, DOWN = np.nextafter(1.4, 2.0), np.nextafter(1.4, 1.0)
SPEEDS = np.array([1.0, 1.3, 1.5, 1.9, 2.0])
NAMES = tuple("abcde")
FLOOR = Noise(0.003, 0.003)


@pytest.fixture(scope="module")
def record():
    return record_of(hidden_lag.runs()[1], Axis.YAW)


@pytest.mark.parametrize("value", [1.4, 0.1, -3.0, 1e-5, 12345.678])
def test_nine_digits_are_alike_for_what_differs_by_rounding_and_not_for_what_does_not(value):
    assert nine_digits(np.nextafter(value, 1e9)) == nine_digits(value) == nine_digits(np.nextafter(value, -1e9))
    assert nine_digits(value * (1.0 + 1e-7)) != nine_digits(value)


@pytest.mark.parametrize("speeds", [(1.4, UP, DOWN), (UP, DOWN, 1.4), (DOWN, 1.4, UP)])
def test_of_runs_at_one_speed_the_middle_one_is_held_back_whatever_their_last_bits(record, speeds):
    runs = [replace(record, name=f"run{i}", speed=speed) for i, speed in enumerate(speeds)]
    _, unseen, _ = holdout_split(runs)
    assert [r.name for r in unseen] == ["run1"]


def test_of_runs_at_several_speeds_the_middle_speed_is_held_back(record):
    runs = [replace(record, name=f"{speed}", speed=speed) for speed in (1.8, 1.0, 1.4)]
    assert [r.name for r in holdout_split(runs)[1]] == ["1.4"]


@pytest.mark.parametrize("slope", [0.0, 0.003])
def test_a_signal_that_is_straight_but_for_rounding_is_smoothed_to_itself(slope):
    time = np.arange(600) * 0.05
    values = np.nextafter(1.4 + slope * time, np.where(np.arange(600) % 7 < 3, 9.0, -9.0))
    np.testing.assert_array_equal(gcv_smooth(time, values)[0], values)


@pytest.mark.parametrize("value", [0.1, 0.3, 0.7, 1e-3])
@pytest.mark.parametrize("size", [50, 331, 997])
def test_what_stays_goes_with_nothing(value, size):
    assert (shifted_correlations(np.full(size, value), np.sin(np.arange(size)), 2) == 0.0).all()


@pytest.mark.parametrize("value", [0.1, 0.3, 0.7, 0.8, 1.1, 2.3])
@pytest.mark.parametrize("speeds", [(1.0, 1.5, 2.0), (0.8, 1.2, 1.6), (1.0, 1.4, 1.8), tuple(SPEEDS)], ids=str)
def test_a_damping_alike_at_every_speed_is_constant(value, speeds):
    law = other_law("a22", np.array(speeds), np.full(len(speeds), value), None, NAMES)
    assert law.chosen == "constant"
    assert all(point.belongs for point in law.points)
    assert all(np.isnan(line.r2) for line in law.candidates)


@pytest.mark.parametrize("factor", [0.1, 0.3, 0.6, 0.7, 1.9, 2.3])
@pytest.mark.parametrize("scale", [1.0, 1.7, 0.3])
def test_an_authority_that_goes_with_the_square_of_the_speed_goes_through_zero(factor, scale):
    law = authority_law("b2", 1.0, scale * SPEEDS, factor * SPEEDS**2, None, NAMES)
    assert law.chosen == "through_zero"
    assert law.exponent.p_against_2 > 0.5
    assert all(point.belongs for point in law.points)


@pytest.mark.parametrize(
    "values",
    [
        (0.63, 0.50, 0.57, 0.57, 0.53, 0.58, 0.58, 0.76, 0.58, 0.70, 0.59, 0.71),
        (0.48, 0.57, 0.62, 0.53, 0.49, 0.47, 0.62, 0.73, 0.64, 0.60, 0.62, 0.63),
        (0.44, 0.63, 0.45, 0.57, 0.61, 0.61, 0.67, 0.58, 0.64, 0.64, 0.67, 0.70),
    ],
)
def test_at_two_speeds_the_line_is_taken_for_it_and_the_parabola_leave_the_same(values):
    law = other_law("a22", np.repeat([1.1, 1.3], 6), np.array(values), None, "abcdefghijkl")
    line, parabola = (law.candidate(kind) for kind in ("linear", "affine"))
    assert line.r2 == pytest.approx(parabola.r2, rel=1e-12)
    assert law.chosen == "linear"


def model_at(folder, name, speed):
    values = {"a22": 1.2, "b2": -1.6, "C0": 0.0}
    model = Model(Axis.YAW, (), values, {}, tuple(values), np.eye(3) * 1e-4, SpeedLaw(speed), Noise(0.005, 0.005))
    return save_model(model, folder / f"{name}.yaml")


@pytest.mark.parametrize("speeds", [(1.4, UP), (UP, 1.4), (1.4, 1.4)])
def test_models_of_one_speed_share_every_speed_alike(tmp_path, speeds):
    source = load_parameter_source([model_at(tmp_path, f"m{i}", speed) for i, speed in enumerate(speeds)])
    for speed in (1.0, 1.4, 2.0):
        assert source.near(speed) == [(0, 0.5), (1, 0.5)]


@pytest.mark.parametrize("bits", [(1.0, 1.0), (1.0, 1.0 - 1e-15), (1.0 - 1e-15, 1.0)])
def test_the_first_of_grid_points_that_cost_the_same_is_taken(bits):
    assert _first_least(np.array([[3.0, *bits, 2.0], [1.0, 0.9, 0.9, 0.9]])).tolist() == [1, 1]


@pytest.mark.parametrize(
    ("gained", "kind"), [(1e-9, "disturbance"), (-1e-9, "disturbance"), (0.1, "disturbance"), (5.0, "coloured")]
)
def test_white_noise_is_of_the_first_kind_whatever_the_last_bit_says(monkeypatch, gained, kind):
    likelihoods = {"disturbance": 1000.0, "coloured": 1000.0 + gained}
    monkeypatch.setattr(
        noise_kind, "fit_maximum_likelihood", lambda *of: SimpleNamespace(noise_kind=of[-1], log_likelihood=likelihoods[of[-1]])
    )
    monkeypatch.setattr(noise_kind, "has_sensor_colour", lambda _judged: False)
    monkeypatch.setenv("FIELDSID_IS_WORKER", "1")
    start = SimpleNamespace(problem=None, x=None)
    assert noise_kind.fit_base(start, FLOOR, FLOOR, ParallelMap((), ())).noise_kind == kind


@pytest.mark.parametrize(("speeds", "asks"), [((1.4, UP), False), ((1.4, 1.42), True)])
def test_the_other_law_of_the_speed_is_asked_for_runs_of_several_speeds_only(monkeypatch, record, speeds, asks):
    records = [replace(record, speed=speed) for speed in speeds]
    groups = speed_groups(records)
    problem = SimpleNamespace(layout=SimpleNamespace(groups=groups), records=records)
    h = SimpleNamespace(likelihood_fit=SimpleNamespace(fitted=SimpleNamespace(problem=problem, x=np.zeros(3))), validation=())
    monkeypatch.setattr(speed_law_search, "_snapped", lambda *_of, **_how: (None, None))
    monkeypatch.setattr(speed_law_search, "under_other_speed_law", lambda *_of: (None, None))
    monkeypatch.setattr(speed_law_search, "_better", lambda *_of: "asked")
    monkeypatch.setattr(speed_law_search, "leaves_error", lambda *_of: True)
    found = speed_law_search.other_speed_law(h, SimpleNamespace(floor=FLOOR))
    assert found == ("asked" if asks else None)
