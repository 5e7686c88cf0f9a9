"""Effects injected outside hulls that no model here has: what `diagnose` names of them, and how near the noise it then predicts.

    python tests/benchmarks/foreign_hulls.py --seed 1 --cases 40

The hulls are those of `tests/truth/maneuvering` that hold their course by themselves: surge, sway and yaw with lift, cross flow
along the hull, a servo that lags and is limited, a rudder that stalls. All that is theirs, and to name it is no error. One effect
comes on top, from outside: the command, the moment of the water or the sensors are changed and the log is not told. In every
tenth case nothing is.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import time
from dataclasses import dataclass, replace
from itertools import count as count_from
from pathlib import Path

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(name, "1")
ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "tests"), str(ROOT)]

import numpy as np  # noqa: E402
from truth.maneuvering.hulls import draw_hull  # noqa: E402
from truth.maneuvering.motion import OPEN, fly  # noqa: E402

from fieldsid.diagnosis import diagnose  # noqa: E402
from fieldsid.logs.run import Run  # noqa: E402
from fieldsid.models.axis import Axis  # noqa: E402

SAMPLE_S, COMPASS, GYRO, DVL = 0.1, 0.005, 0.003, 0.02
OWN = {"sway_coupling", "quadratic_damping", "crossflow_drag", "speed_varying", "servo_lag", "rate_limit", "stall"}
"""What every one of these hulls has."""
STRENGTHS = {
    "delay": (0.1, 1.0), "deadband": (0.004, 0.08), "backlash": (0.008, 0.15), "asymmetric_fin": (0.1, 1.0),
    "step_change": (0.1, 0.7), "wave": (0.05, 1.0), "trim_drift": (0.1, 2.0), "compass_deviation": (0.01, 0.15),
    "gyro_bias": (0.003, 0.04),
}  # fmt: skip
"""Weakest and strongest: seconds, radians, shares of the fin, of the moment of a tenth of a radian of fin, radians a second."""
TIMES_THE_NOISE = (2.5, 8.0)
"""What an effect does to the logs in units of their noise, before a model takes up a part of it."""


@dataclass(frozen=True, slots=True)
class Injected:
    """An effect, its strength, and what else it needs: a side, a share of the run, a period in s, a phase."""

    name: str
    strength: float
    side: float
    share: float
    period: float
    phase: float


def command_of(rng, count, width, size):
    """Return an open-loop command (n,) rad: pairs of pulses or steps in stairs, as long as the hull needs to answer."""
    command, at = np.zeros(count), 3.0
    while at < SAMPLE_S * count - 4.0 * width:
        side = rng.choice([-1.0, 1.0])
        levels = (
            rng.permutation([0.4, 0.7, 1.0]) * side
            if rng.random() < 0.4
            else np.array([1.0, -1.0]) * side * rng.uniform(0.5, 1.0)
        )
        for level in levels:
            length = width * rng.uniform(0.7, 1.5)
            command[round(at / SAMPLE_S) : round((at + length) / SAMPLE_S)] = level * size
            at += length
        at += width * rng.uniform(1.0, 2.0)
    return command


def fin_told(command, time_s, what):
    """Return what the fin is told (n,) rad where an effect sits between the log and it."""
    x = what.strength
    if what.name == "delay":
        return np.interp(time_s - x, time_s, command)
    if what.name == "deadband":
        return np.sign(command) * np.maximum(np.abs(command) - x, 0.0)
    if what.name == "backlash":
        out, y = np.empty(command.size), 0.0
        for i, c in enumerate(command):
            y = min(max(y, c - x / 2), c + x / 2)
            out[i] = y
        return out
    if what.name == "asymmetric_fin":
        return command * (1.0 + 0.5 * x * what.side * np.sign(command))
    if what.name == "step_change":
        return command * np.where(time_s > what.share * time_s[-1], 1.0 - x, 1.0)
    return command


def water(time_s, what, moment):
    """Return the moment (n,) rad/s^2 that an effect adds; `moment` is that of a tenth of a radian of fin."""
    if what.name == "wave":
        return what.strength * moment * np.sin(2.0 * np.pi * time_s / what.period + what.phase)
    if what.name == "trim_drift":
        return what.strength * moment * what.side * time_s / time_s[-1]
    return np.zeros(time_s.size)


def flight(hull, speed, command, what):
    """Return heading, rate, surge and sway (4, n) of a flight with an effect, without noise."""
    time_s, h = SAMPLE_S * np.arange(command.size), hull.of
    moment = 0.1 * abs(h.rudder * h.fin_arm) * speed**2
    settings = np.array([0.0, 0.0, hull.rudder_limit, 0.0, 0.0])
    told = fin_told(command, time_s, what)
    states, _ = fly(h, speed, told, np.full(command.size, OPEN), settings, SAMPLE_S, water(time_s, what, moment))
    heading, rate = states[:, 3].copy(), states[:, 2].copy()
    if what.name == "compass_deviation":
        # what it is at the start belongs to the start: no log shows it
        heading += what.strength * (np.sin(heading - what.phase) - np.sin(heading[0] - what.phase))
    if what.name == "gyro_bias":
        rate += what.side * what.strength
    return np.stack([heading, rate, states[:, 0], states[:, 1]])


def seen(plain, changed):
    """Return what an effect does to heading and rate over their noise, of all runs, the channel that shows it more."""
    both = [
        np.concatenate([(b[i] - a[i]) / s for a, b in zip(plain, changed, strict=True)]) for i, s in enumerate((COMPASS, GYRO))
    ]
    return max(float(np.sqrt(1.0 + np.mean(v**2))) for v in both)


def case(seed, index):
    """Return the runs of a case (four to fit, two held back), the effect's name or none, and the kind of hull."""
    rng = np.random.default_rng([seed, index])
    hull = next(h for h in (draw_hull(number, seed) for number in count_from(index)) if h.stable)
    effect = None if index % 10 == 9 else sorted(STRENGTHS)[index % len(STRENGTHS)]
    width = max(2.0, 0.8 * hull.of.length / hull.speeds[2])
    count = round(max(50.0, 20.0 * width) / SAMPLE_S)
    size = min(0.2, hull.rudder_limit)
    plans = [(hull.speeds[1 + k % 3], command_of(rng, count, width, size * (1.0 - 0.15 * (k % 2)))) for k in range(6)]
    what = Injected("none", 0.0, rng.choice([-1.0, 1.0]), rng.uniform(0.35, 0.65), rng.uniform(3.5, 9.0), rng.uniform(-3.0, 3.0))
    flights = plain = [flight(hull, speed, command, what) for speed, command in plans]
    wanted = rng.uniform(*TIMES_THE_NOISE)
    if effect is not None:
        for strength in np.geomspace(*STRENGTHS[effect], 8):
            flights = [flight(hull, *plan, replace(what, name=effect, strength=float(strength))) for plan in plans]
            if seen(plain, flights) > wanted:
                break
    runs = []
    for k, ((_, command), moved) in enumerate(zip(plans, flights, strict=True)):
        noise = rng.standard_normal((3, command.size))
        signals = {
            "yaw_rad": moved[0] + COMPASS * noise[0],
            "yaw_rate_rad_s": moved[1] + GYRO * noise[1],
            "surge_m_s": moved[2] + DVL * noise[2],
            "rudder_rad": command,
        }
        runs.append(Run(f"r{k}", SAMPLE_S * np.arange(command.size), signals))
    return runs, effect, hull.kind, seen(plain, flights)


def main(argv=None):
    """Diagnose the cases and print what was named of what was injected."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--cases", type=int, default=40)
    parser.add_argument("--json", type=Path, help="one line a case, written as it goes")
    options = parser.parse_args(argv)
    rows = []
    for index in range(options.first, options.first + options.cases):
        runs, effect, kind, times = case(options.seed, index)
        began = time.perf_counter()
        said = diagnose(runs[:4], Axis.YAW, runs[4:])
        left = max(said.final.validation.angle_rms_rad / COMPASS, said.final.validation.rate_rms_rad_s / GYRO)
        alien = sorted(set(said.effects) - OWN - {effect})
        row = {
            "case": index, "kind": kind, "effect": effect, "times": round(times, 1), "verdict": str(said.verdict),
            "named": list(said.effects), "alien": alien, "left": round(left, 2), "s": round(time.perf_counter() - began, 1),
        }  # fmt: skip
        rows.append(row)
        print(json.dumps(row), flush=True)
        if options.json is not None:
            options.json.write_text(json.dumps(rows, indent=1), encoding="utf-8")
    told = [r for r in rows if r["effect"] is not None]
    print(f"the injected effect named       {sum(r['effect'] in r['named'] for r in told)} of {len(told)}")
    print(f"and nothing that is not there   {sum(r['effect'] in r['named'] and not r['alien'] for r in told)} of {len(told)}")
    none = [r for r in rows if r["effect"] is None]
    print(f"nothing injected, a foreign one {sum(bool(r['alien']) for r in none)} of {len(none)}")
    for limit in (1.15, 1.5):
        print(f"error within {limit:g} x the noise     {sum(r['left'] < limit for r in rows)} of {len(rows)}")
    seconds = [r["s"] for r in rows]
    print(f"s, median and worst             {np.median(seconds):.1f}, {max(seconds):.1f}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
