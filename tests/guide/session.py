"""Command lines run once, in order, in a folder of their own: what each printed, and the object it returned.

The first is `sysid demo`: it makes a trial and takes every step from the plan to the gains, each with the line a user would
type. Its steps are kept by those lines, so that the pages show and the schemas check what ran once.
"""

from __future__ import annotations

import json
import os
import re
import shlex
import subprocess
import sys
from contextlib import chdir, redirect_stderr, redirect_stdout
from dataclasses import dataclass, field
from io import StringIO
from math import inf
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
from batches import in_this_process

from fieldsid.artifacts import plain
from fieldsid.cli import progress
from fieldsid.cli.app import main
from fieldsid.cli.app import run as run_command
from fieldsid.cli.commands.demo import HIDDEN
from fieldsid.demo.steps import expanded
from fieldsid.demo.vehicle import SPEED, flown, hidden_vehicle
from fieldsid.logs import save_run
from fieldsid.maneuvers import pick_maneuver
from fieldsid.models.model import save_model

TOUR = "sysid demo -o demo --verbose"
STEP = re.compile(r"^\d+\. .*\n\$ (?P<line>sysid .*)\n\n(?P<said>(?:.*\n)*?)\n=> ", re.MULTILINE)
"""A step of the tour as it prints it: its heading, its line, what the command says, and what that means."""
OF_A_SHELL = re.compile(r"[|<>;&$`]")
SWAPPED = "sysid compare before/pulses_yaw.yaml after/pulses_yaw.yaml"
CIRCLE_SEED, FIX_M = 7, 0.05
CONFIG = "# autopilot\ncontrol:\n  heading:\n    speed_m_s: [1.0]\n    kp: [-0.5]\n  depth: {kp: 0.2}  # not ours\n"


@dataclass
class Session:
    """Everything that was run in `folder`: what it said and, for commands of ours, the JSON object it stands for."""

    folder: Path
    said: dict[str, str] = field(default_factory=dict)
    bodies: dict[str, Any] = field(default_factory=dict)

    def run(self, line: str) -> str:
        """Return what a command line says, on both streams as a terminal shows them; a line is run once."""
        if line not in self.said:
            words = shlex.split(line)
            is_ours = words[0] == "sysid" and not OF_A_SHELL.search(line) and "--help" not in words
            self.said[line] = self._ours(line, words[1:]) if is_ours else self._others(line)
        return self.said[line]

    def _ours(self, line: str, words: list[str]) -> str:
        out = StringIO()
        # a line of progress now and then is what a busy machine says
        quietly = patch.object(progress, "LINE_EVERY_S", inf)
        with chdir(self.folder), redirect_stdout(out), redirect_stderr(out), quietly, in_this_process():
            body = run_command(expanded(words))
        if body is not None:
            self.bodies[line] = json.loads(json.dumps(plain(body), allow_nan=False))
        return tidied(out.getvalue())

    def _others(self, line: str) -> str:
        path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
        done = subprocess.run(
            ["bash", "-c", line], cwd=self.folder, env=os.environ | {"PATH": path, "COLUMNS": "80"}, text=True, check=False,
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
        )  # fmt: skip
        return tidied(done.stdout)

    def body(self, line: str) -> Any:
        """Return the JSON object of a line: of one that was run already, else of the line with `--json`."""
        if line not in self.bodies:
            out = StringIO()
            with chdir(self.folder), redirect_stdout(out), redirect_stderr(StringIO()):
                assert main([*expanded(shlex.split(line)[1:]), "--json"]) == 0, line
            self.bodies[line] = json.loads(out.getvalue())
        return self.bodies[line]

    def tour(self) -> None:
        """Take the tour, and keep each of its steps by its line."""
        whole = self.run(TOUR)
        said = {m["line"]: tidied(m["said"]) for m in STEP.finditer(whole)}
        for step in self.bodies[TOUR]["steps"]:
            self.said[step["command"]] = said[step["command"]]
            if step["result"] is not None:
                self.bodies[step["command"]] = step["result"]


def begun(folder: Path) -> Session:
    """Return a session in a folder with the tour taken, and beside it what else the pages' lines work on.

    That is the log of a circle with positions, a vehicle in pitch, and a configuration file of a vehicle.
    """
    session = Session(folder)
    session.tour()
    save_run(circle(), folder / "circle.csv")
    save_model(hidden_vehicle("heave_coupling"), folder / "pitch.yaml")
    (folder / "config.yaml").write_text(CONFIG)
    for place, share, seed in (("before", 1.0, 11), ("after", 0.82, 12)):
        swapped(folder / place, share, seed)
    return session


def swapped(folder: Path, share: float, seed: int) -> None:
    """Write the model of a run by the tour's vehicle with a share of its authority."""
    from dataclasses import replace

    from fieldsid.fitting.identify import identify
    from fieldsid.models.axis import Axis

    vehicle = hidden_vehicle(HIDDEN)
    weaker = replace(vehicle, values={**vehicle.values, "b2": share * vehicle.values["b2"]})
    run = replace(flown(weaker, pick_maneuver("square_pulses"), SPEED, seed), name="pulses")
    (fit,) = identify([run], Axis.YAW, effects=(HIDDEN,))
    save_model(fit.model, folder / "pulses_yaw.yaml", inputs=[save_run(run, folder / "pulses.parquet")])


def circle() -> Any:
    """Return the run of a full circle by the tour's vehicle, its positions by dead reckoning, with a receiver's noise."""
    from dataclasses import replace

    run = flown(hidden_vehicle(HIDDEN), pick_maneuver("turning_circle"), SPEED, CIRCLE_SEED, parameters={"amplitude": 0.26})
    rng, steps = np.random.default_rng(CIRCLE_SEED), np.diff(run.time, prepend=run.time[0])
    north, east = (np.cumsum(run["surge_m_s"] * turn(run["yaw_rad"]) * steps) for turn in (np.cos, np.sin))
    fixes = {"x_m": north + rng.normal(0.0, FIX_M, len(run)), "y_m": east + rng.normal(0.0, FIX_M, len(run))}
    return replace(run, name="circle", signals={**run.signals, **fixes})


def tidied(text: str) -> str:
    """Return text without blanks at the ends of lines, nor blank lines at either end."""
    return "\n".join(line.rstrip() for line in text.splitlines()).strip("\n")
