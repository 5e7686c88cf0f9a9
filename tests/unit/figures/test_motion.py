"""The four panels show what was measured and simulated, in degrees, with gaps left open."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

from fieldsid.dynamics.free_run import command_record
from fieldsid.errors import ArtifactError
from fieldsid.figures import canvas, motion
from fieldsid.figures.drawn import rendered
from fieldsid.figures.panel import Picture
from fieldsid.fitting.predict.predict import Prediction
from fieldsid.models.axis import Axis
from fieldsid.models.model import Noise


@pytest.fixture
def view():
    time = np.arange(0.0, 10.0, 0.05)
    fin = np.where((time > 2) & (time < 4), 0.2, 0.0)
    seen = np.ones(time.size, dtype=bool)
    seen[50:60] = False
    record = replace(
        command_record(Axis.YAW, time, fin, speed=1.5), angle=0.1 * time, angle_ok=seen, rate=0.1 + 0 * time, rate_ok=seen
    )
    return Prediction(record, 0.1 * time + 0.01, 0.1 + 0 * time, fin, (0.0, 0.0, 0.0), {})


def drawn(view):
    panels = motion.panels([("simulated", "simulated", view)], Noise(0.005, 0.004), ((2.0, 4.0),))
    return rendered(Picture("run7", (9.0, 8.2), (panels,)))


def lines(ax):
    return {line.get_label(): line for line in ax.lines}


def test_panels_show_degrees_with_units_on_every_axis(view):
    figure = drawn(view)
    angle, rate, fin, residual = figure.axes
    assert [ax.get_ylabel() for ax in figure.axes] == ["yaw, deg", "yaw rate, deg/s", "rudder, deg", "residual / noise"]
    assert residual.get_xlabel() == "time, s"
    np.testing.assert_allclose(lines(angle)["simulated"].get_ydata(), np.degrees(view.angle))
    np.testing.assert_allclose(lines(fin)["command"].get_ydata(), np.degrees(view.record.fin))
    assert rate.get_xlim() == (view.record.time[0], view.record.time[-1])


def test_residual_is_measured_less_simulated_over_the_noise_and_open_in_a_gap(view):
    shown = lines(drawn(view).axes[3])["angle"].get_ydata()
    np.testing.assert_allclose(shown[view.record.angle_ok], -0.01 / 0.005)
    assert np.isnan(shown[50:60]).all()


def test_fin_of_the_model_is_drawn_only_where_it_differs_from_the_command(view):
    assert "fin in the model" not in lines(drawn(view).axes[2])
    moved = replace(view, fin=view.fin + 0.01)
    assert "fin in the model" in lines(drawn(moved).axes[2])


def test_many_samples_are_thinned_to_what_the_eye_can_tell_apart():
    ax = canvas.sheet(9.0, 7.0).add_subplot()
    canvas.dots(ax, np.arange(1e5), np.zeros(100_000))
    assert ax.lines[0].get_xdata().size <= canvas.MOST_DOTS


def test_a_figure_is_saved_whole_and_never_over_an_old_one(view, tmp_path):
    path = canvas.save(drawn(view), tmp_path / "a.png")
    with Image.open(path) as image:
        assert image.size[0] > 800
    before = path.read_bytes()
    with pytest.raises(ArtifactError, match="exists"):
        canvas.save(drawn(view), path)
    assert path.read_bytes() == before
    assert [p.name for p in tmp_path.iterdir()] == ["a.png"]
