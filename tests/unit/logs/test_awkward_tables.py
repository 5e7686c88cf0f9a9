"""Tables as instruments and people write them: each gives its flight, or is refused with the reason that is true."""

from __future__ import annotations

import datetime as dt

import numpy as np
import pytest
from look_alikes import flight

from fieldsid.errors import FieldsidError
from fieldsid.logs.inspection import inspect_log, write_proposal
from fieldsid.logs.load import load_run

F = flight(step=0.1, length_s=120.0, seed=21)
T = np.round(F["time"], 1)
N = T.size
START = dt.datetime(2026, 3, 14, 23, 59, 13, 400000, tzinfo=dt.UTC)
YAW = np.degrees(F["yaw"]) % 360.0


def text(values, decimals=1):
    return [f"{v:.{decimals}f}" for v in values]


TIME, H, R = text(T), text(YAW, 3), text(np.degrees(F["rudder"]), 3)


def moments(form, cut=0):
    stamps = [(START + dt.timedelta(seconds=float(t))).strftime(form) for t in T]
    return [s[: len(s) - cut] for s in stamps]


def table(head, *columns, separator=","):
    return "\n".join([head, *(separator.join(row) for row in zip(*columns, strict=True))]) + "\n"


def timed(cells, name="time"):
    return table(f"{name},heading,rudder", cells, H, R)


def imported(tmp_path, content):
    """The run by the mapping that is proposed and written, and what was found."""
    path = tmp_path / "log.csv"
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    found = inspect_log(path)
    return load_run(path, write_proposal(found, tmp_path / "proposed.yaml")), found


def same_flight(run, *, atol_s=2e-3):
    assert len(run) == N
    np.testing.assert_allclose(run.time - run.time[0], T, atol=atol_s)
    off = run["yaw_rad"] - F["yaw"]
    np.testing.assert_allclose(off - 2 * np.pi * np.round(off / (2 * np.pi)), 0.0, atol=1e-3)
    np.testing.assert_allclose(run["rudder_rad"], F["rudder"], atol=1e-4)


OFF_S = 5e-3
TIMES = {
    "a zone behind a stamp": timed(moments("%Y-%m-%d %H:%M:%S.%f UTC")),
    "summer time behind a stamp": timed(moments("%Y-%m-%d %H:%M:%S.%f CEST")),
    "a zone behind a clock": timed(moments("%H:%M:%S.%fZ")),
    "a zone and a blank behind a clock": timed(moments("%H:%M:%S.%f GMT")),
    "a week of the year": timed(moments("%G-W%V-%uT%H:%M:%S.%f")),
    "a day of the year": timed(moments("%Y-%jT%H:%M:%S.%f")),
    "digits and a line between": timed(moments("%Y%m%d_%H%M%S.%f")),
    "digits alone": timed(moments("%Y%m%d%H%M%S.%f", 5)),
    "digits with milliseconds": timed(moments("%Y%m%d%H%M%S%f", 3)),
    "months in capitals": timed([m.upper() for m in moments("%d-%b-%Y %H:%M:%S.%f")]),
    "a month before its day": timed([f'"{m}"' for m in moments("%b %d, %Y %I:%M:%S.%f %p")]),
    "the C library's words": timed(moments("%a %b %d %H:%M:%S %Y")),
    "days and a clock that have passed": timed([f"0 days 00:{int(t // 60):02d}:{t % 60:09.6f}" for t in T]),
    "more than a day": timed([f"30:{int(t // 60):02d}:{t % 60:04.1f}" for t in T], "elapsed"),
    "days of a spreadsheet with five decimals": timed(text(46095.99946 + T / 86400.0, 5)),
    "days since year 0 with six decimals": timed(text(740055.99946 + T / 86400.0, 6)),
    "days of the year": timed(text(73.2 + T / 86400.0, 9), "yday"),
    "samples that were sent five at a time": timed(text(np.floor(T / 0.5) * 0.5)),
    "the digits of a clock and of a date": table(
        "UTC Time,UTC Date,heading,rudder", moments("%H%M%S.%f", 4), moments("%d%m%y"), H, R
    ),
    "hours of the day and a date": table(
        "date,hour,heading,rudder", moments("%Y-%m-%d"), text((86353.4 + T) % 86400.0 / 3600.0, 8), H, R
    ),
}  # fmt: skip


@pytest.mark.parametrize("kind", TIMES)
def test_a_time_as_it_is_written_somewhere_is_read(tmp_path, kind):
    run, _ = imported(tmp_path, TIMES[kind])
    same_flight(run, atol_s=OFF_S)


FORMS = {
    "a line below the names": "time | heading | rudder\n-----+---------+-------\n"
    + "\n".join(map(" | ".join, zip(TIME, H, R, strict=True))) + "\n",
    "a table of markdown": "| time | heading | rudder |\n|---|:---:|---:|\n"
    + "\n".join(f"| {' | '.join(row)} |" for row in zip(TIME, H, R, strict=True)) + "\n",
    "names of two words between blanks": "Time  True Heading   Rudder Cmd\n"
    + "\n".join(f"{t:>6} {h:>10} {r:>8}" for t, h, r in zip(TIME, H, R, strict=True)) + "\n",
    "the names again in the middle": timed(TIME)[: len("time,heading,rudder\n")]
    + "time,heading,rudder\n".join("\n".join(timed(TIME).splitlines()[a:b]) + "\n" for a, b in ((1, 600), (600, None))),
    "zero bytes at the end": timed(TIME).encode() + bytes(4096),
    "a byte order mark": b"\xef\xbb\xbf" + timed(TIME).encode(),
}  # fmt: skip


@pytest.mark.parametrize("kind", FORMS)
def test_a_table_as_it_is_laid_out_somewhere_is_read(tmp_path, kind):
    run, _ = imported(tmp_path, FORMS[kind])
    same_flight(run)


@pytest.mark.parametrize("cell", ["#N/A", "#VALUE!", "#DIV/0!", "########", "1.#QNAN", "-1.#IND00", "-nan(ind)", "--"])
def test_a_cell_that_says_there_is_no_number_costs_no_other(tmp_path, cell):
    heading = [cell if i % 60 == 30 else h for i, h in enumerate(H)]
    run, found = imported(tmp_path, table("time,heading,rudder", TIME, heading, R))
    assert len(run) == N
    np.testing.assert_allclose(run["rudder_rad"], F["rudder"], atol=1e-4)
    assert np.isnan(run["yaw_rad"]).sum() == N // 60
    said = [n for n in found.notes if n.code == "error_cells"]
    assert [n.data["count"] for n in said] == ([N // 60] if "#" in cell else [])


def test_a_comment_is_still_one(tmp_path):
    lines = timed(TIME).splitlines()
    lines[5:5] = ["#### a note, of two parts", "# N/A, said the pilot"]
    lines[90] += " # turning"
    run, found = imported(tmp_path, "\n".join(lines) + "\n")
    same_flight(run)
    assert "error_cells" not in {n.code for n in found.notes}


REFUSED = {
    "an epoch that a spreadsheet rounded": (timed(["1.77E+09"] * N), "time repeats in column `time`", "1199 of 1199"),
    "whole minutes": (timed(moments("%d/%m/%Y %H:%M")), "time repeats in column `time`", "1197 of 1199"),
    "the last row first": (table("time,heading,rudder", TIME[::-1], H[::-1], R[::-1]), "time goes backwards in column", "1199"),
    "words": (timed([f"sample {t}" for t in TIME]), "column `time` has rows without a time", "'sample 0.0'"),
    "a comma from the middle on": (
        table("time;heading;rudder", [t if i < 600 else t.replace(".", ",") for i, t in enumerate(TIME)], H, R, separator=";"),
        "column `time` holds cells that are no times",
        "600 of 1200, the first in row 601: '60,0'",
    ),
}


@pytest.mark.parametrize("kind", REFUSED)
def test_a_time_that_is_none_is_refused_with_the_reason(tmp_path, kind):
    content, what, found = REFUSED[kind]
    path = tmp_path / "log.csv"
    path.write_text(content)
    inspection = inspect_log(path)
    (note,) = (n for n in inspection.notes if n.code == "not_importable")
    assert what in note.message
    assert found in note.message
    mapping = write_proposal(inspection, tmp_path / "proposed.yaml")
    with pytest.raises(FieldsidError) as error:
        load_run(path, mapping)
    assert error.value.what.split(" in ")[0] in note.message


@pytest.mark.parametrize(("unit", "turn"), [("cdeg", 36000), ("ddeg", 3600), ("gon", 400), ("deg", 360)])
def test_a_heading_is_in_the_unit_in_which_it_wraps(tmp_path, unit, turn):
    heading = text(YAW / 360.0 * turn, 2)
    run, found = imported(tmp_path, table("time,hdg,rudder", TIME, heading, R))
    assert found.proposal.body["signals"]["yaw_rad"]["unit"] == unit
    same_flight(run)


@pytest.mark.parametrize(
    ("heading", "said"),
    [
        (text(F["yaw"] + 4.0, 4), "in radians that would be"),
        ([str(round(h / 360.0 * 65536) % 65536) for h in YAW], "182 turns (limit 10)"),
    ],
)
def test_a_heading_that_may_be_in_another_unit_is_said(tmp_path, heading, said):
    _, found = imported(tmp_path, table("time,heading,rudder", TIME, heading, text(F["rudder"], 4)))
    assert any(said in n.message for n in found.notes if n.code == "unit")


def test_degrees_that_nothing_speaks_against_are_not_doubted(tmp_path):
    _, found = imported(tmp_path, timed(TIME))
    assert not {"unit", "evidence"} & {n.code for n in found.notes}


def test_a_row_that_lost_its_time_counts_among_even_steps(tmp_path):
    lines = timed(TIME).splitlines()
    lines[601] = "\0" * 40 + lines[601]
    path = tmp_path / "log.csv"
    path.write_text("\n".join(lines) + "\n")
    found = inspect_log(path)
    run = load_run(path, write_proposal(found, tmp_path / "proposed.yaml"), salvage=True)
    np.testing.assert_allclose(run.time, np.delete(T, 600), atol=1e-9)


def test_the_number_of_the_row_is_no_time_where_another_column_goes_on_by_even_steps(tmp_path):
    path = tmp_path / "rows.txt"
    path.write_text(table("", map(str, range(N)), text(T + 1000.0), H, text(np.degrees(F["rate"]), 3), R).lstrip("\n"))
    assert inspect_log(path).proposal.body["time"]["column"] == 1
