"""How long 100 speeds with simulation and 500 draws, and the verification of a schedule, take: targets 5 s and 10 s.

Run it: python tests/benchmarks/radius_speed.py
"""

from __future__ import annotations

import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from fieldsid.models.axis import Axis
from fieldsid.models.model import Model, Noise, save_model
from fieldsid.models.speed_law import SpeedLaw
from fieldsid.plant.parameter_source import ParameterSource, load_parameter_source
from fieldsid.schedule.make import design_schedule
from fieldsid.schedule.verify import verify_schedule
from fieldsid.turning.radius import RADIUS_DRAWS, turn_radius

SPEEDS = [round(0.5 + 0.02 * i, 3) for i in range(100)]
VALUES = {"a22": 2.2, "b2": -3.0, "C0": 0.01, "lag": 0.15, "cross_damping": 0.9, "cross_rate": -0.4, "quadratic": 3.0}
EFFECTS = ("servo_lag", "sway_coupling", "quadratic_damping")


def source_in(folder: Path, speeds: tuple[float, ...]) -> ParameterSource:
    """Models with effects and errors of 3 % at these speeds."""
    paths = []
    for speed in speeds:
        values = VALUES | {"a22": 2.2 * speed / 1.5, "b2": -3.0 * (speed / 1.5) ** 2}
        covariance = np.diag([(0.03 * abs(v)) ** 2 for v in values.values()])
        model = Model(Axis.YAW, EFFECTS, values, {}, tuple(values), covariance, SpeedLaw(speed), Noise(0.005, 0.005))
        paths.append(save_model(model, folder / f"m{speed:.2f}.yaml", force=True))
    return load_parameter_source(paths)


def seconds(work: Callable[[], object]) -> float:
    """The time of one run of the work."""
    start = time.perf_counter()
    work()
    return time.perf_counter() - start


def measure() -> dict[str, tuple[float, float]]:
    """Seconds and target by name; compiled parts warm."""
    with tempfile.TemporaryDirectory() as folder:
        one, five = source_in(Path(folder), (1.5,)), source_in(Path(folder), (1.0, 1.25, 1.5, 1.75, 2.0))
        schedule = design_schedule(five, 0.26)
        verify_schedule(schedule, five, draws=2)
        return {
            f"turn-radius, {len(SPEEDS)} speeds, {RADIUS_DRAWS} draws, one model": (
                seconds(lambda: turn_radius(one, SPEEDS, 0.3)),
                5.0,
            ),
            f"turn-radius, {len(SPEEDS)} speeds, {RADIUS_DRAWS} draws, five models": (
                seconds(lambda: turn_radius(five, SPEEDS, 0.3)),
                5.0,
            ),
            "schedule verify, 9 speeds": (seconds(lambda: verify_schedule(schedule, five)), 10.0),
        }


def main() -> int:
    """Print the table; 1 when a target is missed."""
    found = measure()
    for name, (took, target) in found.items():
        print(f"{name:<58} {took:6.2f} s   target {target:4.0f} s")
    return int(any(took > target for took, target in found.values()))


if __name__ == "__main__":
    sys.exit(main())
