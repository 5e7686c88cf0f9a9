"""Runs from files, patterns and pandas tables, and what is said where there are none."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

import fieldsid as fs
from fieldsid.errors import DataError, LogError, MappingError, UsageError
from fieldsid.logs import load_run, save_run
from fieldsid.logs.mapping.mapping_file import mapping_of
from fieldsid.logs.several.run_names import names_apart, stem_of


@pytest.fixture
def folder(tmp_path, made, monkeypatch):
    """Three runs and a file of another kind, in `runs/` of the working folder."""
    monkeypatch.chdir(tmp_path)
    for name in ("pulses_1.4", "pulses_1.0", "zigzag"):
        save_run(made.run(name), tmp_path / "runs" / f"{name}.parquet")
    (tmp_path / "runs" / ".hidden.parquet").write_text("half written")
    (tmp_path / "runs" / "notes.txt").write_text("calm")
    return tmp_path


def same(one, other):
    np.testing.assert_array_equal(one.time, other.time)
    assert set(one.signals) == set(other.signals)
    for name in one.signals:
        np.testing.assert_array_equal(one[name], other[name])


def test_a_pattern_gives_its_files_in_the_order_of_their_names(folder):
    runs = fs.load("runs/*.parquet")
    assert [run.name for run in runs] == ["pulses_1.0", "pulses_1.4", "zigzag"]
    assert [run.name for run in fs.load("**/pulses_*.parquet")] == ["pulses_1.0", "pulses_1.4"]


@pytest.mark.parametrize("name", ["runs/zigzag.parquet", "runs/zig*"])
def test_a_file_is_read_as_the_commands_read_it(folder, name):
    (run,) = fs.load(name)
    same(run, load_run(folder / "runs" / "zigzag.parquet"))
    assert run.source is not None


def test_the_tables_of_one_run_are_joined(tmp_path):
    time = 0.1 * np.arange(100)
    for name, column, values in (("state", "yaw_rad", 0.1 * time), ("input", "rudder_rad", np.sin(time))):
        pd.DataFrame({"time_s": time, column: values}).to_csv(tmp_path / f"run4_{name}.csv", index=False)
    signals = {"yaw_rad": {"topic": "state", "field": "yaw_rad"}, "rudder_rad": {"topic": "input", "field": "rudder_rad"}}
    (run,) = fs.load(
        [tmp_path / "run4_state.csv", tmp_path / "run4_input.csv"], join=True, mapping=mapping_of({"signals": signals})
    )
    assert run.name == "run4"
    np.testing.assert_allclose(run["rudder_rad"], np.sin(time))
    (same_run,) = fs.load(tmp_path, join=True, mapping=mapping_of({"signals": signals}))
    same(run, same_run)
    for wrong, says in (([run], "only files"), (tmp_path / "run4_state.csv", "nothing to join")):
        with pytest.raises(UsageError, match=says):
            fs.load(wrong, join=True)


def test_logs_of_several_kinds_are_loaded_together(folder, made):
    run = made.run("own")
    runs = fs.load(["runs/pulses_*.parquet", folder / "runs" / "zigzag.parquet", run, run.to_frame()])
    assert [r.name for r in runs] == ["pulses_1.0", "pulses_1.4", "zigzag", "own", "own_2"]
    assert runs[3] is run


def test_a_name_with_the_letters_of_a_pattern_is_a_name_where_it_is_there(tmp_path, made):
    save_run(made.run("a"), tmp_path / "run[1].parquet")
    assert len(fs.load(tmp_path / "run[1].parquet")) == 1


def test_a_pattern_that_nothing_matches_says_what_is_there(folder):
    with pytest.raises(LogError, match=r"no log matches `runs/circle_\*\.parquet`") as caught:
        fs.load("runs/circle_*.parquet")
    assert caught.value.found == "`runs` holds notes.txt, pulses_1.0.parquet, pulses_1.4.parquet, zigzag.parquet"
    with pytest.raises(LogError, match="no log matches") as caught:
        fs.load("nowhere/*/*.parquet")
    assert caught.value.found == "no folder `nowhere` either"


def test_a_missing_file_is_refused_as_by_the_commands(folder):
    with pytest.raises(LogError, match=r"there is no log `runs/circle\.parquet`") as caught:
        fs.load("runs/circle.parquet")
    assert "pulses_1.0.parquet" in caught.value.found


def test_no_log_at_all_is_no_run(folder):
    assert fs.load([]) == ()
    with pytest.raises(DataError, match="there is no run to fit"):
        fs.identify([], "yaw", joint=True)


@pytest.mark.parametrize("thing", [3, None, {"a": 3}, ["runs/zigzag.parquet", 3]])
def test_what_is_no_log_is_refused(folder, thing):
    with pytest.raises(UsageError, match="that is no log"):
        fs.load(thing)


def test_a_part_is_cut_out_and_a_part_that_is_not_there_refused(folder):
    (run,) = fs.load("runs/zigzag.parquet", start=2.0, end=9.0)
    assert (run.time[0], run.time[-1]) == (2.0, pytest.approx(9.0))
    with pytest.raises(DataError, match="no samples between"):
        fs.load("runs/zigzag.parquet", start=90.0)


def test_what_lies_outside_of_a_part_is_not_judged(tmp_path):
    time = 0.1 * np.arange(400)
    lost = np.where((time > 30.0) & (time < 35.0), np.nan, 1.0)
    columns = {
        "yaw_rad": lost * np.sin(0.3 * time),
        "yaw_rate_rad_s": lost * 0.3 * np.cos(0.3 * time),
        "rudder_rad": np.sin(time),
    }
    table = pd.DataFrame({"time_s": time, **columns})
    table.to_csv(tmp_path / "gap.csv", index=False)
    for log in (tmp_path / "gap.csv", table):
        with pytest.raises(LogError, match="is missing for"):
            fs.load(log, whole=True)
        (run,) = fs.load(log, end=29.0)
        assert run.time[-1] == 29.0


def test_runs_of_one_name_are_told_apart_as_by_the_commands(tmp_path, made):
    run = made.run("pulses")
    paths = [save_run(run, tmp_path / name) for name in ("a/pulses.csv", "a/pulses.parquet", "b/pulses.parquet")]
    runs = fs.load([*paths, *(r.between(0.0, 9.0) for r in fs.load(paths[:2])), run])
    own = names_apart([stem_of(path) for path in paths], paths)
    assert [r.name for r in runs] == [f"{own[0]}_1", f"{own[1]}_1", own[2], f"{own[0]}_2", f"{own[1]}_2", "pulses"]


def test_files_of_one_name_are_told_apart_by_their_folders(tmp_path, made):
    for day in ("monday", "tuesday"):
        save_run(made.run("run7"), tmp_path / day / "run7.parquet")
    assert [run.name for run in fs.load(tmp_path / "*" / "run7.parquet")] == ["monday_run7", "tuesday_run7"]


def test_a_run_comes_back_from_its_table_to_the_last_bit(made):
    run = made.run("pulses")
    back = fs.Run.from_frame(run.to_frame())
    same(back, run)
    assert back.name == "pulses"
    (loaded,) = fs.load(run.to_frame())
    same(loaded, run)
    assert fs.Run.from_frame(run.to_frame(), "other").name == "other"


def test_gaps_stay_gaps_in_a_table(made):
    table = made.run("a").to_frame()
    table.loc[table.index[10:14], "yaw_rad"] = np.nan
    run = fs.Run.from_frame(table)
    np.testing.assert_array_equal(np.flatnonzero(np.isnan(run["yaw_rad"])), [10, 11, 12, 13])


def test_a_table_in_degrees_with_a_time_column_is_converted(made):
    run = made.run("a")
    table = pd.DataFrame({"time_s": run.time, "yaw_deg": np.degrees(run["yaw_rad"]), "rudder_deg": np.degrees(run["rudder_rad"])})
    (read,) = fs.load(table)
    np.testing.assert_allclose(read["yaw_rad"], run["yaw_rad"], atol=1e-12)
    assert read.name == "table"


def test_foreign_columns_are_read_through_channels(made):
    run = made.run("a")
    table = pd.DataFrame({"t": run.time * 1000.0, "heading": np.degrees(run["yaw_rad"]), "fin": run["rudder_rad"]})
    (read,) = fs.load(table, channel=["time=t:ms", "yaw_rad=heading:deg", "rudder_rad=fin:rad"])
    np.testing.assert_allclose(read["yaw_rad"], run["yaw_rad"], atol=1e-12)
    np.testing.assert_allclose(read.time, run.time, atol=1e-9)


@pytest.mark.parametrize("zone", [None, "Asia/Singapore"])
def test_an_index_of_dates_is_the_time(made, zone):
    run = made.run("a")
    table = run.to_frame()
    table.index = pd.Timestamp("2024-05-01 10:00", tz=zone) + pd.to_timedelta(run.time, unit="s")
    (read,) = fs.load(table)
    np.testing.assert_allclose(read.time, run.time, atol=1e-6)
    assert "time_origin" in [n.code for n in read.notes]


def test_an_index_of_time_differences_is_the_time(made):
    run = made.run("a")
    table = run.to_frame()
    table.index = pd.to_timedelta(run.time + 3.0, unit="s")
    (read,) = fs.load(table)
    np.testing.assert_allclose(read.time, run.time + 3.0, atol=1e-6)


def test_missing_values_of_pandas_own_types_are_gaps(made):
    run = made.run("a")
    table = run.to_frame().astype("Float64")
    table.iloc[5, 0] = pd.NA
    read = fs.Run.from_frame(table)
    assert np.flatnonzero(np.isnan(read["yaw_rad"])).tolist() == [5]


def test_tables_take_their_names_from_a_dictionary(made):
    run = made.run("a")
    runs = fs.load({"calm": run.to_frame(), "rough": run.to_frame()})
    assert [r.name for r in runs] == ["calm", "rough"]


def test_a_table_without_known_columns_is_refused_with_a_hint_for_tables(made):
    table = pd.DataFrame({"t": [0.0, 0.1], "x": [1.0, 2.0]})
    with pytest.raises(MappingError, match="no time and signal that are known") as caught:
        fs.load(table)
    assert caught.value.found == "t, x"
    assert "sysid" not in caught.value.hint
    words = made.run("a").to_frame().astype(object)
    words.iloc[3, 0] = "n.n."
    with pytest.raises(LogError, match="no numbers") as caught:
        fs.load(words)
    assert "sysid" not in caught.value.hint
    assert "salvage=True" in caught.value.hint
    (run,) = fs.load(words, salvage=True)
    assert np.isnan(run["yaw_rad"][3])


def test_a_run_is_saved_and_loaded(tmp_path, made):
    run = made.run("a")
    path = fs.save(run, tmp_path / "a.parquet")
    (back,) = fs.load(path)
    same(back, run)
    with pytest.raises(fs.FieldsidError, match="exists"):
        fs.save(run, str(path))
    assert fs.save(run, str(path), force=True) == path


def test_of_a_fit_the_model_is_saved(tmp_path, made):
    fit = made.fit(made.run("a"))
    path = fs.save(fit, str(tmp_path / "a.yaml"))
    assert fs.load_model(path).base == fit.model.base
    with pytest.raises(UsageError, match="has no file of its own"):
        fs.save(fit.predictions[0], tmp_path / "b.yaml")
