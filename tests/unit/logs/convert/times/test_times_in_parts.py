"""Times of several columns, and numbers of time that start again: each table is the same flight, read without an edit.

The flight starts 89 s before midnight: it passes a minute, an hour and a day.
"""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from look_alikes import flight

from fieldsid.logs.importing import Importer
from fieldsid.logs.inspection import inspect_log, write_proposal
from fieldsid.logs.load import load_run

RATES = {10: flight(step=0.1, length_s=180.0, seed=12), 5: flight(step=0.2, length_s=180.0, seed=12)}
START_S = 86400.0 - 88.6


def text(values, decimals=0):
    return [f"{v:.{decimals}f}" for v in values]


@cache
def parts(rate):
    """The columns of a clock of this flight, each as it may be written."""
    t = RATES[rate]["time"]
    s = np.round(START_S + t, 6)
    day, of_day = np.floor(s / 86400.0), np.round(s % 86400.0, 6)
    hour, minute, second = np.floor(of_day / 3600.0), np.floor(of_day / 60.0) % 60.0, np.round(of_day % 60.0, 6)
    whole, part = np.floor(second), second - np.floor(second)
    epoch = np.floor(1772323200.0 + s)
    return {
        "year": text(2026 + 0 * t), "yy": text(26 + 0 * t), "month": text(2 + day), "day": text(np.where(day == 0, 28, 1)),
        "doy": text(59 + day), "date": [f"2026-{'02-28' if d == 0 else '03-01'}" for d in day],
        "digits": ["20260228" if d == 0 else "20260301" for d in day], "nmea": ["280226" if d == 0 else "010326" for d in day],
        "h": text(hour), "h.0": text(hour, 1), "m": text(minute), "s.s": text(second, 1), "s": text(whole),
        "0h": [f"{int(x):02d}" for x in hour], "0m": [f"{int(x):02d}" for x in minute], "0s": [f"{x:04.1f}" for x in second],
        "m.m": text(minute + second / 60.0, 6), "hhmm": [f"{int(h):02d}{int(m):02d}" for h, m in zip(hour, minute, strict=True)],
        "hhmmss": text(1e4 * hour + 1e2 * minute + whole), "ms": text(1e3 * part), "us": text(1e6 * part), "ns": text(1e9 * part),
        "cs": text(1e2 * part), "ds": text(1e1 * part),
        "clock": [f"{int(h)}:{int(m):02d}:{int(x):02d}" for h, m, x in zip(hour, minute, whole, strict=True)],
        "epoch": text(epoch), "day_s": text(of_day, 1), "day_h": text(of_day / 3600.0, 8),
        "us32": text(np.round(1e6 * t + 2.0**32 - 9.05e7) % 2.0**32),
        "ms32": text(np.round(1e3 * t + 2.0**32 - 9.05e4) % 2.0**32),
        "ms16": text(np.round(1e3 * t) % 2.0**16), "i32": text((np.round(1e6 * t + 2.06e9) + 2.0**31) % 2.0**32 - 2.0**31),
    }  # fmt: skip


def table(rate, columns):
    """A table of named columns, each a key of `parts`, and of heading and rudder."""
    f, known = RATES[rate], parts(rate)
    cells = [known[key] for _, key in columns] + [text(np.degrees(f["yaw"]) % 360.0, 3), text(np.degrees(f["rudder"]), 3)]
    head = ",".join([*(name for name, _ in columns), "heading", "rudder"])
    return "\n".join([head, *map(",".join, zip(*cells, strict=True))]) + "\n"


def named(names, keys):
    return list(zip(names.split(), keys.split(), strict=True))


TABLES = {
    "hours minutes seconds": named("hours minutes seconds", "h m s.s"),
    "hour minute second": named("hour minute second", "h m s.s"),
    "two letters": named("hh mm ss", "0h 0m 0s"),
    "three letters": named("Hour Min Sec", "h m s.s"),
    "one letter": named("H M S", "h m s.s"),
    "of a receiver": named("GPS_hour GPS_min GPS_sec", "h m s.s"),
    "units of a time": named("time_h time_m time_s", "h m s.s"),
    "floats": named("hours minutes seconds", "h.0 m s.s"),
    "whole seconds": named("hours minutes seconds", "h m s"),
    "a date before": named("date hours minutes seconds", "date h m s.s"),
    "a date of digits": named("date hour min sec", "digits h m s.s"),
    "a date of a receiver": named("date hour min sec", "nmea h m s.s"),
    "year to second": named("year month day hour minute second", "year month day h m s.s"),
    "two letters twice": named("yyyy mm dd HH MM SS", "year month day 0h 0m 0s"),
    "one letter twice": named("Y M D H M S", "yy month day h m s.s"),
    "day first": named("day month year hour min sec", "day month year h m s.s"),
    "day of the year": named("year doy hour min sec", "year doy h m s.s"),
    "a date in parts and a clock": named("year month day time", "year month day clock"),
    "minutes and seconds": named("minute second", "m s.s"),
    "hours and minutes": named("hour minute", "h m.m"),
    "seconds alone": named("seconds", "s.s"),
    "sec alone": named("sec", "s.s"),
    "seconds of minutes that are called time": named("time", "s.s"),
    "hhmm": named("hhmm seconds", "hhmm s.s"),
    "hhmmss and ms": named("hhmmss ms", "hhmmss ms"),
    "sec and msec": named("sec msec", "s ms"),
    "h m s and ms": named("hour minute second millisecond", "h m s ms"),
    "h m s and tenths": named("hh mm ss tenths", "h m s ds"),
    "h m s and hundredths": named("Hour Minute Second CentiSecond", "h m s cs"),
    "unix time": named("unixtime_s unixtime_ms", "epoch ms"),
    "a clock and ms": named("time ms", "clock ms"),
    "a stamp of a message": named("stamp_sec stamp_nanosec", "epoch ns"),
    "an epoch and us": named("time_sec time_usec", "epoch us"),
    "seconds of the day": named("time", "day_s"),
    "hours of the day": named("hours", "day_h"),
    "us of 32 bits": named("time_us", "us32"),
    "us of 32 bits that nothing says": named("timestamp", "us32"),
    "us of 32 bits with a sign": named("time_us", "i32"),
    "ms of 32 bits": named("time_ms", "ms32"),
    "ms of 16 bits": named("millis", "ms16"),
}


def imported(path, tmp_path):
    """The run of a log by the mapping that is proposed and written for it, and what was found."""
    found = inspect_log(path)
    mapping = write_proposal(found, tmp_path / "proposed.yaml", force=True)
    (run,) = Importer(mapping=None, whole=True).read(path) if found.needs_none else [load_run(path, mapping)]
    return run, found


def same_flight(run, rate):
    f = RATES[rate]
    assert len(run) == f["time"].size
    np.testing.assert_allclose(run.time - run.time[0], f["time"], atol=3e-3)
    off = run["yaw_rad"] - f["yaw"]
    np.testing.assert_allclose(off - 2 * np.pi * np.round(off / (2 * np.pi)), 0.0, atol=1e-3)
    np.testing.assert_allclose(run["rudder_rad"], f["rudder"], atol=1e-4)


@pytest.mark.parametrize("rate", [10, pytest.param(5, marks=pytest.mark.slow)])
@pytest.mark.parametrize("kind", TABLES)
def test_a_time_in_parts_or_that_starts_again_is_whole(tmp_path, kind, rate):
    path = tmp_path / "log.csv"
    path.write_text(table(rate, TABLES[kind]))
    run, found = imported(path, tmp_path)
    same_flight(run, rate)
    said = {n.code for n in found.notes}
    if len(TABLES[kind]) > 1:
        assert {"clock_parts", "time_origin"} & said
        assert len(found.proposal.body["time"]["columns"]) > 1 if "clock_parts" in said else found.proposal.body["time"]["date"]
    else:
        assert "starts_again" in said


def test_the_finding_says_how_the_time_was_put_together(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text(table(10, TABLES["year to second"]))
    run, found = imported(path, tmp_path)
    assert found.proposal.body["time"] == {
        "columns": ["hour", "minute", "second"],
        "unit": "hh+mm+ss",
        "date": ["year", "month", "day"],
    }
    (note,) = (n for n in run.notes if n.code == "clock_parts")
    assert note.message == (
        "the time is put together from `hour` (hh), `minute` (mm), `second` (ss), and the days from `year`, `month`, `day`"
    )
    (start,) = (n for n in run.notes if n.code == "time_origin")
    assert start.data["origin_ns"] == (1772236800 * 10 + round(10 * START_S)) * 10**8


T = RATES[10]["time"]
ELAPSED = {
    "hours of the mission": ({"hours": text((T + 7000.0) / 3600.0, 8)}, {"column": "hours", "unit": "h"}),
    "minutes since the start": ({"minutes": text((T + 3500.0) / 60.0, 6)}, {"column": "minutes", "unit": "min"}),
    "seconds since the start": ({"seconds": text(T, 1)}, {"column": "seconds", "unit": "s"}),
    "one time in three units": (
        {"hours": text(T / 3600.0, 6), "minutes": text(T / 60.0, 5), "seconds": text(T, 1)},
        {"column": "seconds", "unit": "s"},
    ),
    "a number of the sample": ({"time": text(T, 1), "Second": text(10 * T)}, {"column": "time", "unit": "s"}),
    "hours of a battery": ({"seconds": text(T, 1), "hours": text(np.floor(5.0 - T / 100.0))}, {"column": "seconds", "unit": "s"}),
    "minutes of a battery": (
        {"minutes": text(np.floor(250.0 - T / 37.0)), "seconds": text(T % 60.0, 1)},
        {"column": "seconds", "unit": "s"},
    ),
    "hours of a battery beside a clock": (
        {"hours": text(np.floor(9.0 - T / 40.0)), "minute": parts(10)["m"], "second": parts(10)["s.s"]},
        {"columns": ["minute", "second"], "unit": "mm+ss"},
    ),
    "milliseconds that a message took": (
        {"sec": text(T, 1), "msec": text(T * 7919 % 997)},
        {"column": "sec", "unit": "s"},
    ),
}


@pytest.mark.parametrize("kind", ELAPSED)
def test_what_is_only_called_as_a_part_of_a_clock_is_none(tmp_path, kind):
    columns, expected = ELAPSED[kind]
    f = RATES[10]
    cells = [*columns.values(), text(np.degrees(f["yaw"]) % 360.0, 3), text(np.degrees(f["rudder"]), 3)]
    path = tmp_path / "log.csv"
    path.write_text("\n".join([",".join([*columns, "heading", "rudder"]), *map(",".join, zip(*cells, strict=True))]) + "\n")
    run, found = imported(path, tmp_path)
    assert found.proposal.body["time"] == expected
    same_flight(run, 10)


def test_a_gap_of_minutes_is_kept_by_the_parts_above(tmp_path):
    lines = table(10, TABLES["hours minutes seconds"]).splitlines(keepends=True)
    path = tmp_path / "log.csv"
    path.write_text("".join(lines[:300] + lines[1200:]))
    found = inspect_log(path)
    assert found.proposal.body["time"]["unit"] == "hh+mm+ss"
    assert found.run is not None
    assert np.diff(found.run.time).max() == pytest.approx(90.1, abs=1e-6)


def test_two_logs_in_one_file_are_no_time_that_starts_again(tmp_path):
    lines = table(10, [("seconds", "s.s")]).splitlines(keepends=True)
    cut = [f"{0.1 * (i % 400):.1f},{line.partition(',')[2]}" for i, line in enumerate(lines[1:])]
    path = tmp_path / "log.csv"
    path.write_text("".join([lines[0], *cut]))
    assert "starts_again" not in {n.code for n in inspect_log(path).notes}


def test_a_salvage_that_would_keep_less_than_half_is_not_offered(tmp_path):
    lines = table(10, [("seconds", "s.s")]).splitlines(keepends=True)
    cut = [f"{0.1 * (i % 300):.1f},{line.partition(',')[2]}" for i, line in enumerate(lines[1:])]
    path = tmp_path / "log.csv"
    path.write_text("".join([lines[0], *cut]))
    found = inspect_log(path)
    assert not found.way_in.options
    (refused,) = (n for n in found.notes if n.code == "refused")
    assert "time goes backwards" in refused.message
    assert "--salvage" not in refused.message


def test_a_time_that_no_name_says_is_told_with_its_unit(tmp_path):
    path = tmp_path / "log.csv"
    lines = table(10, [("seconds", "s.s")]).splitlines(keepends=True)
    cut = [f"{10000 * i},{line.partition(',')[2]}" for i, line in enumerate(lines[1:])]
    path.write_text("".join(["tick" + lines[0].removeprefix("seconds"), *cut]))
    (note,) = (n for n in inspect_log(path).notes if n.code == "time_guessed")
    assert "`tick` goes on by even steps, taken in us" in note.message


def test_a_clock_in_columns_without_names_is_listed(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text(table(10, TABLES["hour minute second"]).partition("\n")[2])
    assert [n.code for n in inspect_log(path).notes] == ["nothing_recognised"]
