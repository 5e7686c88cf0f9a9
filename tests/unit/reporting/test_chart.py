"""Charts as SVG: well-formed, every word escaped, what is drawn where the data say."""

from __future__ import annotations

import xml.etree.ElementTree as ET

import numpy as np
import pytest

from fieldsid.figures.panel import Band, Bar, Bars, Panel, Series
from fieldsid.reporting.chart import MOST_POINTS, WIDTH, bars, chart, legend, nice_ticks, thinned

X = np.linspace(0.0, 10.0, 11)


def parsed(text):
    return ET.fromstring(text)  # noqa: S314 - our own


def test_a_chart_is_well_formed_whatever_a_run_is_called():
    evil = Series(X, X, "simulated", '<script>"&')
    root = parsed(chart([panel := Panel("a < b", (evil,), x="time, s")], '"quoted" & <b>'))
    assert root.find("title").text == '"quoted" & <b>'
    assert root.find(".//polyline").get("data-name") == '<script>"&'
    assert "<script>" not in legend([panel])


def test_a_line_lies_where_its_data_are():
    root = parsed(chart([Panel("y", (Series(X, 2 * X, "simulated"),), height=100)], "t"))
    (panel,) = root.findall("svg")
    low, high = (float(panel.get(f"data-y{i}")) for i in (0, 1))
    first, *_, last = ([float(v) for v in p.split(",")] for p in root.find(".//polyline").get("points").split())
    width = float(panel.get("width"))
    assert (first[0], last[0]) == pytest.approx((0.0, width))
    assert high - (high - low) * last[1] / 100 == pytest.approx(20.0, abs=0.02)
    assert high - (high - low) * first[1] / 100 == pytest.approx(0.0, abs=0.02)


def test_what_was_not_measured_is_not_drawn():
    y = np.where(X < 5, X, np.nan)
    root = parsed(chart([Panel("y", (Series(X, y, "measured", "m", "dots"),))], "t"))
    assert root.find(".//path").get("d").count("M") == 5


def test_a_band_goes_there_and_back_and_points_have_their_errors():
    points = Series(X, X, "measured", "m", "points", np.full(11, 0.5))
    root = parsed(chart([Panel("y", (points,), (Band(X, X - 1, X + 1, "simulated"),))], "t"))
    assert len(root.find(".//polygon").get("points").split()) == 22
    assert [p.get("class") for p in root.findall(".//path")] == ["errors measured", "points measured"]


def test_panels_share_one_axis_and_stand_below_each_other():
    root = parsed(chart([Panel("a", (Series(X, X, "simulated"),)), Panel("b", (Series(X, -X, "second"),))], "t"))
    first, second = root.findall("svg")
    assert float(second.get("y")) >= float(first.get("y")) + float(first.get("height"))
    assert root.get("viewBox").split()[2] == str(WIDTH)
    assert [t.text for t in root.find("g").findall("text")] == ["0", "2", "4", "6", "8", "10"]


def test_bars_are_as_long_as_their_values():
    root = parsed(bars(Bars("error", [Bar("a", 3.0, "3", 2.0), Bar("b", 0.75, "0.75")], mark="noise"), "t"))
    long, short = (float(r.get("width")) for r in root.findall("rect"))
    assert long == pytest.approx(4 * short, rel=0.01)
    (ring,) = root.findall("circle")
    assert float(ring.get("cx")) - float(root.find("rect").get("x")) == pytest.approx(long * 2 / 3, rel=0.01)
    assert root.find("line").get("x1") == root.find("line").get("x2")


def test_ticks_are_round_and_inside():
    assert nice_ticks(0.13, 0.87, 4) == [0.2, 0.4, 0.6, 0.8]
    assert nice_ticks(5.0, 5.0, 4) == [5.0]
    assert nice_ticks(-20.0, 20.0, 4) == [-20.0, -10.0, 0.0, 10.0, 20.0]


def test_a_long_line_is_thinned_and_keeps_its_ends_near():
    x, y = thinned(np.arange(100_000.0), np.zeros(100_000))
    assert x.size == y.size <= MOST_POINTS
    assert x[-1] > 99_000


@pytest.mark.parametrize("size", [0.0004, 0.0015, 0.015, 900.0, 90000.0])
def test_a_ticks_number_fits_its_margin_with_its_sign(size):
    y = np.linspace(-size, size, 11)
    root = parsed(chart([Panel("y", (Series(X, y, "simulated"),))], "t"))
    said = [t.text for t in root.iter("text") if t.get("text-anchor") == "end"]
    assert any(t.startswith("\u2212") for t in said)
    assert max(len(t) for t in said) <= 7
    assert all(
        float(t.replace("\u2212", "-")) == pytest.approx(-float(u.replace("\u2212", "-")))
        for t, u in zip(said, said[::-1], strict=True)
    )
