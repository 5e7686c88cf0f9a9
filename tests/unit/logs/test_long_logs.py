"""Long logs block by block: the same numbers as at once, little that waits in memory, and a share that is told."""

import gzip
import io

import numpy as np
import pytest
from bags import KINDS, MAPPING, float64_rows, write_bag, write_mcap
from rich.console import Console

from fieldsid.cli import console
from fieldsid.logs import load_run
from fieldsid.logs.channels import TableForm
from fieldsid.logs.mapping.mapping_file import mapping_of
from fieldsid.logs.reader import ReadOptions, reader_of
from fieldsid.logs.readers import csv_table
from fieldsid.logs.readers.bags import packets
from fieldsid.logs.readers.bags.containers import mcap
from fieldsid.logs.readers.bags.stores import collected

ROWS = 200
TIME = np.arange(ROWS) / 20
BAG = {"time_s": TIME, "yaw_rad": 0.1 * TIME, "yaw_rate_rad_s": np.full(ROWS, 0.1), "rudder_rad": np.sin(TIME)}


def write_table(path, last="0.5"):
    """Whole numbers at first, then gaps, then digits; words at the very end."""
    lines = ["time_s,yaw_rad,surge_m_s,mode"]
    for i in range(ROWS):
        yaw = "" if 60 <= i < 65 else f"{0.01 * i!r}" if i > 90 else "0"
        lines.append(f"{i / 20!r},{yaw},{last if i == ROWS - 1 else '1'},{'auto' if i > 150 else i}")
    path.write_text("\n".join(lines) + "\n")
    return path


@pytest.mark.parametrize("rows", [1, 7, 64, 199, 200, 1000])
def test_a_table_is_the_same_in_blocks_of_any_size(tmp_path, monkeypatch, rows):
    path = write_table(tmp_path / "run.csv")
    at_once, listed = load_run(path), csv_table.READER.inventory(path, ReadOptions(), TableForm())
    monkeypatch.setattr(csv_table, "SAMPLED", rows)
    run = load_run(path)
    np.testing.assert_array_equal(run.time, at_once.time)
    for signal in at_once.signals:
        np.testing.assert_array_equal(run[signal], at_once[signal])
    again = csv_table.READER.inventory(path, ReadOptions(), TableForm())
    for mine, theirs in zip(again.channels, listed.channels, strict=True):
        assert (mine.name, mine.kind, mine.count, mine.fields[0].span) == (
            theirs.name,
            theirs.kind,
            theirs.count,
            theirs.fields[0].span,
        )


@pytest.mark.parametrize("rows", [7, 1000])
def test_a_word_in_the_last_block_is_told_by_its_row(tmp_path, monkeypatch, rows):
    monkeypatch.setattr(csv_table, "SAMPLED", rows)
    path = write_table(tmp_path / "run.csv", last="fault")
    with pytest.raises(csv_table.LogError, match="cells that are no numbers") as error:
        load_run(path)
    assert f"1 of {ROWS}, the first in row {ROWS}: 'fault'" in error.value.found


def test_the_cells_of_a_table_cannot_be_changed(tmp_path):
    columns = csv_table.READER.table(write_table(tmp_path / "run.csv"), TableForm(), ReadOptions(), None).columns
    assert not any(columns.take(i).flags.writeable for i in range(columns.width))


@pytest.mark.parametrize("kind", ["csv", "csv.gz", *KINDS])
def test_the_share_that_was_read_is_told_and_ends_at_all(tmp_path, monkeypatch, kind):
    monkeypatch.setattr(csv_table, "SAMPLED", 10)
    monkeypatch.setattr(packets, "SETTLE_BYTES", 1 << 12)
    monkeypatch.setattr(mcap, "SETTLE_BYTES", 1 << 12)
    mapping = mapping_of(MAPPING)
    if kind in KINDS:
        log = write_bag(tmp_path / "log", kind, BAG)
    else:
        log, mapping = write_table(tmp_path / "log.csv"), None
        if kind == "csv.gz":
            log = tmp_path / "log.csv.gz"
            log.write_bytes(gzip.compress((tmp_path / "log.csv").read_bytes()))
    told = []
    load_run(log, mapping, progress=told.append)
    assert told == sorted(told)
    assert 0.9 < told[-1] <= 1.0
    assert len(told) > 1 or kind in KINDS


def test_what_waits_of_a_long_bag_is_settled_as_it_is_read(tmp_path, monkeypatch):
    values = np.sin(np.arange(5000.0))
    waited = []

    def settle(connection, waiting):
        waited.append(len(waiting.payloads))
        waiting.payloads.clear()

    monkeypatch.setattr(packets, "SETTLE_BYTES", 1 << 14)
    monkeypatch.setattr(mcap, "SETTLE_BYTES", 1 << 14)
    for rows in (0, 50):
        waited.clear()
        log = write_mcap(tmp_path / f"{rows}.mcap", float64_rows("/h", values), chunk_rows=rows)
        collected(log, None, settle)
        assert sum(waited) == 5000
        assert max(waited) <= (1 << 14) / 43 + 51
        run = load_run(log, mapping_of({"signals": {"yaw_rate_rad_s": {"topic": "/h"}}}))
        np.testing.assert_array_equal(run["yaw_rate_rad_s"], values)


def test_a_bar_on_a_terminal_moves_inside_a_log(monkeypatch):
    screen = io.StringIO()
    monkeypatch.setattr(console, "messages", lambda: Console(file=screen, force_terminal=True, width=80))
    for _, told in console.tracked(["one.csv", "two.csv"], "reading"):
        told(0.5)
    shown = screen.getvalue()
    assert "reading" in shown
    assert "100%" in shown


def test_an_inspection_tells_its_share_too(tmp_path, monkeypatch):
    from fieldsid.logs.inspection import inspect_log

    monkeypatch.setattr(csv_table, "SAMPLED", 10)
    told = []
    inspect_log(write_table(tmp_path / "log.csv"), progress=told.append)
    assert len(told) >= 20
    assert told[-1] == 1.0


def test_the_reader_of_a_table_hands_on_only_what_is_mapped(tmp_path):
    path = write_table(tmp_path / "log.csv")
    reader = reader_of(path)
    chosen = mapping_of({"time": {"column": "time_s"}, "signals": {"surge_m_s": "surge_m_s"}})
    assert set(reader.read(path, chosen, ReadOptions()).series) == {"surge_m_s"}
