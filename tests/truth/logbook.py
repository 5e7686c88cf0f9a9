"""A flown run becomes a log: canonical columns with the noise of each sensor, some sensors not fitted; logs become files."""

from __future__ import annotations

import gzip
from pathlib import Path

import numpy as np

from truth import kernel

DEG = np.pi / 180.0


def write_log(rng, scene, motion, sample, inputs):
    """Columns (n,) by canonical name; commands only, as a log has them; sway (heave) in about half of the logs' vehicles."""
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


def write_csv(log, path):
    """Write a log (columns by canonical name) as .csv or .csv.gz, nine digits, NaN as an empty field; returns the path."""
    path, names = Path(path), list(log)
    table = np.stack([log[name] for name in names], axis=1)
    rows = (",".join("" if np.isnan(v) else f"{v:.9g}" for v in row) for row in table)
    with gzip.open(path, "wt", encoding="utf-8") if path.suffix == ".gz" else path.open("w", encoding="utf-8") as file:
        file.write("\n".join([",".join(names), *rows]) + "\n")
    return path
