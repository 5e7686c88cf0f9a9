"""Which mapping a log is read with, and what is read of it for that."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fieldsid.logs.load import load_run, map_for
from fieldsid.logs.mapping.certain import certain_of
from fieldsid.logs.mapping.trial import Proposal
from fieldsid.logs.reader import ReadOptions, reader_of
from fieldsid.logs.run import Note

HEADER = "time_s,pitch_rad,pitch_rate_rad_s,elevator_rad"


@pytest.mark.parametrize(("more", "searched"), [("", False), (",speed_knots", True)])
def test_a_table_is_searched_for_more_signals_only_where_a_column_is_left(tmp_path, more, searched):
    time = np.arange(0.0, 30.0, 0.1)
    columns = [time, 0.1 * np.sin(time), 0.1 * np.cos(time), 0.1 * np.sign(np.sin(time)), 2.9 + 0.02 * np.sin(9.0 * time)]
    header = HEADER + more
    log = tmp_path / "a.csv"
    np.savetxt(log, np.column_stack(columns[: header.count(",") + 1]), delimiter=",", header=header, comments="", fmt="%.6g")
    taken, reader = [], reader_of(log)

    def inventory(*asked):
        taken.append(asked)
        return reader.inventory(*asked)

    mapping, _ = map_for(log, replace(reader, inventory=inventory), ReadOptions(), None, {})
    assert bool(taken) is searched
    assert ("surge_m_s" in mapping.sources) is searched


def turning(path, of_rate=1.0, **more):
    """Write a log of canonical names, but for the heading."""
    rng, time = np.random.default_rng(4), 0.1 * np.arange(600)
    columns = {
        "time_s": time,
        "heading_deg": 180.0 + 30.0 * np.sin(0.5 * time) + 0.2 * rng.normal(size=600),
        "yaw_rate_deg_s": of_rate * (15.0 * np.cos(0.5 * time) + 0.1 * rng.normal(size=600)),
        "rudder_deg": 10.0 * np.sign(np.sin(0.5 * time)),
    }
    rows = [",".join([*(f"{v:.4f}" for v in row), *more.values()]) for row in zip(*columns.values(), strict=True)]
    path.write_text("\n".join([",".join([*columns, *more]), *rows]) + "\n")
    return path


def test_a_heading_that_contradicts_the_rate_that_is_read_is_named(tmp_path):
    """The rate is read by its canonical name; the heading beside it shows that one of them is wrong by a factor."""
    run = load_run(turning(tmp_path / "log.csv", of_rate=0.5), recognise=True)
    said = [n.message for n in run.notes if n.code == "left_out"]
    assert len(said) == 1
    assert "`heading_deg`" in said[0]
    assert "2 times as fast" in said[0]
    assert not [n for n in load_run(turning(tmp_path / "log.csv")).notes if n.code == "left_out"]


def test_an_empty_column_of_a_canonical_name_hides_no_heading_of_another(tmp_path):
    assert load_run(turning(tmp_path / "log.csv", pitch_deg="", surge_m_s="")).has("yaw_rad")


def test_a_finding_on_one_signal_contradicts_no_other():
    note = Note("unit", "rudder_rad reaches 3 rad", {"signal": "rudder_rad"})
    assert certain_of(Proposal({"signals": {}}, notes=(note,))).left_out_beside({"rudder_rad"}) == []
