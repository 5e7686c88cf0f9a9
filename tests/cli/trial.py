"""Runs for the command tests: a vehicle of known numbers flown through pulses, with sensor noise from a seed."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np

from fieldsid.logs import save_run
from fieldsid.logs.run import Run
from fieldsid.maneuvers import Limits, parse_spec
from fieldsid.models.axis import Axis
from fieldsid.models.model import Model, Noise, save_model
from fieldsid.models.speed_law import SpeedLaw
from fieldsid.planning.flight.dry_run import dry_run, with_noise

TRUTH = {
    Axis.YAW: {"a22": 1.1, "b2": -1.2, "C0": 0.02},
    Axis.PITCH: {"c22": 1.4, "c23": 0.4, "d2": 1.3, "Cb": 0.02},
}


def below(out: str) -> list[str]:
    """Return the lines below a result's headline, which fit a page; a verdict, or a command to paste, is one line."""
    return [line.rstrip() for line in out.split("\n\n", 1)[1].splitlines() if not line.startswith(("model: ", "figure: "))]


def vehicle(axis: Axis, *effects: str, **values: float) -> Model:
    return Model(axis, effects, TRUTH[axis] | values, {}, (), np.zeros((0, 0)), SpeedLaw(1.4), Noise(0.005, 0.004))


def flown(
    folder: Path, axis: Axis = Axis.YAW, *, spec: str = "square_pulses", speed: float = 1.4, seed: int = 3, name: str = "run7",
    hidden: tuple[str, dict[str, float]] | None = None,
) -> Path:  # fmt: skip
    effect, values = hidden or (None, {})
    run = _run_of(axis, spec, speed, seed, effect, tuple(values.items()))
    return save_run(replace(run, name=name), folder / f"{name}.parquet")


@cache
def _run_of(axis: Axis, spec: str, speed: float, seed: int, effect: str | None, values: tuple[tuple[str, float], ...]) -> Run:
    """Return what the vehicle flies and its sensors see: many tests begin with the same."""
    model = vehicle(axis) if effect is None else vehicle(axis, effect, **dict(values))
    return with_noise(dry_run(model, *parse_spec(spec), speed=speed, limits=Limits(0.35)), model, seed)


def model_file(folder: Path, axis: Axis = Axis.YAW, *, force: bool = False) -> Path:
    return save_model(vehicle(axis), folder / "truth.yaml", force=force)
