"""Text tables of every kind come back as the numbers that were written."""

import gzip

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fieldsid.errors import LogError, MappingError
from fieldsid.logs import load_run
from fieldsid.logs.channels import ChannelMap, Source, TableForm
from fieldsid.logs.convert.conditioning import MAX_PLAUSIBLE_VALUE
from fieldsid.logs.readers._cells import cells
from fieldsid.logs.readers._text import form_of

NAMES = ("time_s", "yaw_rad", "rudder_rad")
ROWS = [(0.0, 0.5, -0.1), (0.05, 0.25, 0.1), (0.1, -1.5e-3, 0.0), (0.15, 0.125, 0.3)]


def table(rows=ROWS, *, separator=",", names=NAMES, decimal=".", newline="\n", head=""):
    lines = [separator.join(names)] if names else []
    lines += [separator.join("" if np.isnan(v) else repr(v).replace(".", decimal) for v in row) for row in rows]
    return head + newline.join(lines) + newline


def check(run, rows=ROWS):
    expected = np.array(rows)
    np.testing.assert_array_equal(run.time, expected[:, 0])
    np.testing.assert_array_equal(run["yaw_rad"], expected[:, 1])
    np.testing.assert_array_equal(run["rudder_rad"], expected[:, 2])


@pytest.mark.parametrize(
    "form",
    [
        {},
        {"separator": ";"},
        {"separator": ";", "decimal": ","},
        {"separator": "\t"},
        {"separator": "\t", "decimal": ","},
        {"separator": "|"},
        {"separator": "  "},
        {"separator": ", "},
        {"newline": "\r\n"},
        {"newline": "\r"},
        {"head": "vehicle pandan\nrun 7, all well\n\n"},
        {"head": "# by hand\n# "},
        {"names": ('"time_s"', "'yaw_rad'", " rudder_rad ")},
    ],
    ids=str,
)
@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "utf-16-le", "cp1252"])
def test_a_table_is_read_however_it_is_written(tmp_path, form, encoding):
    path = tmp_path / "run.csv"
    path.write_bytes(table(**form).encode(encoding))
    check(load_run(path))


def test_gzip_is_told_by_its_first_bytes_and_not_by_the_name(tmp_path):
    path = tmp_path / "run.txt"
    path.write_bytes(gzip.compress(table().encode()))
    check(load_run(path))


def test_two_gzip_streams_in_one_file_are_one_table(tmp_path):
    text = table().encode()
    path = tmp_path / "run.csv.gz"
    path.write_bytes(gzip.compress(text[:40]) + gzip.compress(text[40:]))
    check(load_run(path))


def test_columns_by_index_need_no_header(tmp_path):
    path = tmp_path / "run.dat"
    path.write_bytes(table(names=(), separator="   ", head=" Versuch f\xfcr alle\n no columns named here\n").encode("cp1252"))
    mapping = ChannelMap({"yaw_rad": Source(column=1), "rudder_rad": Source(column=2)}, time=Source(column=0))
    check(load_run(path, mapping))


def test_a_form_that_is_told_counts_more_than_what_is_found(tmp_path):
    path = tmp_path / "run.csv"
    path.write_text("1;2;3\n" + table(separator=";"))
    mapping = ChannelMap(
        {"yaw_rad": Source(column=1), "rudder_rad": Source(column=2)},
        time=Source(column=0),
        table=TableForm(skip=1, header=False),
    )
    check(load_run(path, mapping))


def test_missing_cells_are_gaps_and_other_words_are_refused(tmp_path):
    path = tmp_path / "run.csv"
    path.write_text(table().replace("0.25", "NaN").replace("-0.0015", ""))
    np.testing.assert_array_equal(load_run(path)["yaw_rad"], [0.5, np.nan, np.nan, 0.125])
    path.write_text(table().replace("0.25", "ERR"))
    with pytest.raises(LogError, match="holds cells that are no numbers") as error:
        load_run(path)
    assert "row 2: 'ERR'" in error.value.found
    run = load_run(path, salvage=True)
    np.testing.assert_array_equal(run["yaw_rad"], [0.5, np.nan, -1.5e-3, 0.125])
    assert "not_a_number" in {n.code for n in run.notes}


def test_a_column_of_text_beside_the_signals_is_left_out_with_a_note(tmp_path):
    path = tmp_path / "run.csv"
    lines = table().splitlines()
    path.write_text("\n".join([lines[0] + ",mode", *(line + ",AUTO" for line in lines[1:])]))
    run = load_run(path)
    check(run)
    assert any(n.code == "ignored_columns" and "mode" in n.message for n in run.notes)


def test_the_unit_suffix_of_a_column_is_converted(tmp_path):
    path = tmp_path / "run.csv"
    path.write_text("time_ms,yaw_deg,yaw_rate_deg_s,surge_kn\n0,90,180,2\n50,91,180,2\n")
    run = load_run(path)
    np.testing.assert_allclose(run["yaw_rad"], np.radians([90, 91]))
    np.testing.assert_allclose(run["surge_m_s"], 2 * 1852 / 3600)
    assert run.time.tolist() == [0.0, 0.05]


def test_where_two_columns_mean_one_signal_the_one_in_si_counts(tmp_path):
    path = tmp_path / "run.csv"
    path.write_text("time_s,yaw_deg,yaw_rad\n0,90,1.5\n1,91,1.6\n")
    assert load_run(path)["yaw_rad"].tolist() == [1.5, 1.6]


def test_a_missing_column_names_the_near_ones(tmp_path):
    path = tmp_path / "run.csv"
    path.write_text(table())
    with pytest.raises(MappingError, match="no column `yaw_deg` for `yaw_rad`") as error:
        load_run(path, ChannelMap({"yaw_rad": Source(column="yaw_deg")}, time=Source(column="time_s")))
    assert "`yaw_rad`" in error.value.hint
    with pytest.raises(MappingError, match="no column 3 for `yaw_rad`") as error:
        load_run(path, ChannelMap({"yaw_rad": Source(column=3)}, time=Source(column="time_s")))
    assert "0 to 2" in error.value.found


def test_a_table_without_a_time_says_which_column_may_be_it(tmp_path):
    path = tmp_path / "run.csv"
    path.write_text(table(names=("Time", "yaw_rad", "rudder_rad")))
    with pytest.raises(MappingError, match="needs a mapping") as error:
        load_run(path)
    assert "`Time` may be `time_s`" in error.value.hint


def test_a_table_says_what_it_lacks_and_why_its_time_is_none(tmp_path):
    path = tmp_path / "run.csv"
    path.write_text(table(names=("Time", "yaw_rad", "remark")))
    with pytest.raises(MappingError, match="known by its name as a fin's angle"):
        load_run(path)
    rows = [f"1.77788E+12,{0.1 * i},{0.01 * i}" for i in range(20)]
    path.write_text("\n".join(["stamp (ms),heading (rad),rudder (rad)", *rows]))
    with pytest.raises(MappingError, match="has no clock: time repeats"):
        load_run(path)


@pytest.mark.parametrize(("name", "unit_s"), [("elapsed_min", 60.0), ("julian_day", 86400.0), ("t_h", 3600.0)])
def test_a_clock_that_only_its_steps_tell_has_the_unit_of_its_name(tmp_path, name, unit_s):
    path = tmp_path / "run.csv"
    time = np.arange(50) * 0.1
    rows = [f"{124.0 + t / unit_s:.10f},{np.sin(t):.5f},{0.1 * np.cos(t):.5f}" for t in time]
    path.write_text("\n".join([f"{name},heading_rad,rudder_rad", *rows]))
    run = load_run(path, recognise=True)
    np.testing.assert_allclose(run.time - run.time[0], time, atol=1e-4)


@pytest.mark.parametrize(
    ("content", "what"),
    [(b"", "is empty"), (b"  \n\n", "is empty"), (b"time_s,yaw_rad\n", "has no rows"), (b"hello\nworld\n", "no table of numbers"),
     (bytes(range(256)) * 20, "no log this program reads")],
)  # fmt: skip
def test_a_file_without_a_table_is_refused(tmp_path, content, what):
    path = tmp_path / "run.csv"
    path.write_bytes(content)
    with pytest.raises(LogError, match=what) as error:
        load_run(path)
    assert error.value.found
    assert error.value.hint


def test_a_cut_gzip_is_refused_with_what_is_left_and_taken_on_request(tmp_path):
    rng = np.random.default_rng(3)
    rows = [(0.05 * i, float(0.1 * rng.normal()), float(rng.normal())) for i in range(500)]
    packed = gzip.compress(table(rows).encode())
    path = tmp_path / "run.csv.gz"
    path.write_bytes(packed[: len(packed) // 2])
    with pytest.raises(LogError, match="truncated gzip") as error:
        load_run(path)
    left = int(error.value.found.split()[0])
    run = load_run(path, salvage=True)
    assert len(run) == left > 100
    check(run, rows[:left])
    path.write_bytes(packed[:-4])
    assert len(load_run(path, salvage=True)) == 500


def test_a_gzip_that_is_no_gzip_after_its_first_bytes_is_refused(tmp_path):
    path = tmp_path / "run.csv.gz"
    path.write_bytes(b"\x1f\x8b" + b"\x00" * 50)
    with pytest.raises(LogError, match="gzip"):
        load_run(path)


def test_a_row_with_too_many_cells_is_refused_by_its_line(tmp_path):
    path = tmp_path / "run.csv"
    lines = table().splitlines()
    lines[3] += ",9"
    path.write_text("\n".join(lines) + "\n")
    with pytest.raises(LogError, match="does not fit its 3 columns") as error:
        load_run(path)
    assert "line 4" in error.value.found
    check(load_run(path, salvage=True), ROWS[:2] + ROWS[3:])


def test_a_last_line_that_is_cut_is_left_out_with_a_note(tmp_path):
    path = tmp_path / "run.csv"
    path.write_text(table() + "0.2,0.")
    run = load_run(path)
    check(run)
    assert "truncated" in {n.code for n in run.notes}


finite = st.floats(-MAX_PLAUSIBLE_VALUE, MAX_PLAUSIBLE_VALUE, width=64)


@settings(max_examples=60, deadline=None)
@given(
    st.lists(finite, min_size=2, max_size=25),
    st.sampled_from([(",", "."), (";", "."), (";", ","), ("\t", "."), ("|", "."), ("   ", ".")]),
    st.booleans(),
)
def test_any_numbers_come_back_to_the_last_bit(tmp_path_factory, values, form, has_header):
    rows = [(0.05 * i, 0.5, b) for i, b in enumerate(values)]
    path = tmp_path_factory.mktemp("csv") / "run.csv"
    path.write_text(table(rows, separator=form[0], decimal=form[1], names=NAMES if has_header else ()))
    mapping = None
    if not has_header:
        mapping = ChannelMap({"yaw_rad": Source(column=1), "rudder_rad": Source(column=2)}, time=Source(column=0))
    check(load_run(path, mapping), rows)


@settings(max_examples=100, deadline=None)
@given(st.binary(max_size=300))
def test_any_bytes_are_a_table_or_a_three_part_error(tmp_path_factory, content):
    path = tmp_path_factory.mktemp("csv") / "run.csv"
    path.write_bytes(content)
    try:
        load_run(path)
    except (LogError, MappingError) as error:
        parts = (error.what, error.found, error.hint)
    else:
        parts = ("read",)
    assert all(parts)


@given(st.text(max_size=200))
def test_any_text_has_a_form_or_none(tmp_path_factory, text):
    path = tmp_path_factory.mktemp("csv") / "run.csv"
    try:
        form = form_of(text, TableForm(), path)
    except LogError:
        return
    assert form.width >= 2


def test_cells_lose_blanks_and_quotes():
    assert cells(' "a" , b ,', ",") == ["a", "b", ""]
    assert cells("  1   2\t3 ", "whitespace") == ["1", "2", "3"]


def test_a_row_of_units_that_says_another_unit_than_the_name_is_told(tmp_path):
    rows = [f"{0.1 * i},{0.01 * i},{0.1 * (-1) ** i}" for i in range(100)]
    path = tmp_path / "a.csv"
    path.write_text("\n".join(["time_s,yaw_rad,rudder_rad", "s,deg,rad", *rows]) + "\n")
    (note,) = [n for n in load_run(path).notes if n.code == "unit"]
    assert note.message.startswith("yaw_rad is taken in rad, and the row of units says deg")
    path.write_text(path.read_text().replace("s,deg,rad", "s,rad,rad"))
    assert "unit" not in {n.code for n in load_run(path).notes}


def test_names_of_a_fixed_width_have_their_units_in_brackets_also_where_one_fills_its_column(tmp_path):
    head = f"{'time [s]':>14}{'psi [rad]':>14}{'r [rad/s]':>14}{'delta_t':>14}{'delta_r [rad]':>14}"
    rows = [f"{0.1 * i:.4f} {0.01 * i:.4f} 0.1000 0.5000 {0.1 * (-1) ** (i // 9):.4f}" for i in range(100)]
    (tmp_path / "log.txt").write_text("\n".join([head, *rows]) + "\n")
    lines = (tmp_path / "log.txt").read_text()
    assert list(form_of(lines, TableForm(), tmp_path / "log.txt").names) == [
        "time [s]",
        "psi [rad]",
        "r [rad/s]",
        "delta_t",
        "delta_r [rad]",
    ]
