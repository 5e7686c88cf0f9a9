"""Third-party data: a real ship model's zig-zags fitted on some runs and compared on another, a simulated vehicle's effects."""

from __future__ import annotations

import numpy as np
import pytest

from fieldsid.fitting.fit import fit
from fieldsid.fitting.predict.goodness_of_fit import goodness_of_fit
from fieldsid.fitting.predict.predict import predict
from fieldsid.logs import Run, segment
from fieldsid.logs.load import load_run
from fieldsid.models.axis import Axis
from fieldsid.models.record import record_of

pytestmark = pytest.mark.field


@pytest.fixture(scope="module")
def ship(shared_data):
    def load(name):
        t = np.loadtxt(shared_data / "kvlcc2" / f"HSVA_CPMC_KVLCC2_Z_{name}.dat", skiprows=4, encoding="cp1252")
        names = {"yaw_rad": 3, "yaw_rate_rad_s": 6, "rudder_rad": 8}
        signals = {n: np.deg2rad(t[:, i]) for n, i in names.items()} | {"surge_m_s": t[:, 4], "sway_m_s": t[:, 5]}
        return record_of(Run(name, t[:, 0], signals), Axis.YAW)

    return {name: load(name) for name in ("10_05", "15_05", "20_05", "30_05")}


def unseen(ship, effects):
    found = fit([ship[n] for n in ("10_05", "20_05", "30_05")], Axis.YAW, effects=effects)
    assert found.model.method == "output_error"
    return goodness_of_fit([predict(found.model, ship["15_05"])]).rate_fit


@pytest.mark.slow
def test_a_zigzag_is_predicted_better_with_every_effect_that_is_there(ship):
    first, drag, sway = (unseen(ship, e) for e in ((), ("quadratic_damping",), ("quadratic_damping", "sway_coupling")))
    assert first > 68.0
    assert drag > max(first, 76.0)
    assert sway > max(drag, 83.0)


def product_of_errors(found):
    return np.prod(np.sqrt(np.mean(found.predictions[0].residual ** 2, axis=1)))


def test_of_a_ship_whose_turns_bend_more_than_any_law_the_sign_at_rest_is_left_open(ship):
    """By the square of the rate it would turn by itself, by the fourth power it is neutral: its sway is not in the model."""
    said = {n.code: n.data for n in fit([ship["10_05"]], Axis.YAW).notes}
    assert "hidden_instability" not in said
    assert abs(said["slope_at_rest"]["value"]) < 2.0 * said["slope_at_rest"]["std_error"]


@pytest.mark.parametrize(
    "effects",
    [
        pytest.param(("servo_lag",), id="servo_lag"),
        pytest.param(("wave",), id="wave", marks=pytest.mark.slow),
        pytest.param(("servo_lag", "sway_coupling", "quadratic_damping"), id="three", marks=pytest.mark.slow),
    ],
)
def test_a_fit_with_effects_is_never_worse_than_the_plain_one(shared_data, effects):
    run = load_run(shared_data / "lauv" / "rudder_v1.50.csv.gz")
    record = record_of(segment(run, Axis.YAW).of(run), Axis.YAW)
    size = [product_of_errors(fit([record], Axis.YAW, method="output_error", effects=e)) for e in ((), effects)]
    assert size[1] < 0.99 * size[0]
