"""Logs of flown runs: canonical columns with the noise of each sensor, where some sensors are missing; logs as files."""

from __future__ import annotations

import gzip
from pathlib import Path

import numpy as np

from truth import kernel
from truth.noise import ar1, calm, white
from truth.simple import fly

DEG = np.pi / 180.0


def write_log(rng, scene, motion, sample, inputs):
    """Return the columns (n,) by canonical name: of the fin the command only, and sway (heave) for about half of the vehicles."""
    n, clock = motion.time.size, scene.clock
    noise = lambda sigma: sigma * rng.standard_normal(n)  # noqa: E731
    fitted = scene.notes.setdefault("cross_measured", bool(rng.random() < 0.5))
    wraps = scene.notes.setdefault("yaw_wraps", bool(rng.random() < 0.3))
    out = {"time_s": motion.time, "surge_m_s": motion.surge + noise(0.02), "depth_m": motion.depth + noise(0.02)}
    out["thrust"] = clock.logged(inputs[kernel.THRUST])
    out["roll_rad"], out["roll_rate_rad_s"] = motion.roll + noise(0.1 * DEG), motion.roll_rate + noise(0.2 * DEG)
    angle = np.mod(sample.angle + np.pi, 2 * np.pi) - np.pi if wraps and not scene.pitching else sample.angle
    own, other = ("pitch", "yaw") if scene.pitching else ("yaw", "pitch")
    fin, idle = ("elevator_rad", "rudder_rad") if scene.pitching else ("rudder_rad", "elevator_rad")
    out[f"{own}_rad"], out[f"{own}_rate_rad_s"], out[fin] = angle, sample.rate, motion.command
    out[f"{other}_rad"], out[f"{other}_rate_rad_s"], out[idle] = noise(0.3 * DEG), noise(0.3 * DEG), np.zeros(n)
    if fitted:
        out["heave_m_s" if scene.pitching else "sway_m_s"] = motion.cross + noise(0.02)
    return out


def flown(
    physics, clock, maneuver, *, pitching=False, angle_noise=0.0, rate_noise=0.0, gust=0.0, gust_s=1.0, seed=0,
    angle=0.0, depth=2.0,
):  # fmt: skip
    """Fly one run and return its log, with white noise (rad, rad/s).

    gust, gust_s: standard deviation (rad/s^2) and correlation time (s) of a disturbance moment.
    """
    rng, inputs = np.random.default_rng(seed), calm(clock, physics.nominal_thrust)
    inputs[kernel.ANGLE_NOISE] = white(rng, clock.total, angle_noise)
    inputs[kernel.RATE_NOISE] = white(rng, clock.total, rate_noise)
    inputs[kernel.DISTURBANCE] = ar1(rng, clock.total, gust, gust_s, clock.sample)
    motion = fly(physics, clock, maneuver, inputs, pitching=pitching, angle=angle, depth=depth)
    own, fin, cross = ("pitch", "elevator_rad", "heave_m_s") if pitching else ("yaw", "rudder_rad", "sway_m_s")
    return {
        "time_s": motion.time, f"{own}_rad": motion.angle + clock.logged(inputs[kernel.ANGLE_NOISE]),
        f"{own}_rate_rad_s": motion.rate + clock.logged(inputs[kernel.RATE_NOISE]), fin: motion.command.copy(),
        cross: motion.cross.copy(), "surge_m_s": motion.surge.copy(), "depth_m": motion.depth.copy(),
        "roll_rad": motion.roll.copy(), "thrust": clock.logged(inputs[kernel.THRUST]).copy(),
    }  # fmt: skip


def write_csv(log, path):
    """Write a log (columns by canonical name) as .csv or .csv.gz, nine digits, NaN as an empty field, and return the path."""
    path, names = Path(path), list(log)
    table = np.stack([log[name] for name in names], axis=1)
    rows = (",".join("" if np.isnan(v) else f"{v:.9g}" for v in row) for row in table)
    with gzip.open(path, "wt", encoding="utf-8") if path.suffix == ".gz" else path.open("w", encoding="utf-8") as file:
        file.write("\n".join([",".join(names), *rows]) + "\n")
    return path
