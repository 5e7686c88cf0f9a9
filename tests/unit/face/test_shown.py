"""What records say of themselves: shortly in a console, wholly as text and HTML, as tables, as figures."""

from __future__ import annotations

import pkgutil
from collections.abc import Iterator, Mapping
from dataclasses import fields, is_dataclass, replace
from importlib import import_module
from math import nan
from xml.etree import ElementTree as ET

import numpy as np
import pandas as pd
import pytest

import fieldsid
from fieldsid.cli.console import out, print_page
from fieldsid.display import LONGEST, Brief, Displayed, Plotted, page_of, view_of
from fieldsid.errors import UsageError
from fieldsid.face.several import Several
from fieldsid.fitting.predict.goodness_of_fit import GoodnessOfFit
from fieldsid.logs import Note
from fieldsid.models.model import Noise
from fieldsid.records.keys import body_of
from fieldsid.registry import members
from fieldsid.rounding import DEGREES, RADIANS
from fieldsid.views._candidates import candidates
from fieldsid.views._words import merit_blocks

KINDS = (
    "Candidate", "Change", "Check", "Comparison", "Diagnosis", "Extension", "Fit", "Laws", "MeasuredRow", "MeasuredTurn", "Model",
    "Row", "Run", "Schedule", "TurnPrediction", "TurnRow", "Verification",
)  # fmt: skip
DRAWN = tuple(k for k in KINDS if k not in ("Candidate", "Check", "MeasuredRow", "Model", "Row", "TurnRow"))
BASE = "a22 = 1.100 +/- 0.013 1/s, b2 = -1.200 +/- 0.021 1/s^2, C0 = 0.0200 +/- 0.0004 rad/s^2"


def classes_of(base: type) -> set[type]:
    below = {c for kind in base.__subclasses__() for c in (kind, *classes_of(kind))}
    return {c for c in below if c.__module__.startswith("fieldsid.")}


def inside(record: object) -> Iterator[object]:
    """All records that one leads to, itself first."""
    yield record
    for field in fields(record):
        value = getattr(record, field.name)
        parts = value.values() if isinstance(value, Mapping) else value if isinstance(value, tuple) else (value,)
        for part in parts:
            if is_dataclass(part):
                yield from inside(part)


def test_every_record_that_shows_itself_has_a_view_and_every_view_a_record():
    for info in pkgutil.walk_packages(fieldsid.__path__, "fieldsid."):
        if not info.name.endswith("__main__"):
            import_module(info.name)
    kinds = {c.__name__ for c in classes_of(Displayed)} - {"Plotted", "Several"}
    assert kinds == set(KINDS)
    assert {c.__name__ for c in classes_of(Plotted)} - {"Several"} == set(DRAWN)
    views = members("fieldsid.views", "VIEW")
    assert {view_of(c).name for c in classes_of(Displayed) if c.__name__ in KINDS} == set(views)


@pytest.mark.parametrize("kind", KINDS)
def test_whatever_a_record_leads_to_has_a_short_repr(held, kind):
    for record in inside(held[kind]):
        assert len(repr(record)) <= LONGEST, type(record)
        assert "\n" not in repr(record)


@pytest.mark.parametrize(
    ("kind", "says"),
    [
        ("Run", "<Run pulses: 400 samples, 20.0 s at 20.0 Hz, 1.40 m/s, 1 note; yaw_rad, yaw_rate_rad_s, rudder_rad, surge_m_s>"),
        ("Model", f"<Model yaw, 1.40 m/s: {BASE}>"),
        ("Fit", f"<Fit yaw, output_error, 2 runs: {BASE}, rate fit 91.7 %, 1 warning>"),
        ("Diagnosis", "<Diagnosis yaw, effect: servo_lag (the fin follows late): from 3.20 to 1.04 x the noise floor, 1 note>"),
        ("Extension", "<Extension servo_lag: the error on unseen data goes from 3.20 to 1.04 x the noise floor, which pays>"),
        ("Laws", "<Laws |b2| as u^2.00 +/- 0.06>"),
    ],
)
def test_a_repr_says_what_matters(held, kind, says):
    assert repr(held[kind]) == says


@pytest.mark.parametrize(
    ("kind", "words"),
    [
        ("Change", ("yaw authority -16.7 +/- ", "damping", "gains")),
        ("Comparison", ("pulses", "fit", "fails most at")),
        ("TurnPrediction", ("tightest turn", "m/s", "extrapolated")),
        ("TurnRow", ("speed_m_s 1.000, side port, radius_m", "trust extrapolated")),
        ("MeasuredTurn", ("circle, starboard: radius 4.0", "fin -0.300 rad", "1.20 m/s")),
        ("Schedule", ("kp -0.", "at 1.00 m/s to -0.", "phase margin")),
        ("Verification", ("hold", "m/s")),
    ],
)
def test_a_repr_of_what_was_worked_out_says_what_matters(held, kind, words):
    assert [w for w in words if w not in repr(held[kind])] == []


def test_a_long_name_leaves_room_for_the_numbers(made):
    run = made.run("x" * 3000)
    assert "400 samples" in repr(run)
    assert len(repr(made.fit(run))) <= LONGEST


def test_a_record_without_a_view_shows_the_shape_of_its_arrays(held):
    history = held["Fit"].history
    assert isinstance(history, Brief)
    shape = "values=float64[400, 1], std_errors=float64[400, 1]"
    assert repr(history) == f"History(time=float64[400], names=('a22',), {shape}, settled_s={{a22: 4}})"


FIT = """\
Fit of the yaw axis
warning: a22 and b2 cannot be told apart (correlation -0.970, limit 0.95) [correlated]

Statistics
  method     output_error
  effects    none
  runs       pulses, zigzag
  speeds     1.40 m/s
  whiteness  p = 0.41
  damping    goes with u^1.00
  authority  goes with u^2

Parameters at 1.40 m/s
  parameter                  value     unit         95 % interval
  a22@1.4          1.100 +/- 0.013      1/s      1.0745 .. 1.1255
  b2@1.4          -1.200 +/- 0.021    1/s^2      -1.241 .. -1.159
  C0             0.0200 +/- 0.0004  rad/s^2    0.01922 .. 0.02078
  delta_r0@1.4  -0.0167 +/- 0.0004      rad  -0.01753 .. -0.01580

Correlations (those below 0.5 are left out)
  a22, b2  -0.70

  run      m/s  angle rms   noise  fit %  rate rms   noise  fit %
  pulses  1.40      0.012  0.0050   91.0    0.0060  0.0040   91.7
  zigzag  1.40      0.012  0.0050   91.0    0.0060  0.0040   91.7
angle in rad, rate in rad/s"""


def test_the_summary_of_a_fit_is_this(held):
    assert held["Fit"].summary() == FIT


EXTENSION = """\
Extension by servo_lag: the error on unseen data goes from 3.20 to 1.04 x the noise floor, which
  pays

Statistics
  effects       servo_lag
  log evidence  +115.3
  fitted to     pulses
  judged on     zigzag

  rms error            before    after  noise floor
  angle, rad, unseen   0.0160  0.00520      0.00500
  angle, rad, fitted   0.0150  0.00500      0.00500
  rate, rad/s, unseen  0.0128  0.00416      0.00400
  rate, rad/s, fitted  0.0120  0.00400      0.00400

Parameters at 1.40 m/s
  parameter                 value     unit         95 % interval
  a22             1.300 +/- 0.013      1/s      1.2745 .. 1.3255
  b2             -1.500 +/- 0.021    1/s^2      -1.541 .. -1.459
  C0            0.0200 +/- 0.0004  rad/s^2    0.01922 .. 0.02078
  lag             0.200 +/- 0.010        s      0.1804 .. 0.2196
  delta_r0   -0.01333 +/- 0.00033      rad  -0.01397 .. -0.01270"""


def test_the_summary_of_an_extension_is_this(held):
    assert held["Extension"].summary() == EXTENSION


def test_the_summary_of_a_diagnosis_begins_with_the_verdict_and_ranks_the_candidates(held):
    text = held["Diagnosis"].summary()
    assert text.startswith("Diagnosis of the yaw axis, effect: servo_lag (the fin follows late)")
    rows = [line.split() for line in text.splitlines()]
    assert ["as", "it", "is", "3.00", "3.20"] in rows
    assert ["servo_lag", "0.970", "1.00", "1.04", "98", "%", "+120"] in rows
    assert "not tried: roll_coupling: needs roll, which the log lacks" in text
    assert "what would settle it: zigzag, it tells the two apart" in text


@pytest.mark.parametrize(("angles", "rudder"), [(RADIANS, "rudder 0.3 rad, "), (DEGREES, "rudder 17.19 deg, ")])
def test_a_console_shows_the_page_of_a_record_in_the_unit_asked_for(held, capsys, angles, rudder):
    print_page(out(), page_of(held["TurnPrediction"], angles))
    assert capsys.readouterr().out.startswith(rudder)


@pytest.mark.parametrize("kind", KINDS)
def test_a_summary_has_no_line_that_ends_in_blanks_and_its_sentences_fit_a_page(held, kind):
    lines = held[kind].summary().splitlines()
    assert lines[0].strip()
    assert [line for line in lines if line != line.rstrip()] == []


@pytest.mark.parametrize("kind", KINDS)
def test_html_is_well_formed_and_says_what_the_summary_says(held, kind):
    page = ET.fromstring(held[kind]._repr_html_())  # noqa: S314 - our own text
    said = " ".join(" ".join(page.itertext()).split())
    title = held[kind].summary().partition("\n")[0]
    assert said.startswith(title[:60])
    assert page.find(".//table") is not None


def test_names_are_escaped_in_html(made):
    name = '<script>alert("a&b")</script>'
    run = made.run(name, notes=[Note("<code>", "it's <b>bold</b> & more")])
    fit = made.fit(run, notes=[Note("<code>", "<i>")])
    for record in (run, fit, fit.model, Several([run, run])):
        html = record._repr_html_()
        assert "<script" not in html
        assert "<b>bold" not in html
        assert "<i>" not in html
        text = "".join(ET.fromstring(html).itertext())  # noqa: S314 - our own text
        assert name in text


@pytest.mark.parametrize("kind", KINDS)
def test_every_part_of_a_record_is_a_table(held, kind):
    parts = view_of(type(held[kind])).frames(held[kind])
    assert parts
    for part in parts:
        assert isinstance(held[kind].to_frame(part), pd.DataFrame)
    pd.testing.assert_frame_equal(held[kind].to_frame(), held[kind].to_frame(next(iter(parts))))


def test_a_part_that_is_not_there_is_refused_with_the_near_match(held):
    with pytest.raises(UsageError) as caught:
        held["Fit"].to_frame("parameter")
    assert caught.value.found == "parameters, runs, correlation, motion"
    assert "`parameters`" in caught.value.hint
    with pytest.raises(UsageError, match="no part 'zigzack'"):
        held["Fit"].plot("zigzack")


def test_the_table_of_a_fit_holds_its_numbers(held):
    fit = held["Fit"]
    table = fit.to_frame()
    assert list(table.columns) == ["value", "std_error", "low95", "high95", "unit"]
    assert table.loc["a22", "value"] == 1.1
    for name in ("b2", "delta_r0"):
        assert tuple(table.loc[name, ["low95", "high95"]]) == fit.interval95(name)
    assert fit.to_frame("correlation").loc["a22", "b2"] == pytest.approx(-0.7)
    motion = fit.to_frame("motion").loc["pulses"]
    np.testing.assert_allclose(motion["angle_rad"] - motion["angle_simulated_rad"], 0.012, rtol=1e-9)


def test_an_interval_of_a_parameter_that_is_not_there_is_refused(held):
    with pytest.raises(UsageError, match="no parameter 'a2'") as caught:
        held["Fit"].interval95("a2")
    assert "`a22`" in caught.value.hint


def test_the_tables_of_turns_and_gains_are_the_rows_that_json_prints(held):
    turns, schedule = held["TurnPrediction"], held["Schedule"]
    assert list(turns.to_frame().columns) == list(body_of(turns.rows[0]))
    assert list(turns.to_frame()["radius_m"]) == [r.radius for r in turns.rows]
    assert list(turns.to_frame("measured")["radius_m"]) == [m.turn.circle.radius for m in turns.measured]
    assert list(schedule.to_frame()["kp"]) == [r.gains.kp for r in schedule.rows]
    assert list(schedule.to_frame().index) == list(schedule.speeds)


DRAWN_BY_COMMANDS = ("Change", "Comparison", "Laws", "Schedule", "TurnPrediction", "Verification")
"""Kinds whose figures the tests of their commands draw in the normal suite."""


@pytest.mark.parametrize("kind", [pytest.param(k, marks=pytest.mark.slow if k in DRAWN_BY_COMMANDS else ()) for k in DRAWN])
def test_every_figure_of_a_record_has_axes_and_is_a_picture_in_a_notebook(held, kind):
    parts = view_of(type(held[kind])).figures(held[kind])
    assert parts
    for part in parts:
        figure = held[kind].plot(part)
        assert [ax for ax in figure.get_axes() if ax.has_data()]
    assert figure._repr_png_().startswith(b"\x89PNG")


def test_the_figure_of_a_run_draws_each_signal_in_its_unit(held):
    run = held["Run"]
    fin, yaw, rate, speed = run.plot().get_axes()
    np.testing.assert_allclose(yaw.lines[0].get_ydata(), np.degrees(run["yaw_rad"]))
    np.testing.assert_allclose(speed.lines[0].get_ydata(), 1.4)
    assert (fin.get_ylabel(), rate.get_ylabel()) == ("fin, deg", "rate, deg/s")


def test_a_name_is_no_formula_in_a_figure(made):
    assert made.run(r"$\frac$").plot()._repr_png_()


def test_several_records_are_a_tuple_that_shows_itself(made):
    runs = Several([made.run("a"), made.run("b", seconds=10.0)])
    assert isinstance(runs, tuple)
    assert repr(runs) == "<2 Run records: a, b>"
    assert repr(Several([])) == "<no records>"
    assert repr(runs[:1]).startswith("(<Run a: 400 samples")
    assert [line for line in runs.summary().splitlines() if line.startswith("Run ")] == ["Run a", "Run b"]
    table = runs.to_frame()
    assert table.index.names == ["run", "time_s"]
    assert len(table.loc["b"]) == 200
    with pytest.raises(UsageError, match="2 records have a figure each"):
        runs.plot()
    assert Several(runs[:1]).plot().get_axes()
    assert len(repr(Several(made.run("r" * 90 + str(i)) for i in range(900)))) <= LONGEST


def test_several_fits_are_one_table_and_their_runs_another(made):
    fits = Several([made.fit(made.run("a")), made.fit(made.run("b"))])
    assert fits.to_frame().loc[("b", "a22"), "value"] == 1.1
    assert list(fits.to_frame("runs").index) == ["a", "b"]


def test_a_record_is_made_anew_with_replace_and_keeps_its_words(held):
    other = replace(held["Run"], name="other")
    assert repr(other).startswith("<Run other: 400 samples")


def test_a_channel_that_was_not_logged_has_no_noise_either():
    floor, merit = Noise(0.005, 1e-7), GoodnessOfFit(0.006, nan, 99.0, nan)
    block, _ = merit_blocks([("run", 1.4, merit, floor)], RADIANS)
    assert block.rows[0] == ("run", "1.40", "0.0060", "0.0050", "99.0", "-", "-", "-")
    base = {side: {"angle_rms_rad": 0.006, "rate_rms_rad_s": None} for side in ("train", "validation")}
    body = {"base": base, "candidates": [], "noise_floor": {"angle_rad": 0.005, "rate_rad_s": 1e-7}}
    assert "over the noise floor, 0.0050 rad; evidence" in candidates(body, RADIANS)[1]
