"""A table of one reading a row is pivoted: each key is a topic, on the clock of its own rows."""

import numpy as np
import pytest
from look_alikes import truth

from fieldsid.logs import load_run
from fieldsid.logs.inspection import inspect_log, write_proposal
from fieldsid.logs.reader import reader_of

TRUTH = truth(seconds=40.0)
KEYS = {"/nav/heading_deg": np.degrees(TRUTH["yaw_rad"]) % 360.0, "/imu/yaw_rate_deg_s": np.degrees(TRUTH["yaw_rate_rad_s"]),
        "/cmd/rudder_deg": np.degrees(TRUTH["rudder_rad"])}  # fmt: skip


def rows(start=12.5):
    """Readings in the order of their times, the command where it changes only, and words between them."""
    for i, t in enumerate(TRUTH["time_s"] + start):
        for key, values in KEYS.items():
            if "rudder" not in key or i == 0 or values[i] != values[i - 1]:
                yield t, key, f"{values[i]:.6f}"
        if i % 50 == 0:
            yield t, "/state", "auto"


@pytest.mark.parametrize("header", ["Timestamp,Key,Value", "time [s],signal,value", '"Timestamp","Key","Value"'])
def test_keys_are_topics_and_the_run_is_that_of_the_readings(tmp_path, header):
    log = tmp_path / "long.csv"
    log.write_text(header + "\n" + "".join(f"{t:.3f},{key},{value}\n" for t, key, value in rows()))
    assert reader_of(log).name == "key_value"
    found = inspect_log(log)
    assert {c.name for c in found.inventory.channels} == set(KEYS)
    assert found.inventory.channels[1].fields[0].span is not None
    run = load_run(log, write_proposal(found, tmp_path / "m.yaml"))
    np.testing.assert_allclose(np.diff(run["yaw_rad"]), np.diff(TRUTH["yaw_rad"]), atol=1e-7)
    np.testing.assert_allclose(run["yaw_rate_rad_s"], TRUTH["yaw_rate_rad_s"], atol=1e-7)
    np.testing.assert_allclose(run["rudder_rad"], TRUTH["rudder_rad"], atol=1e-7)


def test_dates_beside_keys_are_times(tmp_path):
    log = tmp_path / "k.csv"
    stamps = np.datetime64("2026-03-01T10:00:00.000", "ms") + np.round(1e3 * TRUTH["time_s"]).astype("timedelta64[ms]")
    heading = KEYS["/nav/heading_deg"]
    lines = [f"{s}Z,navigation.headingTrue_deg,{h:.4f}\n{s}Z,steering.rudderAngle_deg,{r:.4f}\n"
             for s, h, r in zip(stamps, heading, KEYS["/cmd/rudder_deg"], strict=True)]  # fmt: skip
    log.write_text("timestamp,path,value\n" + "".join(lines))
    found = inspect_log(log)
    assert found.run is not None
    np.testing.assert_allclose(found.run.time, TRUTH["time_s"], atol=1e-6)
    np.testing.assert_allclose(found.run["rudder_rad"], TRUTH["rudder_rad"], atol=1e-5)


@pytest.mark.parametrize("header", ["time,mode,heading_deg", "time,name,depth_m"])
def test_a_table_with_a_column_of_words_is_none(tmp_path, header):
    log = tmp_path / "table.csv"
    log.write_text(header + "\n" + "".join(f"{0.1 * k:.1f},{'auto' if k < 40 else 'hand'},{k}\n" for k in range(80)))
    assert reader_of(log).name == "csv_table"
