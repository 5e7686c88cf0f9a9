"""A small trial flown by the truth simulator: pulses at two speeds and a zig-zag at a third, with or without a slow servo."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from truth import maneuvers
from truth.noise import Clock, white
from truth.physics import Physics
from truth.simple import fly

from fieldsid.logs import save_run
from fieldsid.logs.run import Run

LAG = 0.35
SENSOR = 0.004
REFERENCE = 1.4
CLOCK = Clock(0.1, 330)


@dataclass(frozen=True)
class Files:
    train: tuple[Path, ...]
    unseen: Path


def flown(name, maneuver, speed, seed, *, lag=LAG, quadratic=0.0):
    """A run at 10 Hz over 33 s; damping grows with the speed, authority with its square, drag with the rate's."""
    scale = speed / REFERENCE
    physics = Physics(
        damping=1.1 * scale, authority=-1.2 * scale**2, trim=0.01, servo_tau=lag, nominal_speed=speed, quadratic=quadratic
    )
    motion, rng = fly(physics, CLOCK, maneuver), np.random.default_rng(seed)
    n = CLOCK.samples
    signals = {
        "yaw_rad": motion.angle + white(rng, n, SENSOR),
        "yaw_rate_rad_s": motion.rate + white(rng, n, SENSOR),
        "rudder_rad": motion.command,
        "surge_m_s": speed + white(rng, n, 0.01),
    }
    return Run(name, motion.time, signals)


def runs(**hull):
    """Two training runs and one unseen run."""
    train = [flown(f"pulses_{u}", maneuvers.pulses(CLOCK.time), u, i, **hull) for i, u in enumerate((1.0, 1.8))]
    return train, flown("zigzag", maneuvers.zigzag(CLOCK.time, 0.25, 0.4), 1.4, 9, **hull)


def files(folder, **hull):
    """The same as Parquet files in a folder."""
    train, unseen = runs(**hull)
    return Files(tuple(save_run(r, folder / f"{r.name}.parquet") for r in train), save_run(unseen, folder / "zigzag.parquet"))


def without(run, *names):
    """A run that lacks some signals."""
    return replace(run, signals={k: v for k, v in run.signals.items() if k not in names})
