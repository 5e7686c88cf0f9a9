"""Parameters over months: a change is found where it is, none where there is none, and odd runs are no change."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta

import numpy as np
import pytest

from fieldsid.batch.trend import change_points, scatter_of, trends_of
from fieldsid.figures.drawn import rendered
from fieldsid.figures.trend import figure
from fieldsid.models.axis import Axis

DAY = datetime(2026, 1, 1, tzinfo=UTC)


def archive(b2, error=0.02, speeds=1.5, seed=1, scatter=0.0):
    rng, count = np.random.default_rng(seed), len(b2)
    speeds = np.broadcast_to(speeds, count)
    noise = rng.normal(0.0, np.hypot(error, scatter), count)
    return [
        {
            "run": f"r{i}", "status": "done", "start_utc": (DAY + timedelta(days=i)).isoformat(), "speed_m_s": float(speeds[i]),
            "a22": 1.0 * float(speeds[i]) / 1.5 + float(rng.normal(0.0, 0.03)), "a22_std_error": 0.03,
            "b2": (float(b2[i]) + float(noise[i])) * float(speeds[i] / 1.5) ** 2,
            "b2_std_error": error * float(speeds[i] / 1.5) ** 2, "C0": 0.0, "C0_std_error": 0.001,
        }
        for i in range(count)
    ]  # fmt: skip


def test_a_swapped_payload_is_found_on_its_day_with_its_size():
    rows = archive(np.r_[np.full(30, -1.2), np.full(25, -0.98)])
    by_name = {t.name: t for t in trends_of(rows, Axis.YAW)}
    (change,) = by_name["b2"].changes
    assert change.run in {"r29", "r30", "r31"}
    assert by_name["b2"].drift is None
    assert change.share == pytest.approx(-0.22 / 1.2, abs=3.0 * change.std_error / 1.2)
    assert by_name["a22"].changes == ()


def test_a_slow_drift_is_told_as_one_and_not_as_steps_at_dates():
    truth = np.linspace(-1.2, -0.9, 20)
    by_name = {t.name: t for t in trends_of(archive(truth, seed=4), Axis.YAW)}
    b2 = by_name["b2"]
    assert b2.changes == ()
    assert b2.drift is not None
    assert b2.drift.after - b2.drift.before == pytest.approx(0.3, abs=3.0 * b2.drift.std_error)
    assert 0.005 < b2.drift.std_error < 0.03
    assert by_name["a22"].drift is None
    assert rendered(figure(tuple(by_name.values()), "yaw")).axes


def test_runs_at_other_speeds_are_carried_to_one():
    rows = archive(np.full(40, -1.2), speeds=np.tile([1.0, 1.5, 2.0, 1.5], 10))
    assert all(t.changes == () for t in trends_of(rows, Axis.YAW))
    (b2,) = (t for t in trends_of(rows, Axis.YAW) if t.name == "b2")
    assert b2.speed == 1.5
    np.testing.assert_allclose(b2.values, -1.2, atol=0.15)


@pytest.mark.parametrize("scatter", [pytest.param(0.0, marks=pytest.mark.slow), 0.06])
def test_false_alarms_are_rare_with_and_without_scatter_of_the_runs(scatter):
    alarms = 0
    for seed in range(200):
        trends = trends_of(archive(np.full(40, -1.2), seed=seed, scatter=scatter), Axis.YAW)
        alarms += any(t.changes or t.drift for t in trends if t.name == "b2")
    assert alarms <= 16  # of 200: 8 %


def test_scatter_beyond_the_errors_is_measured_and_nothing_where_there_is_none():
    rng = np.random.default_rng(5)
    errors = np.full(400, 0.02)
    assert scatter_of(rng.normal(0.0, np.hypot(0.02, 0.05), 400), errors) == pytest.approx(0.05, rel=0.15)
    assert scatter_of(rng.normal(0.0, 0.01, 400), errors) == 0.0


def test_one_odd_run_is_no_change_and_a_run_that_knows_nothing_is_left_out():
    values = np.full(30, -1.2)
    values[12] = -0.2
    rows = archive(values)
    rows[20] |= {"b2": 40.0, "b2_std_error": 50.0}
    (b2,) = (t for t in trends_of(rows, Axis.YAW) if t.name == "b2")
    assert b2.values.size == 28
    assert b2.changes == ()


def test_several_changes_are_cut_as_the_least_sum_wants():
    values = np.r_[np.zeros(10), np.full(10, 5.0), np.full(10, -3.0)]
    anywhere = np.ones(30, dtype=bool)
    assert change_points(values, np.ones(30), anywhere).tolist() == [10, 20]
    assert change_points(np.zeros(30), np.ones(30), anywhere).tolist() == []
    anywhere[10] = False
    assert change_points(values, np.ones(30), anywhere).tolist() != [10, 20]


def test_runs_of_one_date_have_no_order_and_no_trend():
    rows = archive(np.r_[np.full(10, -1.2), np.full(10, -0.6)])
    assert trends_of([row | {"start_utc": DAY.isoformat()} for row in rows], Axis.YAW) == ()


def test_few_runs_have_no_trend():
    assert trends_of(archive(np.full(5, -1.2)), Axis.YAW) == ()


def test_every_date_of_the_figure_is_whole_and_one_of_them_tells_the_year():
    sheet = rendered(figure(trends_of(archive(np.r_[np.full(30, -1.2), np.full(25, -0.98)]), Axis.YAW), "yaw"))
    sheet.draw_without_rendering()
    bottom = sheet.axes[-1].xaxis
    assert bottom.get_offset_text().get_text() == ""
    written = [t for t in bottom.get_ticklabels() if t.get_text()]
    assert any("2026" in t.get_text() for t in written)
    low, high = sheet.bbox.x0, sheet.bbox.x1
    inside = [t.get_window_extent() for t in written]
    assert all(low <= box.x0 and box.x1 <= high for box in inside if low <= box.x0 <= high)
