"""An end of the heading's range where a compass read fails goes; a heading that is there stays, to the last bit."""

import numpy as np
import pytest
from truth.commanded import Commanded, pulses

from fieldsid.fitting.fit import fit
from fieldsid.logs import Run
from fieldsid.logs.convert.clock import Track
from fieldsid.logs.convert.faults.heading_fills import without_fills, without_standing_start
from fieldsid.logs.convert.heading_unwrap import unwrapped_over
from fieldsid.logs.load import load_run
from fieldsid.models.axis import Axis
from fieldsid.models.record import record_of

TIME = 0.1 * np.arange(600)
TURNING = 0.9 * np.sin(0.2 * TIME) + 0.02 * TIME
"""A heading about north, which it passes several times."""


def wrapped(heading, low):
    return low + np.mod(heading - low, 2 * np.pi)


@pytest.mark.parametrize(("low", "fill"), [(0.0, 0.0), (0.0, 2 * np.pi), (-np.pi, np.pi), (-np.pi, -np.pi)])
@pytest.mark.parametrize("share", [0.01, 0.15, 0.4])
@pytest.mark.parametrize("noise", [0.0, 0.004, 0.03])
def test_the_fills_go_and_every_true_sample_stays(low, fill, share, noise):
    rng = np.random.default_rng(8)
    true = TURNING - low - 0.3 + noise * rng.standard_normal(TIME.size)
    logged, filled = wrapped(true, low), rng.random(TIME.size) < share
    logged[filled] = fill
    mended, notes = without_fills(Track(TIME, logged))
    mended, more = unwrapped_over(mended)
    left = np.isfinite(mended.values)
    assert left[~filled].all()
    np.testing.assert_allclose(np.ptp(mended.values[~filled] - true[~filled]), 0.0, atol=1e-9)
    away = np.abs(np.mod(true - fill + np.pi, 2 * np.pi) - np.pi) > 0.5
    assert not left[filled & away].any()
    assert [n.code for n in (*notes, *more)] == ["dropouts"]


@pytest.mark.parametrize("same", [True, False])
def test_a_heading_held_at_north_and_interpolated_the_long_way_round_is_no_fill(same):
    """Held at 0.00, with single samples on the way to 359.9: there what is between goes on from nothing."""
    logged = wrapped(np.where(TIME < 30.0, 0.03 * (TIME - 30.0), 0.0), 0.0)
    places = np.arange(330, 590, 25)
    logged[places] = np.pi if same else np.random.default_rng(2).uniform(1.0, 5.0, places.size)
    mended, notes = without_fills(Track(TIME, logged))
    np.testing.assert_array_equal(mended.values, logged)
    assert notes == []


@pytest.mark.parametrize("digits", [0, 1, 2])
def test_a_heading_that_passes_north_exactly_stays(digits):
    logged = np.radians(np.mod(np.round(np.degrees(TURNING), digits), 360.0))
    mended, notes = without_fills(Track(TIME, logged))
    assert (logged == 0.0).any()
    np.testing.assert_array_equal(mended.values, logged)
    assert notes == []


def test_a_number_inside_the_range_is_left_to_the_doctor():
    logged = 2.0 + 0.5 * np.sin(0.2 * TIME)
    logged[::20] = 1.9
    mended, notes = without_fills(Track(TIME, logged))
    np.testing.assert_array_equal(mended.values, logged)
    assert notes == []


def test_what_was_put_in_comes_back_from_a_log_with_fills(tmp_path):
    commands = pulses(0.0)
    angle = Commanded(*commands, 1.2, 0.9).motion(TIME)[0] + np.random.default_rng(4).normal(0.0, 0.003, TIME.size)
    heading = np.mod(np.degrees(angle) + 350.0, 360.0)
    heading[np.random.default_rng(5).random(TIME.size) < 0.15] = 0.0
    fin = np.degrees(commands[1][np.searchsorted(commands[0], TIME + 1e-6, side="right") - 1])
    path = tmp_path / "log.csv"
    rows = (f"{t:.1f},{y:.2f},{d:.4f}" for t, y, d in zip(TIME, heading, fin, strict=True))
    path.write_text("\n".join(["time_s,yaw_deg,rudder_deg", *rows]) + "\n")
    run = load_run(path)
    assert isinstance(run, Run)
    found = fit([record_of(run, Axis.YAW)], Axis.YAW, method="output_error").model
    assert found.values["a22"] == pytest.approx(1.2, rel=0.03)
    assert found.values["b2"] == pytest.approx(0.9, rel=0.03)


def start_at(heading, rate, count=25):
    """Write exact zeros into the first samples of a heading and its rate, as a driver does before its sensor is ready."""
    rows = np.arange(TIME.size) < count
    return {
        "yaw_rad": Track(TIME, np.where(rows, 0.0, heading), "heading"),
        "yaw_rate_rad_s": Track(TIME, np.where(rows, 0.0, rate), "gyro"),
        "rudder_rad": Track(TIME, np.zeros(TIME.size), "rudder"),
    }


def test_the_samples_before_a_compass_is_ready_belong_to_no_run():
    tracks, (note,) = without_standing_start(start_at(3.5 + TURNING, np.gradient(TURNING, TIME)))
    assert [int(np.isnan(t.values).sum()) for t in tracks.values()] == [25, 25, 0]
    assert note.message.startswith("yaw_rad, yaw_rate_rad_s: the heading stands at exactly 0 until 2.50 s and jumps then")


def test_a_vehicle_that_starts_straight_to_the_north_keeps_its_start():
    turned = np.maximum(TIME - 2.5, 0.0) * 0.2
    tracks = start_at(turned, 0.2 * (TIME >= 2.5))
    same, notes = without_standing_start(tracks)
    assert same == tracks
    assert notes == []
