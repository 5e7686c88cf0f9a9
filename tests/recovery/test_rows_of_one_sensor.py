"""Signals that come at rates and times of their own, in one table with blank cells or as topics: each keeps its own samples."""

from __future__ import annotations

import numpy as np
import pytest
from truth.commanded import Commanded, pulses

from fieldsid import diagnose
from fieldsid.fitting.fit import fit
from fieldsid.logs import load_run
from fieldsid.logs.channels import ChannelMap, Source
from fieldsid.logs.convert.assemble import assemble
from fieldsid.logs.reader import RawLog, Series
from fieldsid.models.axis import Axis
from fieldsid.models.record import record_of

DAMPING, AUTHORITY = 0.8, 0.7
ANGLE, RATE = 0.0035, 0.0026
"""Noise of the sensors, rad and rad/s."""
NAMES = ("rudder_rad", "yaw_rad", "yaw_rate_rad_s")


def told(angle_hz, rate_hz, *, every=0.8, angle_late=0.013, rate_late=0.017):
    """Three signals, each with its times (m,) s and numbers (m,): the command when it changes, the others evenly."""
    commands = pulses(0.037, every=every)
    hull = Commanded(*commands, DAMPING, AUTHORITY)
    at, then = np.arange(angle_late, 80.0, 1.0 / angle_hz), np.arange(rate_late, 80.0, 1.0 / rate_hz)
    rng = np.random.default_rng(3)
    angle, rate = hull.motion(at)[0] + rng.normal(0.0, ANGLE, at.size), hull.motion(then)[1] + rng.normal(0.0, RATE, then.size)
    return dict(zip(NAMES, (commands, (at, angle), (then, rate)), strict=True))


def as_rows(signals, path, *, is_filled=False):
    """A table with a row for each reading, all other cells blank, or filled with the last number of their sensor."""
    rows = sorted((t, i, v) for i, track in enumerate(signals.values()) for t, v in zip(*track, strict=True))
    last, cells = [""] * len(signals), []
    for t, i, v in rows:
        last = [f"{v:.9g}" if i == k else (last[k] if is_filled else "") for k in range(len(signals))]
        cells.append(f"{t:.6f}," + ",".join(last))
    path.write_text("\n".join([",".join(("time_s", *signals)), *cells]) + "\n")
    return load_run(path)


def as_topics(signals):
    series = {name: Series(*track, name) for name, track in signals.items()}
    return assemble(RawLog("log", series, one_clock=False), ChannelMap({n: Source(topic=n) for n in signals}), None)


def fitted(run):
    found = fit([record_of(run, Axis.YAW)], Axis.YAW, method="auto")
    shown = found.predictions[0]
    left = [np.sqrt(np.mean(e[ok] ** 2)) for e, ok in zip(shown.residual, shown.record.ok, strict=True)]
    return found.model.values["a22"], np.array(left) / (found.floor.angle, found.floor.rate)


@pytest.mark.parametrize("is_filled", [False, True])
def test_a_row_for_each_reading_says_what_topics_say(tmp_path, is_filled):
    signals = told(10, 10)
    run = as_rows(signals, tmp_path / "rows.csv", is_filled=is_filled)
    damping, left = fitted(run)
    assert damping == pytest.approx(DAMPING, rel=5e-3)
    np.testing.assert_allclose(left, 1.0, atol=0.08)
    assert {n.code for n in run.notes} <= {"clock", "constant", *(["repeated"] if is_filled else [])}
    topics = as_topics(signals)
    for name in topics.signals:
        np.testing.assert_allclose(run[name], topics[name], atol=1e-7, err_msg=name)


def test_diagnose_finds_nothing_to_add_to_rows_of_one_reading(tmp_path):
    found = diagnose([as_rows(told(10, 10), tmp_path / "rows.csv")], axis="yaw")
    assert (found.verdict, found.effects) == ("sufficient", ())


@pytest.mark.parametrize(("angle_hz", "rate_hz"), [(10, 10), (5, 10), (5, 50), (1, 20), (50, 5), (20, 1)])
def test_the_noise_floor_is_that_of_each_signals_own_samples(angle_hz, rate_hz):
    run = as_topics(told(angle_hz, rate_hz))
    damping, left = fitted(run)
    assert damping == pytest.approx(DAMPING, rel=1e-2)
    assert "missing" not in {n.code for n in run.notes}
    np.testing.assert_allclose(left, 1.0, atol=0.25)


def test_a_slow_sensor_beside_a_fast_one_stays_in_the_rows_of_the_fast_one(tmp_path):
    """A row for all at 20 Hz, the heading in every fourth: the rows are the clock, and a failed cell is a gap in it."""
    signals = told(20, 20, rate_late=0.013)
    time, rate = signals["yaw_rate_rad_s"]
    angle = np.where(np.arange(time.size) % 4 == 0, signals["yaw_rad"][1], np.nan)
    fin = signals["rudder_rad"][1][np.searchsorted(signals["rudder_rad"][0], time, side="right") - 1]
    rate = np.where(np.arange(time.size) % 31 == 0, np.nan, rate)
    table = np.column_stack([time, fin, angle, rate])
    lines = (",".join("" if np.isnan(v) else f"{v:.9g}" for v in row) for row in table)
    path = tmp_path / "all.csv"
    path.write_text("\n".join([",".join(("time_s", *NAMES)), *lines]) + "\n")
    run = load_run(path)
    np.testing.assert_allclose(run.time, time, atol=1e-6)
    np.testing.assert_array_equal(np.isfinite(run["yaw_rad"]), np.isfinite(angle))
    assert "clock" not in {n.code for n in run.notes}
