"""A course over ground under a heading's name is not taken for the compass that is logged beside it."""

import numpy as np
import pytest
from look_alikes import A22, B2, truth, write_table

from fieldsid.fitting.identify import identify
from fieldsid.logs.inspection import inspect_log
from fieldsid.models.axis import Axis

SLIDING = truth(seconds=200.0, slide_s=0.6)


def write_alog(path, postings):
    """Write a MOOS log: each variable's values (n,) at the times of the run, one posting a line."""
    lines = [f"{t + 0.001 * i:.3f} {name} pApp {v:.6f}" for i, (name, values) in enumerate(postings.items())
             for t, v in zip(SLIDING["time_s"], values, strict=True)]  # fmt: skip
    path.write_text("%% LOG FILE: a\n%% LOGSTART 1.6e9\n" + "\n".join(sorted(lines, key=lambda k: float(k.split()[0]))) + "\n")
    return path


def degrees(signal):
    return np.mod(np.degrees(SLIDING[signal]), 360.0)


def alog(folder):
    return write_alog(folder / "boat.alog", {
        "DESIRED_RUDDER": np.degrees(SLIDING["rudder_rad"]), "NAV_X": SLIDING["y_m"], "NAV_Y": SLIDING["x_m"],
        "NAV_HEADING": degrees("course_rad"),
        "COMPASS_HEADING": degrees("yaw_rad"),
        })  # fmt: skip


def table(folder, *signals):
    named = {"time": SLIDING["time_s"], "heading_deg": degrees("course_rad"), "compass_deg": degrees("yaw_rad"),
             "rudder_deg": np.degrees(SLIDING["rudder_rad"])} | {s: SLIDING[s] for s in signals}  # fmt: skip
    return write_table(folder / "boat.csv", named)


@pytest.mark.parametrize(
    "write",
    [alog, lambda f: table(f, "x_m", "y_m"), lambda f: table(f, "yaw_rate_rad_s")],
    ids=["MOOS", "table by its way", "table by its rate"],
)
def test_the_compass_is_taken_where_the_other_heading_is_the_course(tmp_path, write):
    found = inspect_log(write(tmp_path))
    why = next(n for n in found.notes if n.code == "evidence" and "course over ground" in n.message)
    assert why.data["signal"] == "yaw_rad"
    (fit,) = identify([found.run], Axis.YAW)
    values = {k: fit.model.values[k] for k in ("a22", "b2")}
    assert values["a22"] == pytest.approx(A22, rel=0.05)
    assert values["b2"] == pytest.approx(B2, rel=0.05)


def test_of_two_headings_that_turn_alike_the_surer_name_stays(tmp_path):
    named = {"time": SLIDING["time_s"], "heading_deg": degrees("yaw_rad"), "compass_deg": degrees("yaw_rad"),
             "x": SLIDING["x_m"], "y": SLIDING["y_m"]}  # fmt: skip
    found = inspect_log(write_table(tmp_path / "boat.csv", named))
    assert found.proposal.body["signals"]["yaw_rad"]["column"] == "heading_deg"
    assert not [n for n in found.notes if "course over ground" in n.message]
