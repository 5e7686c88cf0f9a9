"""A table with the rows of several vehicles in turn is refused, with a command that writes those of one; others are read."""

import re
import subprocess

import numpy as np
import pytest
from look_alikes import truth

from fieldsid.errors import LogError
from fieldsid.logs import load_run

TRUTH = truth(seconds=30.0)
COLUMNS = ("time_s", "yaw_rad", "yaw_rate_rad_s", "rudder_rad")


def rows_of(tags, off):
    """Return the rows of a table in which each source has its own heading, `off` rad from that of the next."""
    own = np.stack([TRUTH[name] for name in COLUMNS], axis=1)
    return [
        (tag, *(row + np.array([0.001, off, 0.0, 0.0]) * k).tolist()) for row in own for k, tag in enumerate(dict.fromkeys(tags))
    ]


def written(path, rows, separator=","):
    lines = [separator.join(str(cell) for cell in row) for row in [("vehicle", *COLUMNS), *rows]]
    path.write_text("\n".join(lines) + "\n")
    return path


@pytest.mark.parametrize("separator", [",", ";"])
@pytest.mark.parametrize("tags", [("alpha", "bravo"), ("1", "2", "3")])
def test_rows_of_several_in_turn_are_refused_and_the_command_writes_those_of_one(tmp_path, tags, separator):
    log = written(tmp_path / "a log.csv", rows_of(tags, 1.5), separator)
    with pytest.raises(LogError, match="rows of several in turn: `vehicle` is") as caught:
        load_run(log)
    command = re.search(r"`(awk .*)`", caught.value.hint)[1]
    subprocess.run(command, shell=True, check=True, cwd=tmp_path)  # noqa: S602 - the hint is pasted
    run = load_run(tmp_path / "one.csv")
    np.testing.assert_allclose(run["yaw_rad"], TRUTH["yaw_rad"], atol=1e-9)


def test_a_column_of_words_that_alternates_is_no_source_where_the_numbers_go_on(tmp_path):
    own = np.stack([TRUTH[name] for name in COLUMNS], axis=1)
    log = written(tmp_path / "log.csv", [(("tick", "tock")[i % 2], *row) for i, row in enumerate(own.tolist())])
    assert len(load_run(log)) == len(TRUTH["time_s"])


@pytest.mark.parametrize("tags", [("alpha", "bravo"), ("1", "2", "3")])
def test_rows_of_several_one_after_the_other_are_refused(tmp_path, tags):
    rows = sorted(rows_of(tags, 1.5), key=lambda row: row[0])
    log = written(tmp_path / "log.csv", rows)
    with pytest.raises(LogError, match="rows of several one after the other: `vehicle` is"):
        load_run(log)


def test_a_number_of_the_day_is_no_source_where_the_heading_goes_on_over_midnight(tmp_path):
    own = np.stack([TRUTH[name] for name in COLUMNS], axis=1)
    own[:, 0] += 86390.0
    day, own[:, 0] = own[:, 0] // 86400.0, own[:, 0] % 86400.0
    log = written(tmp_path / "log.csv", [(d, *row) for d, row in zip(day.tolist(), own.tolist(), strict=True)])
    assert len(load_run(log)) == len(TRUTH["time_s"])


def test_readings_of_several_vehicles_in_a_table_of_keys_are_refused(tmp_path):
    names = ("yaw_deg", "yaw_rate_deg_s", "rudder_deg")
    own = zip(TRUTH["time_s"].tolist(), *(np.degrees(TRUTH[name]).tolist() for name in COLUMNS[1:]), strict=True)
    lines = [f"{t},{tag},{key},{v + 40.0 * k}" for t, *row in own for k, tag in enumerate("ab") for key, v in zip(names, row)]  # noqa: B905
    log = tmp_path / "log.csv"
    log.write_text("\n".join(["time,vehicle,key,value", *lines]) + "\n")
    with pytest.raises(LogError, match="rows of several in turn: `vehicle` is `a`, `b`"):
        load_run(log, recognise=True)
