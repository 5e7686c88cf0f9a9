"""Ways in which tables of the field say time, names and fins: each is the same flight, read without an edit."""

from __future__ import annotations

import datetime as dt

import numpy as np
import pytest
from look_alikes import flight

from fieldsid.logs.inspection import inspect_log
from fieldsid.logs.load import load_run
from fieldsid.logs.mapping.mapping_file import mapping_of

F = flight(step=0.1, length_s=120.0, seed=12)
T, RUDDER = np.round(F["time"], 1), np.degrees(F["rudder"])
HEADING = np.degrees(F["yaw"]) % 360.0
START = dt.datetime(2026, 3, 1, 12, 59, 30, tzinfo=dt.UTC)


def text(values, decimals=3, decimal="."):
    return [f"{v:.{decimals}f}".replace(".", decimal) for v in values]


def moments(form):
    return [(START + dt.timedelta(seconds=float(t))).strftime(form) for t in T]


def table(head, *columns, separator=",", before=()):
    return "\n".join([*before, head, *(separator.join(row) for row in zip(*columns, strict=True))]) + "\n"


def digits(seconds):
    """The digits that a clock shows, as a number."""
    s = np.round(seconds % 86400.0, 1)
    return 1e4 * (s // 3600) + 1e2 * (s // 60 % 60) + s % 60


FIN = text(RUDDER)
H = text(HEADING)
TABLES = {
    "a comma in a clock's seconds, in German": table(
        "Datum;Uhrzeit;Heading [deg];Rudder [deg]", moments("%d.%m.%Y"), [m[:-3] for m in moments("%H:%M:%S,%f")],
        text(HEADING, 3, ","), text(RUDDER, 3, ","), separator=";",
    ),
    "milliseconds behind a colon": table("Time,Heading,Rudder", [m[:-3] for m in moments("%H:%M:%S:%f")], H, FIN),
    "a time of the week that starts again": table("tow_s,heading,rudder", text((604740.0 + T) % 604800.0, 1), H, FIN),
    "whole ms of the week": table("itow,heading,rudder", [str(round(1e3 * (604740.0 + t)) % 604800000) for t in T], H, FIN),
    "the digits of a clock": table(
        "utc,heading,rudder", [m[:-4] for m in moments("%H%M%S.%f")], H, FIN,
    ),
    "the digits of a clock at midnight": table("utc,heading,rudder", text(digits(86370.0 + T), 1), H, FIN),
    "days of a spreadsheet": table("time,heading,rudder", text(46082.54 + T / 86400.0, 8), H, FIN),
    "days since year 0": table("datenum,heading,rudder", text(740042.54 + T / 86400.0, 9), H, FIN),
    "Julian days": table("time,heading,rudder", text(2461100.54 + T / 86400.0, 9), H, FIN),
    "a comment parted by blanks over tabs": table(
        "% s deg deg", text(T, 1), H, FIN, separator="\t", before=("% trial 7", "% t psi rudder"),
    ),
    "decimal commas in quotes": table(
        '"t","heading","rudder"', *([f'"{v}"' for v in text(c, 3, ",")] for c in (T, HEADING, RUDDER)),
    ),
    "a separator behind each row": table("time;heading;rudder;", text(T, 1), H, [f"{v};" for v in FIN], separator=";"),
}  # fmt: skip


def same_flight(run):
    assert len(run) == T.size
    np.testing.assert_allclose(run.time - run.time[0], T - T[0], atol=2e-3)
    off = run["yaw_rad"] - F["yaw"]
    np.testing.assert_allclose(off - 2 * np.pi * np.round(off / (2 * np.pi)), 0.0, atol=1e-3)
    np.testing.assert_allclose(run["rudder_rad"], F["rudder"], atol=1e-4)


@pytest.mark.parametrize("kind", TABLES)
def test_what_is_proposed_for_a_table_gives_its_flight(tmp_path, kind):
    path = tmp_path / "log.csv"
    path.write_text(TABLES[kind])
    found = inspect_log(path)
    same_flight(load_run(path, mapping_of(found.proposal.body)))


def test_a_fin_in_per_cent_is_not_taken_for_degrees(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text(table("time,heading,rudder_percent", text(T, 1), H, text(300.0 * F["rudder"], 1)))
    found = inspect_log(path)
    assert found.proposal.body["signals"]["rudder_rad"] == {"column": "rudder_percent", "unit": "%"}
    assert "counts" in {n.code for n in found.notes}


def test_a_column_that_counts_samples_is_no_time_and_its_rate_makes_it_one(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text(table("sample,heading,rudder", [str(i) for i in range(T.size)], H, FIN))
    found = inspect_log(path)
    assert found.run is None
    (note,) = (n for n in found.notes if n.code == "not_importable")
    assert "`time: {column: sample, rate: 10}`" in note.message
    same_flight(load_run(path, mapping_of({**found.proposal.body, "time": {"column": "sample", "rate": 10}})))


def test_a_table_of_which_only_a_part_is_canonical_needs_a_mapping_for_the_rest(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text(table("time_s,Heading,rudder_deg", text(T, 1), H, FIN))
    found = inspect_log(path)
    assert not found.needs_none
    assert found.run is not None
    same_flight(found.run)
    assert "no_motion" not in {n.code for n in found.notes}


def test_a_comment_of_as_many_words_as_columns_is_no_header(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text(table("# recorded off Pandan", text(T, 1), H, FIN))
    assert [c.name for c in inspect_log(path).inventory.channels] == ["0", "1", "2"]


def test_a_time_is_taken_before_a_time_of_the_week(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text(table("tow,time,heading,rudder", text(np.floor(T), 0), text(T, 1), H, FIN))
    found = inspect_log(path)
    assert found.proposal.body["time"]["column"] == "time"
    same_flight(found.run)


def test_a_time_in_hours_that_nothing_says_is_found(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text(table("time,heading,rudder", text(T / 3600.0, 8), H, FIN))
    (note,) = (n for n in inspect_log(path).notes if n.code == "time_unit")
    assert "`unit: h`" in note.message
    same_flight(
        load_run(
            path,
            mapping_of(
                {
                    "time": {"column": "time", "unit": "h"},
                    "signals": {
                        "yaw_rad": {"column": "heading", "unit": "deg"},
                        "rudder_rad": {"column": "rudder", "unit": "deg"},
                    },
                }
            ),
        )
    )


def test_seconds_with_a_hole_at_a_hundred_are_no_clock(tmp_path):
    path = tmp_path / "log.csv"
    seconds = np.where(T < 60.0, T, T + 47.3)
    path.write_text(table("time,heading,rudder", text(seconds, 1), H, FIN))
    assert inspect_log(path).proposal.body["time"] == {"column": "time", "unit": "s"}
