"""The paper's rows fly as its experiment did, and its base model is all there is in them."""

from __future__ import annotations

import gzip

import numpy as np
import pytest
from truth.basefit import Sample, fit_base
from truth.logbook import write_csv
from truth.paper import PITCH, YAW, paper_run


@pytest.mark.parametrize("row", YAW)
def test_yaw_rows_come_back_from_their_own_runs(row):
    log = paper_run(row)
    fit = fit_base([Sample(log["rudder_rad"], log["yaw_rad"], log["yaw_rate_rad_s"], 0.05, 1.0, 0)], (1.0,), (0.005, 0.005))
    assert [fit.damping, fit.authority[0], fit.trim] == pytest.approx([row.a22, row.b2, row.C0], rel=1e-4)


@pytest.mark.parametrize("row", PITCH)
def test_pitch_rows_come_back_from_their_own_runs(row):
    log = paper_run(row)
    sample = Sample(log["elevator_rad"], log["pitch_rad"], log["pitch_rate_rad_s"], 0.05, 1.0, 0)
    fit = fit_base([sample], (2.0, 0.05), (0.005, 0.005))
    found = [fit.damping, fit.stiffness, fit.authority[0], fit.trim]
    assert found == pytest.approx([row.c22, row.c23, row.d2, row.Cb], rel=1e-3)


def test_run_is_33_s_at_20_hz_with_both_pairs_of_pulses_about_the_trim():
    log = paper_run(YAW[0])
    assert log["time_s"].size == 660
    trim = -YAW[0].C0 / YAW[0].b2
    assert log["rudder_rad"].max() == pytest.approx(0.26 + trim)
    assert np.count_nonzero(np.isclose(log["rudder_rad"], -0.15 + trim)) == 40


def test_csv_keeps_nine_digits_and_leaves_gaps_empty(tmp_path):
    log = {"time_s": np.array([0.0, 0.05]), "yaw_rad": np.array([1 / 3, np.nan])}
    text = gzip.decompress(write_csv(log, tmp_path / "a.csv.gz").read_bytes()).decode()
    assert text.splitlines() == ["time_s,yaw_rad", "0,0.333333333", "0.05,"]
