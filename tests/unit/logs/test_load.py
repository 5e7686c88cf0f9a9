"""Which mapping a log is read with, and what is read of it for that."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fieldsid.logs.load import map_for
from fieldsid.logs.reader import ReadOptions, reader_of

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
