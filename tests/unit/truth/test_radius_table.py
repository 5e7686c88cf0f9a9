"""The table of radii: it goes on where it ended, and counts the rows of several files once."""

from __future__ import annotations

import argparse
import json
from dataclasses import asdict

from truth import radius_table
from truth.radius_table import Outcome, measured, saved

NAN = float("nan")


def outcome(hull, draw, which, seed):
    return Outcome(draw, hull.kind, which, False, 1.0, "port", 5.0, 5.1, 4.9, 5.4, "identified", seed=seed)


def asked(path, **changed):
    given = {"draws": 3, "first": 0, "seed": 4, "sets": "pulses", "minutes": float("inf"), "json": path, "length": False}
    return argparse.Namespace(**(given | changed))


def test_a_table_goes_on_where_it_ended(tmp_path, monkeypatch):
    flown = []

    def evaluate(hull, draw, which, seed, *, length_stated):
        flown.append(draw)
        return [outcome(hull, draw, which, seed)]

    monkeypatch.setattr(radius_table, "evaluate", evaluate)
    path = tmp_path / "rows.json"
    measured(asked(path, draws=2))
    assert flown == [0, 1]
    assert len(measured(asked(path, draws=3, minutes=-1.0))) == 2
    assert [r.draw for r in measured(asked(path, draws=3))] == [0, 1, 2]
    assert flown == [0, 1, 2]
    assert [r.draw for r in saved([path])] == [0, 1, 2]


def test_rows_of_several_files_count_once(tmp_path):
    row = asdict(Outcome(0, "flat", "pulses", True, 1.0, "port", 5.0, NAN, NAN, NAN, "refused", "why", 4))
    paths = [tmp_path / "a.json", tmp_path / "b.json"]
    paths[0].write_text(json.dumps([row, row | {"side": "starboard"}]))
    paths[1].write_text(json.dumps([row, row | {"seed": 5}]))
    assert len(saved([*paths, tmp_path / "none.json"])) == 3
