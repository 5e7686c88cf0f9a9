"""Third-party vehicle (not ours, not in the repository): radius, measured circles and honest bands."""

from __future__ import annotations

import pytest
from ruamel.yaml import YAML

from fieldsid.fitting.identify import identify
from fieldsid.logs import load_run
from fieldsid.models.axis import Axis
from fieldsid.models.model import save_model
from fieldsid.plant.parameter_source import load_parameter_source
from fieldsid.turning.measured.measured_turn import measure_turn
from fieldsid.turning.radius import turn_radius

pytestmark = pytest.mark.field

SPEEDS = ("1.00", "1.25", "1.50", "1.70", "1.90")
EFFECTS = ("servo_lag", "sway_coupling", "quadratic_damping")


@pytest.fixture(scope="module")
def truth(shared_data):
    return YAML(typ="safe").load((shared_data / "lauv" / "truth.yaml").read_text())


def models(folder, shared_data, kinds, effects):
    paths, runs = [], []
    for v in SPEEDS:
        logs = [load_run(shared_data / "lauv" / f"{k}_v{v}.csv.gz") for k in kinds]
        (fit,) = identify(logs, Axis.YAW, effects=effects, joint=len(logs) > 1)
        paths.append(save_model(fit.model, folder / f"m{v}.yaml"))
        runs += logs
    return load_parameter_source(paths), runs


@pytest.mark.slow
def test_pulses_and_zigzag_predict_full_rudder_within_five_percent_both_sides(tmp_path, shared_data, truth):
    source, runs = models(tmp_path, shared_data, ("rudder", "zigzag"), EFFECTS)
    prediction = turn_radius(source, [float(v) for v in SPEEDS], truth["delta_max_rad"], runs=runs)
    for row in prediction.rows:
        side = "circle_stbd" if row.side == "starboard" else "circle_port"
        wanted = truth["speeds"][f"{row.speed:.2f}"][side]["R_circle_m"]
        assert row.radius == pytest.approx(wanted, rel=0.05), (row.speed, row.side)
        assert row.interval95[0] <= wanted <= row.interval95[1], (row.speed, row.side)


@pytest.mark.parametrize("effects", [pytest.param((), id="plain"), pytest.param(EFFECTS, id="effects", marks=pytest.mark.slow)])
def test_pulses_alone_are_extrapolated_and_their_band_holds_the_truth(tmp_path, shared_data, truth, effects):
    source, runs = models(tmp_path, shared_data, ("rudder",), effects)
    for row in turn_radius(source, [float(v) for v in SPEEDS], truth["delta_max_rad"], runs=runs).rows:
        wanted = truth["speeds"][f"{row.speed:.2f}"]["circle_stbd"]["R_circle_m"]
        assert row.trust == "extrapolated"
        assert row.interval95[0] <= wanted <= row.interval95[1], (row.speed, row.side)


@pytest.mark.parametrize("kind", ["circle_stbd", "circle_port", "circle_half_stbd"])
@pytest.mark.parametrize("v", SPEEDS)
def test_measured_circle_is_the_true_one_within_half_a_percent(shared_data, truth, kind, v):
    turn = measure_turn(load_run(shared_data / "lauv" / f"{kind}_v{v}.csv.gz"))
    assert turn.circle.radius == pytest.approx(truth["speeds"][v][kind]["R_circle_m"], rel=0.005)
    assert turn.side == ("port" if kind == "circle_port" else "starboard")


@pytest.mark.slow
def test_a_u_turn_at_one_speed_helps_the_others_and_is_no_settled_circle(tmp_path, shared_data, truth):
    source, runs = models(tmp_path, shared_data, ("rudder",), EFFECTS)
    u_turn = load_run(shared_data / "lauv" / "uturn_v1.50.csv.gz")
    speeds = [float(v) for v in SPEEDS]
    alone = turn_radius(source, speeds, truth["delta_max_rad"], runs=runs)
    helped = turn_radius(source, speeds, truth["delta_max_rad"], runs=runs, measured=[u_turn])
    for before, row in zip(alone.rows, helped.rows, strict=True):
        side = "circle_stbd" if row.side == "starboard" else "circle_port"
        wanted = truth["speeds"][f"{row.speed:.2f}"][side]["R_circle_m"]
        assert row.radius == pytest.approx(wanted, rel=0.05), (row.speed, row.side)
        assert abs(row.radius - wanted) < abs(before.radius - wanted), (row.speed, row.side)
        assert row.interval95[0] <= wanted <= row.interval95[1], (row.speed, row.side)
        assert row.interval95[1] - row.interval95[0] < 0.6 * (before.interval95[1] - before.interval95[0])


@pytest.mark.slow
def test_a_circle_at_half_rudder_counts_as_a_run(tmp_path, shared_data, truth):
    source, runs = models(tmp_path, shared_data, ("rudder",), EFFECTS)
    half = load_run(shared_data / "lauv" / "circle_half_stbd_v1.50.csv.gz")
    (starboard,) = (
        r for r in turn_radius(source, [1.5], truth["delta_max_rad"], runs=runs, measured=[half]).rows if r.side == "starboard"
    )
    wanted = truth["speeds"]["1.50"]["circle_stbd"]["R_circle_m"]
    assert starboard.trust != "measured"
    assert starboard.radius == pytest.approx(wanted, rel=0.04)
