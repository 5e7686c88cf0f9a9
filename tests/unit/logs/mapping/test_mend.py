"""Names mislead and numbers do not: what is proposed for a table whose frames, signs and units are not what its names say."""

import numpy as np
import pytest
from look_alikes import flight

from fieldsid.logs import load_run
from fieldsid.logs.inspection import inspect_log, write_proposal

F = flight()
ENU_WAY = {"x": F["y"], "y": F["x"]}
FIELDS = {
    "a way in ENU beside a compass": {**ENU_WAY, "heading": np.degrees(F["yaw"]) % 360.0, "yaw_rate": F["rate"]},
    "the same, and a gyro upside down": {**ENU_WAY, "heading": np.degrees(F["yaw"]) % 360.0, "gyro_z": -F["rate"]},
    "a yaw in ENU beside north and east": {"north": F["x"], "east": F["y"], "yaw": np.pi / 2 - F["yaw"], "yaw_rate": -F["rate"]},
    "a rate in degrees against a yaw that counts turns": {"yaw": F["yaw"], "yaw_rate": -np.degrees(F["rate"])},
    "a yaw in degrees beside a rate in rad": {"yaw": np.degrees(F["yaw"]), "r": F["rate"]},
    "a yaw that counts turns": {"yaw": F["yaw"], "r": F["rate"]},
    "a speed that is negative ahead": {"yaw": F["yaw"], "r": F["rate"], "surge": -F["speed"]},
}


def written(folder, columns, *, header=True):
    columns = {"time": F["time"], **columns}
    rows = [",".join(f"{v:.5f}" for v in row) for row in zip(*columns.values(), strict=True)]
    path = folder / "log.csv"
    path.write_text("\n".join([",".join(columns)] * header + rows) + "\n")
    return path


@pytest.mark.parametrize("kind", FIELDS)
def test_frames_signs_and_units_are_proposed_by_the_numbers_and_the_reason_is_said(tmp_path, kind):
    log = written(tmp_path, {**FIELDS[kind], "rudder": F["rudder"]})
    found = inspect_log(log)
    run = load_run(log, write_proposal(found, tmp_path / "m.yaml"))
    off = run["yaw_rad"] - F["yaw"]
    np.testing.assert_allclose(off - 2.0 * np.pi * np.round(off / (2.0 * np.pi)), 0.0, atol=1e-3)
    np.testing.assert_allclose(run["yaw_rate_rad_s"], F["rate"], atol=1e-3)
    for signal, name in (("x_m", "x"), ("y_m", "y"), ("surge_m_s", "speed")):
        if run.has(signal):
            np.testing.assert_allclose(run[signal], F[name], atol=1e-3)
    is_plain = kind == "a yaw in degrees beside a rate in rad"
    assert is_plain != any(n.code == "evidence" for n in found.notes)


def test_a_depth_that_counts_upwards_is_turned_and_a_pitch_where_depth_is_below_zero_nowhere(tmp_path):
    pitch = 0.2 * np.sin(0.3 * F["time"])
    depth = 9.0 + np.cumsum(-F["speed"] * np.sin(pitch)) * (F["time"][1] - F["time"][0])
    for signs in ((-1.0, 1.0), (1.0, -1.0)):
        log = written(tmp_path, {"u": F["speed"], "z": signs[0] * depth, "pitch_rad": signs[1] * pitch})
        run = load_run(log, write_proposal(inspect_log(log), tmp_path / "m.yaml", force=True))
        np.testing.assert_allclose(run["depth_m"], depth, atol=1e-3)
        np.testing.assert_allclose(run["pitch_rad"], pitch, atol=1e-3)


def ship(seed=2, step=0.05, length_s=150.0):
    """A zigzag of 25 deg with sway and roll, which follow the rudder as the turning does: columns (n,) without names."""
    count = round(length_s / step)
    psi, r, v, p, phi, x, y, delta = np.zeros((8, count))
    side = 1.0
    for i in range(1, count):
        side = -1.0 if psi[i - 1] > 0.1 else 1.0 if psi[i - 1] < -0.1 else side
        delta[i] = delta[i - 1] + np.clip(side * 0.44 - delta[i - 1], -0.26 * step, 0.26 * step)
        r[i] = r[i - 1] + step * (-0.35 * r[i - 1] + 0.12 * delta[i] - 0.2 * v[i - 1])
        v[i] = v[i - 1] + step * (-0.25 * v[i - 1] - 0.5 * r[i - 1])
        p[i] = p[i - 1] + step * (-0.4 * p[i - 1] - 4.0 * phi[i - 1] + 0.8 * (-0.25 * v[i - 1] - 0.5 * r[i - 1]))
        phi[i] = phi[i - 1] + step * p[i]
        psi[i] = psi[i - 1] + step * r[i]
        x[i] = x[i - 1] + step * (1.1 * np.cos(psi[i]) - v[i] * np.sin(psi[i]))
        y[i] = y[i - 1] + step * (1.1 * np.sin(psi[i]) + v[i] * np.cos(psi[i]))
    noise = np.random.default_rng(seed).standard_normal((8, count))
    columns = (x, y, np.degrees(psi), 1.1 + 0.004 * noise[3], v, np.degrees(r), np.degrees(phi), np.degrees(delta))
    small = (1e-3, 1e-3, 5e-3, 0.0, 1e-3, 0.02, 0.02, 0.02)
    return step * np.arange(count), [c + s * n for c, s, n in zip(columns, small, noise, strict=True)]


@pytest.mark.parametrize("seed", range(3))
def test_the_fin_is_what_explains_the_turning_alone_though_sway_and_roll_follow_it(tmp_path, seed):
    time, columns = ship(seed)
    rows = [",".join(f"{v:.5f}" for v in row) for row in zip(time, *columns, strict=True)]
    (tmp_path / "ship.csv").write_text("\n".join(rows) + "\n")
    signals = inspect_log(tmp_path / "ship.csv").proposal.body["signals"]
    expected = {"x_m": 1, "y_m": 2, "yaw_rad": 3, "surge_m_s": 4, "yaw_rate_rad_s": 6, "rudder_rad": 8}
    assert {s: signals.get(s, {}).get("column") for s in expected} == expected
    assert (signals["yaw_rad"]["unit"], signals["yaw_rate_rad_s"]["unit"], signals["rudder_rad"]["unit"]) == (
        "deg",
        "deg/s",
        "deg",
    )


def test_of_two_fins_that_move_alike_the_other_is_named(tmp_path):
    time, columns = ship()
    columns += [np.interp(time - 0.1, time, columns[-1])]
    rows = [",".join(f"{v:.5f}" for v in row) for row in zip(time, *columns, strict=True)]
    (tmp_path / "ship.csv").write_text("\n".join(rows) + "\n")
    proposal = inspect_log(tmp_path / "ship.csv").proposal
    taken = proposal.body["signals"]["rudder_rad"]["column"]
    (why,) = (n.message for n in proposal.notes if n.data.get("signal") == "rudder_rad" and n.code == "evidence")
    assert {taken, 17 - taken} == {8, 9}
    assert f"column {17 - taken} moves as it does" in why


@pytest.mark.parametrize(("unit", "of_a_second", "step"), [("ms", 1e3, 0.004), ("d", 1.0 / 86400.0, 0.05)])
def test_a_time_of_no_stated_unit_has_the_one_in_which_heading_and_rate_agree(tmp_path, unit, of_a_second, step):
    """A clock of 250 Hz in ms goes on by 4 a sample, as one in s may."""
    rng, time = np.random.default_rng(2), step * np.arange(round(32.0 / step))
    heading = 180.0 + 30.0 * np.sin(0.5 * time) + 0.2 * rng.normal(size=time.size)
    rows = np.stack([time * of_a_second, heading, 15.0 * np.cos(0.5 * time), np.sign(np.sin(0.5 * time))], axis=1)
    log = tmp_path / "log.csv"
    np.savetxt(log, rows, "%.12g", ",", header="time,heading_deg,yaw_rate_deg_s,rudder_deg", comments="")
    found = inspect_log(log)
    assert any(f"`unit: {unit}`" in n.message for n in found.proposal.notes)
    run = load_run(log, write_proposal(found, tmp_path / "m.yaml"))
    np.testing.assert_allclose(run.time - run.time[0], time, atol=1e-6)


@pytest.mark.parametrize("name", ["time", "clock_s"])
def test_minutes_may_be_radians_called_degrees(tmp_path, name):
    """60 s a minute and 57.3 deg a rad are too near to tell which is meant: both are said, and nothing is set."""
    time = 0.1 * np.arange(900)
    rows = np.stack([time / 60.0, 180.0 + 30.0 * np.sin(0.5 * time), 15.0 * np.cos(0.5 * time), np.sign(np.sin(0.5 * time))], 1)
    log = tmp_path / "log.csv"
    np.savetxt(log, rows, "%.10g", ",", header=f"{name},heading_deg,yaw_rate_deg_s,rudder_deg", comments="")
    said = {n.code: n.message for n in inspect_log(log).notes}
    assert "in min, and not in s" in said["time_scale"]
    assert "is not in `deg/s`" in said["time_scale"]
