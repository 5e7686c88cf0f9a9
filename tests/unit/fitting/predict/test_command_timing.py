"""Jumps of a command between two samples: found where the log rounds them, left alone where something else is wrong."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from truth import maneuvers
from truth.logbook import flown
from truth.noise import Clock
from truth.physics import Physics

from fieldsid.fitting.fit import fit
from fieldsid.fitting.predict import command_timing, speed_correction
from fieldsid.fitting.predict.command_timing import correlation_length, jumps_of
from fieldsid.fitting.predict.predict import predict
from fieldsid.logs.run import Run
from fieldsid.models.axis import Axis
from fieldsid.models.model import Model, Noise
from fieldsid.models.record import part_of, record_of
from fieldsid.models.speed_law import SpeedLaw

SPEED, LAG = 1.5, 0.2
ANGLE, RATE = 0.003, 0.003
FAST, SLOW = Clock(0.005, 8000), Clock(0.05, 800)
HULL = Physics(damping=2.0, authority=-4.0, nominal_speed=SPEED, servo_tau=LAG)


def flight(clock, *, seed=1, gust=0.0, angle=0.4):
    """A zig-zag whose rule looks at the heading at the clock's rate, as canonical columns at 20 Hz."""
    plan = maneuvers.zigzag(clock.time, 0.26, angle)
    log = flown(HULL, clock, plan, angle_noise=ANGLE, rate_noise=RATE, gust=gust, seed=seed)
    return {name: values[:: round(SLOW.sample / clock.sample)] for name, values in log.items()}, log


def recorded(log):
    return record_of(Run("zigzag", log["time_s"], {k: v for k, v in log.items() if k != "time_s"}), Axis.YAW)


def model(*effects, **values):
    known = {"a22": 2.0, "b2": -4.0, "C0": 0.0} | values
    return Model(Axis.YAW, effects, known, {}, (), np.zeros((0, 0)), SpeedLaw(SPEED), Noise(ANGLE, RATE))


TRUE = model("servo_lag", lag=LAG)


def errors(shown):
    return np.sqrt(np.mean(shown.residual**2, axis=1)) / (ANGLE, RATE)


@pytest.fixture(scope="module")
def rounded():
    """A log at 20 Hz of a rule that switches at 200 Hz, and when it switched before the samples, s."""
    slow, fast = flight(FAST)
    switched = fast["time_s"][np.flatnonzero(np.abs(np.diff(fast["rudder_rad"])) > 0.1) + 1]
    record = recorded(slow)
    return record, record.time[jumps_of(record)] - switched


def test_the_log_rounds_its_jumps(rounded):
    _, early = rounded
    assert early.size >= 8
    assert np.ptp(early) > 0.025
    assert early.min() >= 0.0
    assert early.max() < SLOW.sample


def test_jumps_between_samples_are_timed_to_milliseconds_and_the_error_falls_to_the_noise(rounded, monkeypatch):
    record, early = rounded
    shown = predict(TRUE, record)
    with monkeypatch.context() as patch:
        patch.setattr(command_timing, "MAX_JUMPS", 0)
        patch.setattr(speed_correction, "MAX_STD_ERRORS", 0.0)
        held = predict(TRUE, record)
    assert shown.record.command_lead is not None
    np.testing.assert_allclose(shown.record.command_lead[jumps_of(record)], early, atol=0.006)
    assert (errors(shown) < 1.06).all()
    assert held.record.command_lead is None
    assert held.as_logged is None
    assert errors(held)[1] > 1.15
    assert shown.as_logged == pytest.approx(np.sqrt(np.mean(held.residual**2, axis=1)), rel=1e-2)
    note = command_timing.timing_note(shown.record)
    assert note is not None
    assert note.data["jumps"] == early.size
    assert note.data["mean_s"] == pytest.approx(early.mean(), abs=0.003)


def test_a_model_that_was_fitted_to_rounded_logs_is_helped_as_well(rounded):
    record, early = rounded
    fitted = fit([recorded(flight(FAST, seed=2, angle=0.47)[0])], Axis.YAW, method="output_error", effects=("servo_lag",)).model
    shown = predict(fitted, record)
    assert fitted.values["lag"] < LAG - 0.01
    assert shown.record.command_lead is not None
    assert shown.record.command_lead[jumps_of(record)].mean() < early.mean() - 0.01
    assert shown.as_logged is not None
    assert errors(shown)[1] < 0.6 * shown.as_logged[1] / RATE


def test_jumps_at_the_samples_stay_there():
    record = recorded(flight(SLOW)[0])
    assert predict(TRUE, record).record.command_lead is None
    assert command_timing.timing_note(record) is None


def test_a_shift_of_the_whole_log_is_left_to_the_effects_that_mean_it():
    record = recorded(flight(SLOW)[0])
    late = replace(record, fin=np.concatenate([record.fin[:1], record.fin[:-1]]))
    shown = predict(TRUE, late)
    assert shown.record.command_lead is None
    assert errors(shown)[1] > 1.3


@pytest.mark.parametrize(
    "wrong",
    [model(), model("servo_lag", lag=0.1), model("servo_lag", lag=LAG, b2=-3.6)],
    ids=["no servo lag", "too short a lag", "too weak a fin"],
)
def test_a_model_that_lacks_something_is_not_helped_by_it(wrong):
    record = recorded(flight(SLOW)[0])
    assert predict(wrong, record).record.command_lead is None


def test_a_gust_is_not_taken_for_jumps():
    record = recorded(flight(SLOW, gust=0.02)[0])
    shown = predict(TRUE, record)
    assert errors(shown)[1] > 1.3
    assert shown.record.command_lead is None


def test_a_fin_that_is_measured_or_always_moves_has_no_jumps(rounded):
    record, _ = rounded
    assert jumps_of(replace(record, fin_is_held=False)).size == 0
    assert jumps_of(replace(record, fin=0.2 * np.sin(record.time))).size == 0
    assert jumps_of(replace(record, fin=0.2 * np.sign(np.sin(30.0 * record.time)))).size == 0
    assert jumps_of(replace(record, fin=np.zeros(len(record)))).size == 0


@pytest.mark.parametrize(("early", "interval", "share"), [(0.02, -1, 0.4), (-0.02, 0, 0.6)], ids=["early", "late"])
def test_a_command_beside_its_sample_is_in_the_path_with_its_exact_area(rounded, early, interval, share):
    record, _ = rounded
    jump = int(jumps_of(record)[0])
    times = np.zeros(len(record))
    times[jump] = early
    path, place = replace(record, command_lead=times).commanded, jump + interval
    before, after = record.fin[jump - 1], record.fin[jump]
    assert path.mean[place] == pytest.approx(before + share * (after - before), abs=1e-12)
    ends = sorted((path.start[place], path.end[place]))
    assert min(before, after) - 1e-12 <= ends[0]
    assert ends[1] <= max(before, after) + 1e-12
    np.testing.assert_allclose(np.delete(path.mean, place), np.delete(record.commanded.mean, place), atol=1e-12)


def test_an_early_time_is_cut_with_its_record(rounded):
    record, _ = rounded
    times = np.linspace(0.0, 0.02, len(record))
    part = part_of(replace(record, command_lead=times), slice(0, 100))
    np.testing.assert_array_equal(part.command_lead, times[:100])
    assert len(part.commanded.mean) == 99


def test_the_correlation_length_of_white_and_of_smooth_values():
    white = np.random.default_rng(1).standard_normal(4000)
    assert correlation_length(white, 40) < 1.3
    smooth = np.convolve(white, np.ones(9) / 9.0, mode="valid")
    assert correlation_length(smooth, 40) == pytest.approx(9.0, rel=0.3)


@pytest.mark.parametrize("missing", ["yaw_rad", "yaw_rate_rad_s"])
def test_one_channel_is_enough(missing):
    log, _ = flight(FAST)
    record = recorded({k: v for k, v in log.items() if k != missing})
    shown = predict(TRUE, record)
    assert shown.record.command_lead is not None
    assert (shown.record.command_lead[jumps_of(record)] < SLOW.sample + 1e-9).all()
    assert np.isnan(shown.as_logged).sum() == 1
