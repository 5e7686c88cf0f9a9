"""What a microcontroller prints: a preamble, a header parted otherwise than the rows, no clock, and lines of another talker."""

import numpy as np
import pytest
from look_alikes import truth, write_table

from fieldsid.errors import MappingError
from fieldsid.logs import load_run
from fieldsid.logs.inspection import inspect_log, write_proposal
from fieldsid.logs.mapping.mapping_file import mapping_of

TRUTH = truth(seconds=60.0)
COLUMNS = {"roll": 0.01 + 0.0 * TRUTH["time_s"], "gz": TRUTH["yaw_rate_rad_s"], "yaw": np.degrees(TRUTH["yaw_rad"]) % 360.0,
           "rudder": np.round(1500 + 800 * TRUTH["rudder_rad"])}  # fmt: skip


def printed(folder, *, header=", ", rows=",", names=COLUMNS, between="$GPRMC,123519,A,4807.038,N,01131.000,E,022.4,084.4"):
    log = write_table(folder / "serial.txt", {k: COLUMNS.get(k, COLUMNS["yaw"]) for k in names}, rows)
    _, *lines = log.read_text().splitlines()
    if between:
        for k in range(25, len(lines), 30):
            lines.insert(k, between)
    log.write_text("\n".join(["BOOT 1.4 ok", header.join(names), *lines]) + "\n")
    return log


@pytest.mark.parametrize(("header", "rows"), [(", ", ","), (" ", ","), ("\t", ","), (",", "\t"), (", ", " "), (";", ",")])
def test_the_names_are_read_however_they_are_parted_and_another_talkers_lines_are_none(tmp_path, header, rows):
    found = inspect_log(printed(tmp_path, header=header, rows=rows))
    assert [c.name for c in found.inventory.channels] == list(COLUMNS)
    assert {c.count for c in found.inventory.channels} == {TRUTH["time_s"].size}
    (note,) = (n for n in found.notes if n.code == "nmea_lines")
    assert "$GPRMC" in note.message


def test_the_rate_of_the_rows_is_told_by_heading_and_yaw_rate_and_a_log_is_read_as_proposed(tmp_path):
    log = printed(tmp_path)
    found = inspect_log(log)
    assert found.proposal.body["time"] == {"rate": 10.0}
    assert "rate_guessed" in {n.code for n in found.notes}
    run = load_run(log, write_proposal(found, tmp_path / "m.yaml"))
    np.testing.assert_allclose(run.time, TRUTH["time_s"], atol=1e-9)
    np.testing.assert_allclose(run["yaw_rate_rad_s"], TRUTH["yaw_rate_rad_s"], atol=1e-9)


def test_a_table_without_a_clock_asks_for_its_rate_and_takes_it(tmp_path):
    log = printed(tmp_path, names=["roll", "yaw", "rudder"])
    found = inspect_log(log)
    assert "# time: {rate: 10}" in found.yaml()
    assert "`time: {rate: 10}`" in next(n.message for n in found.notes if n.code == "not_importable")
    assert found.proposal.body["signals"]["rudder_rad"] == {"column": "rudder", "unit": "counts", "centre": 1500.0}
    run = load_run(log, mapping_of({**found.proposal.body, "time": {"rate": 5.0}}))
    np.testing.assert_allclose(run.time, 2.0 * TRUTH["time_s"], atol=1e-9)


def test_a_time_of_neither_column_nor_rate_is_refused(tmp_path):
    with pytest.raises(MappingError, match="one of `column`, `columns`, `rate`"):
        mapping_of({"time": {"unit": "s"}, "signals": {"yaw_rad": "yaw"}})


def test_a_log_of_sentences_alone_keeps_its_rows(tmp_path):
    log = tmp_path / "own.txt"
    log.write_text("".join(f"$ROVER,{0.1 * k:.1f},{k % 50},{0.01 * k:.2f}\n" for k in range(80)))
    found = inspect_log(log)
    assert {c.count for c in found.inventory.channels} == {80}
    assert "nmea_lines" not in {n.code for n in found.notes}


def test_seconds_since_1970_are_a_time_without_a_name_though_the_logger_paused(tmp_path):
    stamps = 1.7e9 + np.where(np.arange(400) < 200, 0.0, 3000.0) + 0.1 * np.arange(400)
    log = tmp_path / "log.csv"
    log.write_text("".join(f'{t:.3f},-121.748,38.537,{k % 90},"{0.01 * k:.2f}\n"\n' for k, t in enumerate(stamps)))
    found = inspect_log(log)
    assert found.proposal.body["time"] == {"column": 0, "unit": "s"}
    assert "bad_rows" not in {n.code for n in found.notes}


def test_rows_that_end_in_a_separator_keep_their_names(tmp_path):
    log = tmp_path / "log.csv"
    log.write_text("time,heading,rudder\n" + "".join(f"{0.1 * k:.1f},{k},{k % 7},\n" for k in range(80)))
    assert [c.name for c in inspect_log(log).inventory.channels][:3] == ["time", "heading", "rudder"]
