"""The trial of the tour: training runs at three speeds and validation runs at two, as the vehicle's logger writes them.

The plan is flown at its speed, the maneuver that excites the hidden effect at the other two.
The files are semicolon-separated text in degrees with column names of the logger, which the program does not know beforehand.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType

import numpy as np

from fieldsid.artifacts import write_text
from fieldsid.demo.vehicle import flown, judging_maneuver, training_maneuver
from fieldsid.logs.run import Run
from fieldsid.maneuvers import Maneuver, Schedule
from fieldsid.models.model import Model
from fieldsid.numerics.arrays import FloatArray
from fieldsid.planning.design.leg import Leg

TRAIN_SPEEDS = (1.0, 1.4, 1.8)
CHECK_SPEEDS = (1.2, 1.6)
SEED = 1848

COLUMNS: Mapping[str, tuple[str, float, int]] = MappingProxyType(
    {
        "yaw_rad": ("heading [deg]", np.degrees(1.0), 3),
        "yaw_rate_rad_s": ("yaw rate [deg/s]", np.degrees(1.0), 4),
        "pitch_rad": ("pitch [deg]", np.degrees(1.0), 3),
        "pitch_rate_rad_s": ("pitch rate [deg/s]", np.degrees(1.0), 4),
        "rudder_rad": ("rudder command [deg]", np.degrees(1.0), 3),
        "elevator_rad": ("elevator command [deg]", np.degrees(1.0), 3),
        "surge_m_s": ("speed [m/s]", 1.0, 4),
        "sway_m_s": ("sway [m/s]", 1.0, 4),
        "heave_m_s": ("heave [m/s]", 1.0, 4),
        "roll_rad": ("roll [deg]", np.degrees(1.0), 3),
        "depth_m": ("depth [m]", 1.0, 3),
        "thrust": ("thrust [%]", 1.0, 1),
    }
)
"""The logger's name of each signal, the factor from SI, and its decimals."""
WRAPPED = "yaw_rad"


@dataclass(frozen=True, slots=True)
class Trial:
    """The training and validation files of a trial, and the maneuvers flown in addition to the planned one."""

    train: tuple[Path, ...]
    check: tuple[Path, ...]
    learning: str
    judging: str


def make_trial(model: Model, folder: Path, leg: Leg, *, force: bool = False) -> Trial:
    """Fly the trial with a vehicle, one run as the plan's leg says, and write its logs; raises ArtifactError where one exists."""
    judging = judging_maneuver(model)
    learning = training_maneuver(model)
    train = [(f"learn_{u:.1f}", _lesson(model, learning, u, SEED + i, leg)) for i, u in enumerate(TRAIN_SPEEDS)]
    check = [(f"check_{u:.1f}", flown(model, judging, u, SEED + 10 + i)) for i, u in enumerate(CHECK_SPEEDS)]
    learned, judged = (tuple(_save(runs, folder, force=force)) for runs in (train, check))
    return Trial(learned, judged, learning.name, judging.name)


def _lesson(model: Model, maneuver: Maneuver, speed: float, seed: int, leg: Leg) -> Run:
    if speed != leg.speed:
        return flown(model, maneuver, speed, seed)
    window, candidate = leg.window, leg.candidate
    schedule = Schedule(window.rate_hz, window.lead, window.recover)
    return flown(model, candidate.record, speed, seed, schedule=schedule, parameters=candidate.parameters)


def _save(runs: list[tuple[str, Run]], folder: Path, *, force: bool) -> Iterator[Path]:
    for i, (name, run) in enumerate(runs):
        yield write_text(folder / f"{name}.csv", _text(run, heading=0.7 + 0.9 * i), force=force)


def _text(run: Run, heading: float) -> str:
    """Return a run as the logger writes it: its heading between 0 and 360 deg, set off to where the run was headed."""
    known = [(COLUMNS[name], _logged(name, values, heading)) for name, values in run.signals.items()]
    rows = ["time [s];" + ";".join(column for (column, _, _), _ in known)]
    for i, time in enumerate(run.time):
        rows.append(f"{time:.3f};" + ";".join(f"{values[i] * factor:.{decimals}f}" for (_, factor, decimals), values in known))
    return "\n".join(rows) + "\n"


def _logged(name: str, values: FloatArray, heading: float) -> FloatArray:
    return np.remainder(values + heading, 2 * np.pi) if name == WRAPPED else values
