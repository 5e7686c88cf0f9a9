"""Figures of law, turn and schedule show the numbers they are given: points, bands, circles, hollow rows."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from truth.paper import YAW

from fieldsid.figures import canvas, law, schedule, turn
from fieldsid.figures.drawn import rendered
from fieldsid.models.axis import Axis
from fieldsid.plant.laws.axis_laws import fit_laws
from fieldsid.plant.parameter_source import ParameterSource
from fieldsid.plant.points import Point
from fieldsid.schedule.make import design_schedule
from fieldsid.schedule.verify import verify_schedule
from fieldsid.turning.measured.circle import fit_circle
from fieldsid.turning.measured.measured_turn import MeasuredTurn
from fieldsid.turning.radius import turn_radius


@pytest.fixture(scope="module")
def source():
    points = tuple(Point(f"row {i}", r.speed, {"a22": r.a22, "b2": r.b2, "C0": r.C0}, {}) for i, r in enumerate(YAW))
    return ParameterSource(Axis.YAW, points, (), (), fit_laws(Axis.YAW, points), ())


def axes_of(figure):
    return [ax for ax in figure.get_axes() if ax.axison]


def test_law_figure_has_the_authority_against_u_squared_with_its_verdict(source, tmp_path):
    figure = rendered(law.figure(source.laws))
    main, *others = axes_of(figure)
    assert main.get_xlabel() == "u², m²/s²"
    assert "not u^2" in main.get_title(loc="left").replace("\n", " ")
    labels = [t.get_text() for t in main.get_legend().get_texts()]
    assert any("taken" in text for text in labels)
    assert len(others) == 2
    assert canvas.save(figure, tmp_path / "law.png").stat().st_size > 10_000


@pytest.mark.parametrize("count", [5, 40])
def test_turn_figure_draws_both_sides_with_their_bands(source, count):
    prediction = turn_radius(source, list(np.linspace(1.1, 2.1, count)), 0.26, draws=40)
    radius, time = axes_of(rendered(turn.figure(prediction)))
    assert {"port, predicted", "starboard, predicted"} <= {t.get_text() for t in radius.get_legend().get_texts()}
    assert time.get_xlabel() == "speed before the turn, m/s"
    assert radius.get_ylim()[0] == 0.0
    bands = radius.collections if count > 12 else radius.containers
    assert len(bands) >= 2


def test_track_figure_draws_the_circle_with_its_radius():
    time = np.linspace(0.0, 40.0, 400)
    x, y = 3.0 * np.cos(0.4 * time), 3.0 * np.sin(0.4 * time)
    circle = fit_circle(time, x, y, 0.4 * time + 0.5 * np.pi)
    measured = MeasuredTurn("run", "starboard", circle, -0.3, 1.5, 1.2, 0.0, 40.0, (x, y), (x, y))
    top, bottom = axes_of(rendered(turn.track_figure(measured)))
    assert any("R = 3.000" in t.get_text() for t in top.get_legend().get_texts())
    assert top.get_aspect() == 1.0
    assert bottom.get_ylabel() == "off the circle, m"


def test_schedule_figure_has_hollow_rows_where_data_do_not_support_them(source):
    made = design_schedule(source, 0.26, speeds=[0.7, 1.4, 2.0])
    verified = verify_schedule(made, source, draws=5)
    left, (small, usual, large, fin) = schedule.figure(made, verified).columns
    gains, forward, margins = (next(p for p in left if p.label.startswith(name)) for name in ("kp", "feed", "phase"))
    hollow, known = (next(s for s in gains.series if s.form == form) for form in ("rings", "points"))
    assert list(hollow.x) == [0.7]
    assert list(known.x) == [1.4, 2.0]
    assert margins.from_zero
    assert [len(p.series) for p in (small, usual, large)] == [10, 10, 10]
    assert [p.label for p in (small, usual, large)] == [f"{d}° step, deg" for d in (5, 20, 90)]
    leg = schedule.figure(made, replace(verified, disturbance=0.01)).columns[0][-1]  # none where the runs had no disturbance
    assert len(leg.series) == 5
    assert "as the runs had, up to 0.01 rad/s²" in leg.title
    asked = {s.name: float(s.y[0]) for s in margins.series if s.dashed}
    assert asked == {"asked": 45.0, "of 95 % of the draws": 22.5}
    assert forward.limits[0] <= -1.0
    assert forward.limits[1] >= 1.0
    assert [float(s.y[0]) for s in fin.series if s.dashed] == pytest.approx([-np.degrees(0.26), np.degrees(0.26)])
    assert "at its limit for up to" in fin.title
    assert axes_of(rendered(schedule.figure(made, verified)))[0].get_ylim()[1] >= 0.0
