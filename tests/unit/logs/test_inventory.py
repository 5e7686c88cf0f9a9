"""An inventory shows the least and largest of every number, whatever the reader, and a form of a line is no proposal."""

import numpy as np
import pytest
from bags import KINDS, write_bag
from binary_logs import write_alog, write_mat
from look_alikes import truth

from fieldsid.artifacts import plain
from fieldsid.logs.inspection import inspect_log
from fieldsid.logs.run import Run
from fieldsid.logs.save import save_run
from fieldsid.results.logs import inspected

TRUTH = truth(seconds=30.0)
SIGNALS = {s: TRUTH[s] for s in ("yaw_rad", "yaw_rate_rad_s", "surge_m_s", "rudder_rad")}


def spans(log):
    found = inspect_log(log)
    return {(c.name, f.path): f.span for c in found.inventory.channels for f in c.fields}, found


@pytest.mark.parametrize("kind", KINDS)
def test_a_bag_shows_the_ranges_of_its_fields(tmp_path, kind):
    known, found = spans(write_bag(tmp_path / "bag", kind, {"time_s": TRUTH["time_s"], **SIGNALS}))
    rate = next(span for (_, path), span in known.items() if path == "angular_velocity.z")
    wanted = -TRUTH["yaw_rate_rad_s"] if rate[0] != pytest.approx(TRUTH["yaw_rate_rad_s"].min()) else TRUTH["yaw_rate_rad_s"]
    assert rate == pytest.approx((wanted.min(), wanted.max()))
    shown = {row["name"].strip(): row["holds"] for row in plain(inspected(found, None))["shown"]}
    assert " .. " in shown["angular_velocity.z"]


@pytest.mark.parametrize("write", [write_mat, write_alog])
def test_other_formats_show_theirs(tmp_path, write):
    known, _ = spans(write(tmp_path / "log.x", TRUTH["time_s"], SIGNALS))
    found = next(span for (name, _), span in known.items() if name.endswith("surge_m_s"))
    assert found == pytest.approx((TRUTH["surge_m_s"].min(), TRUTH["surge_m_s"].max()))


def test_parquet_shows_its_own(tmp_path):
    log = save_run(Run("r", TRUTH["time_s"], SIGNALS), tmp_path / "r.parquet")
    known, _ = spans(log)
    assert known["rudder_rad", ""] == pytest.approx((TRUTH["rudder_rad"].min(), TRUTH["rudder_rad"].max()))


def test_a_matrix_without_names_gives_its_heading_rate_and_fin_by_evidence(tmp_path):
    import scipy.io

    matrix = np.zeros((TRUTH["time_s"].size, 14))
    matrix[:, 0], matrix[:, 5] = TRUTH["time_s"], np.degrees(TRUTH["yaw_rate_rad_s"])
    matrix[:, 9], matrix[:, 12] = 200.0 + np.degrees(TRUTH["yaw_rad"]) % 360.0, np.degrees(TRUTH["rudder_rad"])
    scipy.io.savemat(tmp_path / "m.mat", {"data": matrix})
    found = inspect_log(tmp_path / "m.mat")
    signals = found.proposal.body["signals"]
    assert {s: i["column"] for s, i in signals.items()} == {
        "yaw_rad": "data(10)",
        "yaw_rate_rad_s": "data(6)",
        "rudder_rad": "data(13)",
    }
    assert {n.data["signal"] for n in found.notes if n.code == "evidence"} >= set(signals)


def test_the_form_of_a_line_names_no_column_of_the_log(tmp_path):
    log = tmp_path / "run.dat"
    log.write_text("".join(f"{k} {k * k % 7} {k * 3 % 5}\n" for k in range(30)))
    text = inspect_log(log).yaml()
    assert "Nothing was recognised" in text
    assert "{column: NAME_OR_PLACE_FROM_0, unit: UNIT}" in text
