"""A heading counted from east is told from one counted from north by what is known to be north and east, and only by that."""

from __future__ import annotations

import numpy as np
import pytest
from look_alikes import flight

from fieldsid.logs.inspection import inspect_log

LAT, LON = 41.7, -71.4


def columns_of(seed=3, *, current=0.15):
    """A flight with noise over a current: what a table may hold, by the name that it has there."""
    f, rng = flight(seed=seed), np.random.default_rng(seed)
    n = f["time"].size
    north, east = f["x"] + current * f["time"], f["y"] - 0.5 * current * f["time"]
    dn, de = np.gradient(north, f["time"]), np.gradient(east, f["time"])
    yaw = f["yaw"] + 0.01 * rng.standard_normal(n)
    return {
        "t": f["time"],
        "lat": LAT + np.degrees(north / 6.36e6),
        "lon": LON + np.degrees(east / (6.385e6 * np.cos(np.radians(LAT)))),
        "cog": (np.degrees(np.arctan2(de, dn)) + 3.0 * rng.standard_normal(n)) % 360.0,
        "vel_north": dn + 0.05 * rng.standard_normal(n),
        "vel_east": de + 0.05 * rng.standard_normal(n),
        "north": north + 0.1 * rng.standard_normal(n),
        "east": east + 0.1 * rng.standard_normal(n),
        "of_north": wrapped(yaw),
        "of_east": wrapped(0.5 * np.pi - yaw),
        "rate": np.gradient(f["yaw"], f["time"]) + 0.002 * rng.standard_normal(n),
        "rudder": f["rudder"],
    }


def wrapped(angle):
    return np.remainder(angle + np.pi, 2 * np.pi) - np.pi


def looked_at(folder, columns, **given):
    """The inspection of a table; `given` names its columns by what they hold."""
    body = np.column_stack([columns[held] if isinstance(held, str) else held for held in given.values()])
    np.savetxt(folder / "log.csv", body, delimiter=",", header=",".join(given), comments="", fmt="%.9f")
    return inspect_log(folder / "log.csv")


EVIDENCE = {
    "latitude and longitude": {"lat": "lat", "lon": "lon"},
    "course over ground": {"cog": "cog"},
    "a course of 0 to 360": {"course": "cog"},
    "a receiver's heading": {"GPS True Heading": "cog"},
    "speeds north and east": {"vel_north": "vel_north", "vel_east": "vel_east"},
    "vn and ve": {"vn": "vel_north", "ve": "vel_east"},
}


def frames(found):
    return {s: item["frame"] for s, item in found.proposal.body["signals"].items() if "frame" in item}


@pytest.mark.parametrize("beside", EVIDENCE)
@pytest.mark.parametrize("place", ["none", "east first", pytest.param("north first", marks=pytest.mark.slow)])
@pytest.mark.parametrize("heading", ["of_north", "of_east"])
def test_each_kind_of_evidence_tells_each_pair_of_frames(tmp_path, beside, place, heading):
    columns = columns_of()
    xy = {"none": {}, "east first": {"x": "east", "y": "north"}, "north first": {"x": "north", "y": "east"}}[place]
    found = looked_at(
        tmp_path, columns, t="t", **EVIDENCE[beside], **xy, yaw=heading, r=signed(columns, heading), rudder="rudder"
    )
    turned = {"yaw_rad"} if heading == "of_east" else set()
    assert set(frames(found)) == turned | ({"x_m", "y_m"} if place == "east first" else set())
    off = found.run["yaw_rad"] - columns["of_north"]
    np.testing.assert_allclose(wrapped(off - off[0]), 0.0, atol=0.15)
    assert np.corrcoef(found.run["yaw_rate_rad_s"], columns["rate"])[0, 1] > 0.9  # the rate is turned with its heading
    assert "frame_open" not in {n.code for n in found.notes}


def signed(columns, heading):
    return columns["rate"] if heading == "of_north" else -columns["rate"]


def test_mirror_images_without_evidence_are_said_to_be_open_and_what_would_decide(tmp_path):
    columns = columns_of()
    for x, y, heading in (("east", "north", "of_east"), ("north", "east", "of_north")):
        found = looked_at(tmp_path, columns, t="t", x=x, y=y, yaw=heading, rudder="rudder")
        (note,) = (n for n in found.notes if n.code == "frame_open")
        assert "latitude and longitude" in note.message
        assert not frames(found)


@pytest.mark.parametrize("names", [("north", "east", "yaw"), ("utm_y", "utm_x", "yaw"), ("x", "y", "compass")])
def test_names_that_say_which_way_they_count_leave_nothing_open(tmp_path, names):
    columns = columns_of()
    given = {"t": "t", names[0]: "north", names[1]: "east", names[2]: "of_north", "rudder": "rudder"}
    found = looked_at(tmp_path, columns, **given)
    assert "frame_open" not in {n.code for n in found.notes}
    assert not frames(found)


@pytest.mark.parametrize("seed", [*range(20, 24), *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(24, 32))])
def test_a_heading_from_north_is_never_turned(tmp_path, seed):
    columns = columns_of(seed, current=0.4)
    for beside in EVIDENCE.values():
        found = looked_at(tmp_path, columns, t="t", **beside, x="north", y="east", yaw="of_north", rudder="rudder")
        assert not frames(found)


def test_a_vehicle_that_goes_straight_tells_nothing(tmp_path):
    columns = columns_of()
    n = columns["t"].size
    rng = np.random.default_rng(4)
    straight = np.full(n, np.pi / 4) + 0.01 * rng.standard_normal(n)  # the same from north and from east
    found = looked_at(tmp_path, columns, t="t", cog=np.degrees(straight), yaw=straight, rudder="rudder")
    assert not frames(found)
