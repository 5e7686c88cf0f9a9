"""The whole prediction: methods, trust, bands, measured turns, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest
from truth.paper import YAW

from fieldsid.errors import ModelError, UsageError
from fieldsid.logs.run import Run
from fieldsid.models.axis import Axis
from fieldsid.models.effect import effect_named
from fieldsid.models.model import Model, Noise, save_model
from fieldsid.models.speed_law import SpeedLaw
from fieldsid.plant.laws.axis_laws import save_laws
from fieldsid.plant.parameter_source import load_parameter_source
from fieldsid.turning.model_error import DataCoverage, data_coverage, model_error
from fieldsid.turning.radius import turn_radius

FULL = {"fin_max": 0.3, "rate_max": 0.5, "held_s": 30.0, "speed_low": 1.0, "speed_high": 2.0}
PULSES = {"fin_max": 0.3, "rate_max": 0.2, "held_s": 2.0, "speed_low": 1.5, "speed_high": 1.5}


def table(folder, rows=YAW, offset=True):
    lines = ["speed_m_s,a22,b2" + (",C0" if offset else "")]
    lines += [f"{r.speed},{r.a22},{r.b2}" + (f",{r.C0}" if offset else "") for r in rows]
    path = folder / "table.csv"
    path.write_text("\n".join(lines) + "\n")
    return load_parameter_source([path])


def source_of(folder, trained, effects=("quadratic_damping",), **values):
    own = {"a22": 1.2, "b2": -1.6, "C0": 0.01, "quadratic": 1.0} | values
    if "quadratic_damping" not in effects:
        own.pop("quadratic")
    covariance = np.diag([(0.02 * abs(v)) ** 2 for v in own.values()])
    model = Model(Axis.YAW, effects, own, {}, tuple(own), covariance, SpeedLaw(1.5), Noise(0.005, 0.005), trained)
    return load_parameter_source([save_model(model, folder / "model.yaml", force=True)])


def test_a_table_goes_by_the_formula_and_is_extrapolated(tmp_path):
    prediction = turn_radius(table(tmp_path), [1.36, 1.63], 0.26)
    assert {r.side for r in prediction.rows} == {"port", "starboard"}
    assert all(r.method == "u_turn" and r.trust == "extrapolated" and r.because for r in prediction.rows)
    assert all(r.interval95[0] < r.radius < r.interval95[1] for r in prediction.rows)
    assert all("turning_circle" in r.settle_with for r in prediction.rows)
    assert any(n.code == "offset_not_counted" for n in prediction.notes)


def test_an_offset_of_a_degree_or_more_sets_the_sides_apart(tmp_path):
    path = tmp_path / "case.csv"
    path.write_text("speed_m_s,a22,b2,delta_r0_rad\n1.37,2.15,-1.62,-0.064\n")
    port, starboard = turn_radius(load_parameter_source([path]), [1.37], 0.26).rows
    assert port.radius == pytest.approx(9.74, abs=0.06)
    assert starboard.radius < 0.7 * port.radius


def test_effects_are_simulated_and_the_steady_circle_is_the_radius(tmp_path):
    row = turn_radius(source_of(tmp_path, FULL), [1.5], 0.3).rows[0]
    assert row.method == "simulated"
    assert row.radius == row.steady_radius
    assert row.turn_speed < 1.5
    assert np.isfinite([row.advance, row.transfer, row.tactical_diameter]).all()


@pytest.mark.parametrize("method", ["u_turn", "steady"])
def test_a_formula_says_what_of_the_model_is_not_in_it_and_is_not_called_the_models_own(method, tmp_path):
    found = turn_radius(source_of(tmp_path, FULL), [1.5], 0.3, method=method)
    assert all(np.isnan(row.of_model) for row in found.rows)
    assert any(n.code == "effects_not_in_formula" and "quadratic_damping" in n.message for n in found.notes)
    plain = turn_radius(source_of(tmp_path, FULL, effects=()), [1.5], 0.3, method=method)
    assert all(row.of_model > 0.0 for row in plain.rows)
    assert "effects_not_in_formula" not in {n.code for n in plain.notes}


def test_a_fit_file_turns_as_its_models_do(tmp_path):
    paths = []
    for speed in (1.0, 2.0):
        own = {"a22": 0.8 * speed, "b2": -0.7 * speed**2, "C0": 0.0, "quadratic": 2.0}
        covariance = np.diag([(0.02 * v) ** 2 for v in own.values()])
        law = SpeedLaw(speed)
        model = Model(Axis.YAW, ("quadratic_damping",), own, {}, tuple(own), covariance, law, Noise(0.005, 0.005), FULL)
        paths.append(save_model(model, tmp_path / f"{speed}.yaml"))
    fit = save_laws(load_parameter_source(paths).laws, tmp_path / "law.yaml", models=paths)
    of_models, of_law = (turn_radius(load_parameter_source(given), [1.0, 1.5], 0.3, draws=100).rows for given in (paths, [fit]))
    assert [r.method for r in of_law] == ["simulated"] * 4
    assert of_law == of_models
    with pytest.raises(UsageError, match="goes with the formula"):
        turn_radius(load_parameter_source([fit], laws=["b2=-2"]), [1.5], 0.3)
    assert (
        turn_radius(load_parameter_source([fit], laws=["b2=-2"]), [1.5], 0.3, method="u_turn", draws=50).rows[0].method
        == "u_turn"
    )


def test_data_that_reached_the_turn_are_trusted_and_pulses_are_not(tmp_path):
    reached = turn_radius(source_of(tmp_path, FULL), [1.5], 0.3).rows[0]
    pulses = turn_radius(source_of(tmp_path, PULSES), [1.5], 0.3).rows[0]
    assert reached.trust == "identified"
    assert not reached.extrapolated
    assert pulses.trust == "extrapolated"
    assert {"a yaw rate this high was not reached", "no turn was held long enough to settle"} <= set(pulses.because)
    width = [r.interval95[1] - r.interval95[0] for r in (reached, pulses)]
    assert width[1] > 1.4 * width[0]


def test_a_speed_outside_the_data_is_said(tmp_path):
    prediction = turn_radius(source_of(tmp_path, FULL), [2.6], 0.3)
    assert prediction.rows[0].because == ("this speed was not flown",)
    assert any(n.code == "outside_support" for n in prediction.notes)


def circle(name, *, radius=4.0, speed=1.5, fin=0.3, approach=15.0):
    """A run straight on for some seconds, then round to starboard for two circles at the same speed."""
    time = np.arange(0.0, approach + 4.0 * np.pi * radius / speed, 0.1)
    rate = np.where(time < approach, 0.0, speed / radius)
    yaw = np.concatenate([[0.0], np.cumsum(0.1 * rate[:-1])])
    steps = speed * 0.1 * np.stack([np.cos(yaw), np.sin(yaw)])
    x, y = np.concatenate([np.zeros((2, 1)), np.cumsum(0.5 * (steps[:, 1:] + steps[:, :-1]), axis=1)], axis=1)
    rudder = np.where(rate > 0, -fin, 0.0)
    surge = np.full(time.size, speed)
    signals = {"yaw_rad": yaw, "yaw_rate_rad_s": rate, "x_m": x, "y_m": y, "rudder_rad": rudder, "surge_m_s": surge}
    return Run(name, time, signals)


def asked_of(folder, *measured, speeds=(1.0, 1.5), rudder=0.3):
    return turn_radius(source_of(folder, PULSES, effects=()), speeds, rudder, measured=measured, draws=50)


def test_what_was_measured_is_not_asked_for_again(tmp_path):
    prediction = asked_of(tmp_path, circle("c1"))
    assert [r.side for r in prediction.rows if r.trust == "measured"] == ["starboard"]
    (said,) = prediction.settling
    assert said.startswith("turning_circle to port at 1.00, 1.50 m/s, to starboard at 1.00 m/s with 0.3 rad")
    assert (
        asked_of(tmp_path, circle("c1"), circle("slow", speed=1.0), speeds=(1.5,))
        .settling[0]
        .startswith("turning_circle to port")
    )


def test_circles_of_another_rudder_are_named_with_how_to_ask_for_them(tmp_path):
    said = asked_of(tmp_path, circle("c1", fin=0.4), circle("c2", fin=0.4, speed=1.0)).settling
    assert said[0] == "with `--fin-max 0.4`, the rudder of those turns, c1, c2 count as measured"
    alone = asked_of(tmp_path, circle("c1", fin=0.4)).settling
    assert alone[0] == "with `--fin-max 0.4`, the rudder of that turn, c1 counts as measured"
    assert said[1].startswith("turning_circle to port at 1.00, 1.50 m/s, to starboard at 1.00, 1.50 m/s with 0.3 rad")
    trusted = [r.trust for r in asked_of(tmp_path, circle("c1", fin=0.4), circle("c2", fin=0.4, speed=1.0), rudder=0.4).rows]
    assert trusted.count("measured") == 2


def test_a_circle_without_its_approach_says_what_it_lacks(tmp_path):
    said = asked_of(tmp_path, circle("c1", approach=0.0)).settling
    assert said[0] == "c1 begins in the turn, so that its speed before it is not known: log the approach too"


def test_nothing_is_asked_for_where_the_data_reached_the_turn(tmp_path):
    assert turn_radius(source_of(tmp_path, FULL), [1.5], 0.3, draws=50).settling == ()


def test_surge_that_was_not_measured_is_said_and_widens_nothing_silently(tmp_path):
    assert any(n.code == "surge_not_measured" for n in turn_radius(source_of(tmp_path, FULL), [1.5], 0.3).notes)


def test_an_unstable_model_is_simulated_with_drag_and_refused_without(tmp_path):
    assert turn_radius(source_of(tmp_path, FULL, a22=-0.2), [1.5], 0.3).rows[0].radius > 0
    with pytest.raises(ModelError, match="a22 <= 0"):
        turn_radius(source_of(tmp_path, FULL, effects=(), a22=-0.2), [1.5], 0.3)
    with pytest.raises(ModelError, match="unstable"):
        turn_radius(source_of(tmp_path, FULL, effects=("servo_lag",), a22=-0.2, lag=0.1), [1.5], 0.3)


@pytest.mark.parametrize(
    ("speeds", "rudder", "method"), [([1.5], 0.0, "auto"), ([1.5], 15.0, "auto"), ([], 0.26, "auto"), ([1.5], 0.26, "magic"),
                                     ([1.5], 0.26, "simulated"), ([-1.0], 0.26, "auto")]
)  # fmt: skip
def test_what_cannot_be_meant_is_refused(tmp_path, speeds, rudder, method):
    with pytest.raises(UsageError) as caught:
        turn_radius(table(tmp_path), speeds, rudder, method=method)
    assert caught.value.hint


def test_a_rudder_below_the_offset_is_refused(tmp_path):
    path = tmp_path / "case.csv"
    path.write_text("speed_m_s,a22,b2,C0\n1.37,2.15,-1.62,0.5\n")
    with pytest.raises(UsageError, match="below the offset"):
        turn_radius(load_parameter_source([path]), [1.37], 0.26)


def test_an_offset_by_an_authority_that_may_be_zero_is_no_offset(tmp_path):
    """It was said that the vehicle turns to one side only, and to trim the fin, for an offset of 0.7 +/- 26 rad."""
    path = tmp_path / "case.csv"
    path.write_text("speed_m_s,a22,b2,C0,a22_std_error,b2_std_error,C0_std_error\n1.37,2.15,-0.02,0.01,0.2,0.03,0.01\n")
    with pytest.raises(ModelError, match=r"b2 cannot be told from zero at 1\.37 m/s"):
        turn_radius(load_parameter_source([path]), [1.37], 0.26)


def test_a_sway_mode_slower_than_any_held_turn_is_named_and_does_not_make_the_turn_endless(tmp_path):
    slow = {"cross_damping": 0.04, "cross_rate": -0.15}
    effects = ("sway_coupling", "quadratic_damping")
    row = turn_radius(source_of(tmp_path, {**FULL, "held_s": 5.0}, effects, **slow), [1.5], 0.3).rows[0]
    assert any("sway settles more slowly" in words for words in row.because)
    whole = turn_radius(source_of(tmp_path, {**FULL, "held_s": 200.0}, effects, **slow), [1.5], 0.3).rows[0]
    assert not any("sway" in words for words in whole.because)
    assert row.radius > 1.3 * whole.radius


def test_the_minimum_of_the_upper_branch_is_found(tmp_path):
    source = load_parameter_source(table(tmp_path).paths, laws=["a22=1", "b2=-0.2319,-0.3263", "C0=0"])
    prediction = turn_radius(source, [round(0.25 + 0.05 * i, 2) for i in range(96)], 0.26, draws=50)
    best = prediction.best("port")
    assert best.speed == pytest.approx(3.7, abs=0.051)
    assert best.radius == pytest.approx(5.75, abs=0.01)
    assert prediction.rows[0].radius == pytest.approx(4.0, abs=0.02)


def test_doubt_shrinks_as_the_data_reach_further():
    near = data_coverage(FULL, fin=0.3, rate=0.5, quarter_s=5.0, speed_flown=True)
    far = data_coverage(PULSES, fin=0.5, rate=0.5, quarter_s=5.0, speed_flown=True)
    assert near.missing == ()
    assert len(far.missing) == 3
    for effects, formula in (((), True), ((), False), ((effect_named("sway_coupling"),), False)):
        a, b = model_error(effects, near, formula=formula), model_error(effects, far, formula=formula)
        assert a.sd < b.sd
        assert a.mean < b.mean


def test_doubt_of_a_short_pulse_covers_the_errors_met_in_turning_trials():
    """Formula against turning trials of other vehicles: -43 .. +13 %."""
    doubt = model_error((), DataCoverage(float("nan"), float("nan"), float("nan"), speed_flown=True), formula=True)
    low, high = doubt.mean - 1.96 * doubt.sd, doubt.mean + 1.96 * doubt.sd
    assert low <= np.log(1.0 / 1.13)
    assert high >= np.log(1.0 / 0.57)
