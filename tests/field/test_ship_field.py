"""A real ship in a towing tank: what its hull does beyond the textbook is found, and runs not seen are predicted by it."""

from __future__ import annotations

import numpy as np
import pytest

pytestmark = pytest.mark.field
MAPPING = """schema: fieldsid/mapping/1
frame: NED/FRD
time: {column: 0, unit: s}
signals:
  yaw_rad: {column: 3, unit: deg}
  surge_m_s: {column: 4}
  sway_m_s: {column: 5}
  yaw_rate_rad_s: {column: 6, unit: deg/s}
  rudder_rad: {column: 8, unit: deg}
"""


@pytest.mark.slow
def test_the_missing_sway_of_a_tanker_is_found_and_its_zig_zags_are_predicted(run_cli, shared_data, tmp_path):
    (tmp_path / "mapping.yaml").write_text(MAPPING, encoding="utf-8")
    logs = {n: shared_data / "kvlcc2" / f"HSVA_CPMC_KVLCC2_Z_{n}.dat" for n in ("10_05", "20_05", "30_05", "15_05")}
    mapped = ("--mapping", tmp_path / "mapping.yaml")
    runs = [logs[n] for n in ("10_05", "20_05", "30_05")]
    asked = ("diagnose", *runs, "--axis", "yaw", "--validate", logs["15_05"], *mapped, "--json")
    body = run_cli(*asked).json
    assert body["verdict"] == "effect"
    assert {"crossflow_drag", "sway_coupling"} & set(body["effects"])  # its drift, with the drag or beside it
    assert "current" not in body["effects"]
    assert "current" not in {name for c in body["candidates"] for name in c["effect"].split("+")}
    before, after = (body[k]["validation"]["rate_rms_rad_s"] for k in ("base", "final"))
    assert after < 0.7 * before
    measured = np.loadtxt(logs["15_05"], skiprows=4, encoding="cp1252", usecols=6)
    assert after < 0.15 * np.std(np.radians(measured))
