"""Exported plans read back and flown by the six-degree-of-freedom vehicle with faults: every abort fires in time."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from plan_legs import ENVELOPE, leg, plan
from played import ardupilot, dune, moos, ros2
from truth.pilots import Autopilot
from truth.vehicle import CALM, QUIET, Fins, Sea, fly_vehicle

from fieldsid.planning.design.leg import aborts_of
from fieldsid.planning.output.command_files import write_all

COURSE = np.radians(90.0)
LIMITS = replace(ENVELOPE, pitch=0.4)
RUN_UP_S = 10.0
FAULTS = {
    "none": {},
    "half the authority": {"gain": 0.5},
    "strong trim": {"fins": Fins(rudder_offset=0.12)},
    "lost fin": {"gain": 0.0},
    "stuck fin": {"stuck": 0.2},
    "stern plane stuck down": {"elevator": 0.3},
    "current across": {"sea": Sea(current=(0.0, 0.9))},
    "current from ahead": {"sea": Sea(current=(-1.7, 0.0))},
}
BREAKS = {
    "stuck fin": "yaw_rad", "stern plane stuck down": "pitch_rad", "current across": "y_m",
    "current from ahead": "x_m",
}  # fmt: skip
"""The limit that a fault is expected to reach first, none for the others."""
TARGETS = ("dune", "ros2", "moos", "ardupilot")
NAMED = {"yaw_rad": "heading", "pitch_rad": "pitch", "y_m": "track", "x_m": "area", "surge_m_s": "speed"}
"""What the script for ArduPilot calls a limit."""


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    """The leg and its files, each read back anew by its own interpreter."""
    made = replace(plan(leg()), envelope=LIMITS, course=COURSE)
    stem = write_all(made, tmp_path_factory.mktemp("plan"))[0].with_suffix("")
    return made, players_of(made, stem)


def players_of(made, stem):
    """The files of the first leg of a plan, each to be read back anew by its own interpreter."""
    name = lambda end: stem.with_name(f"{stem.name}_{end}")  # noqa: E731
    run_up = RUN_UP_S * made.legs[0].speed
    return {
        "dune": lambda: dune(name("dune.ini"), run_up),
        "ros2": lambda: ros2(name("bag"), run_up),
        "ardupilot": lambda: ardupilot(name("ardupilot.lua"), COURSE),
        "moos": lambda: moos(name("moos_timer_script.moos"), name("moos_oparea.bhv"), COURSE),
    }


def flown(player, speed, seconds, *, gain=1.0, stuck=None, elevator=None, fins=None, sea=CALM):
    """Flight under a player's commands, the autopilot where it steers, with a fault from the window's start on."""
    pilot = Autopilot()
    fins = fins or Fins()

    def steer(t, seen):
        rudder, plane = pilot(t, seen)
        commanded = player.step(t, seen)
        rudder = rudder if commanded is None else commanded
        rudder = stuck if stuck is not None else gain * rudder
        return rudder, plane if elevator is None else elevator

    return fly_vehicle(
        steer, seconds, speed=speed, fins=fins, sea=sea, sensors=QUIET, run_up=Autopilot(), run_up_s=RUN_UP_S
    ).truth


def over_ground(truth):
    """The flight with the speed over ground along the heading in place of that through the water."""
    north, east = (np.gradient(truth[name], truth["time_s"]) for name in ("x_m", "y_m"))
    along = north * np.cos(truth["yaw_rad"]) + east * np.sin(truth["yaw_rad"])
    return truth | {"surge_m_s": along}


def first_broken(truth, conditions, run_up, *, level=False):
    """When the truth passes the first of the limits, and which; None where it never does.

    A deviation is from the attitude that the window begins with, or from level and the course where `level`.
    """
    broken = []
    for a in conditions:
        values = truth[a.signal] - (run_up if a.signal == "x_m" else 0.0)
        moved = values - values[0] if a.signal in ("yaw_rad", "pitch_rad", "roll_rad") and not level else values
        outside = {
            "below": moved < a.limit,
            "above": moved > a.limit,
            "deviation": np.abs(moved) > a.limit,
            "time": values > a.limit,
        }
        if outside[a.kind].any():
            broken.append((float(truth["time_s"][np.argmax(outside[a.kind])]), a.signal))
    return min(broken, default=None)


@pytest.mark.parametrize("fault", FAULTS)
@pytest.mark.parametrize("target", TARGETS)
def test_every_abort_fires_when_its_limit_is_passed_and_not_before(written, target, fault):
    made, players = written
    one, player = made.legs[0], players[target]()
    truth = flown(player, one.speed, one.window.length, **FAULTS[fault])
    breaks, run_up = BREAKS.get(fault), RUN_UP_S * one.speed
    if target == "ardupilot":
        # it knows its speed over ground only, and the way along from where it was started
        truth, run_up = over_ground(truth), truth["x_m"][0]
        breaks = "surge_m_s" if fault.startswith("current") else breaks
    wanted = first_broken(truth, aborts_of(one, made.envelope), run_up, level=target == "moos")
    assert (wanted and wanted[1]) == breaks
    assert (player.aborted is None) == (wanted is None)
    if wanted is not None:
        assert player.aborted[0] == pytest.approx(wanted[0], abs=0.15)
        assert target != "ardupilot" or player.aborted[1] == NAMED[wanted[1]]
        assert player.step(player.aborted[0] + 0.05, _seen(truth)) is None


def _seen(truth):
    from truth.vehicle import SEEN, Measured

    return Measured(*(float(truth[name][-1]) for name in SEEN))


@pytest.mark.parametrize("target", TARGETS)
@pytest.mark.parametrize(("spec", "fault", "breaks"), [
    ("square_pulses", {"gain": -1.0}, "yaw_rad"),
    ("doublet", {"sea": Sea(current=(0.0, 0.9))}, "y_m"),
])  # fmt: skip
def test_a_limit_passed_while_the_autopilot_steers_ends_the_maneuver_too(tmp_path, target, spec, fault, breaks):
    """Between two pulses, and after the last one as long as the window lasts: a helm looked only while the fin was overridden."""
    one = leg(spec)
    made = replace(plan(one), envelope=LIMITS, course=COURSE)
    player = players_of(made, write_all(made, tmp_path)[0].with_suffix(""))[target]()
    commanded, step = [], player.step

    def heard(t, seen):
        commanded.append((t, step(t, seen)))
        return commanded[-1][1]

    player.step = heard
    truth, run_up = flown(player, one.speed, one.window.length, **fault), RUN_UP_S * one.speed
    if target == "ardupilot":
        truth, run_up = over_ground(truth), truth["x_m"][0]
    wanted = first_broken(truth, aborts_of(one, made.envelope), run_up, level=target == "moos")
    if target != "ardupilot" or breaks == "yaw_rad":  # a current is a speed over ground to it
        assert wanted is not None
        assert wanted[1] == breaks
        assert next(fin for t, fin in reversed(commanded) if t < wanted[0] - 0.2) is None
    assert player.aborted[0] == pytest.approx(wanted[0], abs=0.15)


@pytest.mark.parametrize("target", TARGETS)
def test_the_fins_that_are_flown_are_those_of_the_plan_and_within_the_limit(written, target):
    made, players = written
    player, commanded = players[target](), []
    step = player.step

    def heard(t, seen):
        fin = step(t, seen)
        commanded.append(np.nan if fin is None else fin)
        return fin

    player.step = heard
    flown(player, made.legs[0].speed, made.legs[0].window.length)
    assert player.aborted is None
    assert np.nanmax(np.abs(commanded)) <= made.envelope.fin + 1e-4
    assert np.nanmax(commanded) > 0.1
    assert np.nanmin(commanded) < -0.1
