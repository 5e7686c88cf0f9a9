"""Which runs a report draws where there are more than it draws."""

from __future__ import annotations

from pathlib import Path

from fieldsid.reporting.material import MOST_RUNS, _selected_runs

PLACES = [Path(f"runs/{kind}_{i}.parquet") for kind in ("circle", "pulses", "zigzag") for i in range(7)]


def test_runs_that_judge_come_first_and_every_kind_is_there():
    fitted = {p.stem for p in PLACES} - {"pulses_3", "zigzag_5"}
    chosen = _selected_runs(PLACES, fitted)
    assert len(chosen) == len(set(chosen)) == MOST_RUNS
    assert [p.stem for p in chosen[:2]] == ["pulses_3", "zigzag_5"]
    assert chosen[2:] == sorted(chosen[2:])
    assert {chosen[2].stem, chosen[-1].stem} == {"circle_0", "zigzag_6"}
    assert {p.stem.split("_")[0] for p in chosen[2:]} == {"circle", "pulses", "zigzag"}


def test_where_more_judge_than_are_drawn_the_first_of_them_are():
    assert _selected_runs(PLACES, set()) == PLACES[:MOST_RUNS]
    assert len(_selected_runs(PLACES, {p.stem for p in PLACES[11:]})) == MOST_RUNS
