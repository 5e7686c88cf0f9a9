"""Thirty kinds of damage to good logs: how many the doctor finds, and how often it finds something in a good one.

The good logs are flights of both axes with noise, at several rates, speeds and sizes of command, made here by the equations of
motion of each axis. By name, for a longer table:

    python tests/faults/damages.py --logs 200
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from fieldsid.errors import FieldsidError
from fieldsid.logs import load_run
from fieldsid.logs.run import EXPLAINING

Signals = dict[str, np.ndarray]


def good_log(seed: int) -> Signals:
    """Return time and signals (n,), SI and NED, of a flight of pulses in yaw and pitch with noise, to be spoilt."""
    return {name: values.copy() for name, values in _flown(seed).items()}


@cache
def _flown(seed: int) -> Signals:
    random = np.random.default_rng(seed)
    rate, speed = float(random.choice([5.0, 10.0, 20.0])), float(random.uniform(1.0, 2.5))
    fine, length = 0.01, float(random.uniform(80.0, 160.0))
    count, fin_max = round(length / fine), float(random.uniform(0.15, 0.35))
    rudder, elevator = (_pulses(random, count, fine, fin_max * part) for part in (1.0, 0.4))
    a, b, c, k, d = 0.6 * speed, -0.45 * speed**2, 0.9 * speed, 0.5, -0.25 * speed**2
    state = np.zeros((count, 7))  # yaw, its rate, pitch, its rate, x, y, depth
    state[0] = [random.uniform(-3, 3), 0, 0, 0, random.uniform(-50, 50), random.uniform(-50, 50), random.uniform(3, 20)]
    for i in range(1, count):
        psi, r, theta, q, *_ = state[i - 1]
        over = speed * np.cos(theta)
        turn, nod = -a * r + b * rudder[i - 1], -c * q - k * theta + d * elevator[i - 1]
        ahead = [over * np.cos(psi), over * np.sin(psi), -speed * np.sin(theta)]
        state[i] = state[i - 1] + fine * np.array([r, turn, q, nod, *ahead])
    every = slice(None, None, round(1.0 / rate / fine))
    kept, n = state[every], len(state[every])
    noise = random.standard_normal((9, n))
    roll = 0.05 * np.sin(0.4 * fine * np.arange(count)[every]) + 0.004 * noise[4]
    return {
        "time_s": fine * np.arange(count)[every],
        "yaw_rad": kept[:, 0] + 0.005 * noise[0],
        "yaw_rate_rad_s": kept[:, 1] + 0.004 * noise[1],
        "pitch_rad": kept[:, 2] + 0.004 * noise[2],
        "pitch_rate_rad_s": kept[:, 3] + 0.004 * noise[3],
        "roll_rad": roll,
        "surge_m_s": speed + 0.02 * noise[5],
        "x_m": kept[:, 4] + 0.02 * noise[6],
        "y_m": kept[:, 5] + 0.02 * noise[7],
        "depth_m": kept[:, 6] + 0.01 * noise[8],
        "rudder_rad": rudder[every],
        "elevator_rad": elevator[every],
    }


def _pulses(random, count: int, fine: float, size: float) -> np.ndarray:
    out, at = np.zeros(count), round(4.0 / fine)
    while at < count:
        length = round(float(random.uniform(1.5, 5.0)) / fine)
        out[at : at + length] = size * float(random.choice([-1.0, -0.5, 0.5, 1.0]))
        at += length + (round(float(random.uniform(2.0, 6.0)) / fine) if random.random() < 0.7 else 0)
    return out


@dataclass(frozen=True)
class Damage:
    """What is done to a log, and the codes of findings (or words of a refusal) that tell it; none where it is undecidable.

    An undecidable damage leaves a log that another vehicle could have made: `decides` says what would tell them apart.
    """

    name: str
    spoil: Callable[[Signals, np.random.Generator], None]
    told_by: tuple[str, ...]
    decides: str = ""


def scaled(name: str, factor: float):
    def spoil(log, random):
        log[name] = log[name] * factor

    return spoil


def at_places(name: str, share: float, change, length: int = 1):
    def spoil(log, random):
        n = log[name].size
        starts = random.choice(n - length - 2, max(3, round(share * n / length)), replace=False) + 1
        for start in starts:
            log[name][start : start + length] = change(log[name][start : start + length], random)

    return spoil


def for_a_while(name: str, change, part: float = 0.1):
    def spoil(log, random):
        n = log[name].size
        start = int(random.uniform(0.3, 0.6) * n)
        log[name][start : start + round(part * n)] = change(log[name][start])

    return spoil


def shifted(name: str, seconds: float):
    """Log a signal so much later, and at least by two samples: less is told by none."""

    def spoil(log, random):
        step = log["time_s"][1] - log["time_s"][0]
        count = round(seconds / step) if abs(seconds / step) > 2.0 else round(2.0 * np.sign(seconds))
        place = np.clip(np.arange(log[name].size) - count, 0, log[name].size - 1)
        log[name] = log[name][place]

    return spoil


def held(name: str, seconds: float):
    def spoil(log, random):
        step = log["time_s"][1] - log["time_s"][0]
        every = max(2, round(seconds / step))
        log[name] = np.repeat(log[name][::every], every)[: log[name].size]

    return spoil


def swapped(one: str, other: str):
    def spoil(log, random):
        log[one], log[other] = log[other], log[one]

    return spoil


def counts(centre: float, per_rad: float):
    def spoil(log, random):
        log["rudder_rad"] = np.round(centre + per_rad * log["rudder_rad"])

    return spoil


def normalised(log, random):
    log["rudder_rad"] = log["rudder_rad"] / np.abs(log["rudder_rad"]).max()


def rolled(log, random):
    n = log["roll_rad"].size
    log["roll_rad"] = log["roll_rad"] + 0.7 * (np.arange(n) > n // 2)


def gap(log, random):
    n = log["time_s"].size
    for name in log:
        log[name] = np.delete(log[name], slice(n // 2, n // 2 + round(5.0 / (log["time_s"][1] - log["time_s"][0]))))


def jittered(log, random):
    step = log["time_s"][1] - log["time_s"][0]
    log["time_s"] = log["time_s"] + random.uniform(-0.45, 0.45, log["time_s"].size) * step


def spike(size: float):
    return lambda v, random: v + size * random.choice([-1.0, 1.0])


DEG, KN = 180.0 / np.pi, 1.0 / 0.514444
DAMAGES = (
    Damage("rate's sign", scaled("yaw_rate_rad_s", -1.0), ("sign", "rate_sign")),
    Damage("pitch rate's sign", scaled("pitch_rate_rad_s", -1.0), ("sign", "rate_sign")),
    Damage("rate in degrees", scaled("yaw_rate_rad_s", DEG), ("unit",)),
    Damage("heading in degrees", scaled("yaw_rad", DEG), ("unit",)),
    Damage("heading and rate, rad declared deg", lambda log, random: [scaled(n, 1 / DEG)(log, random) for n in
           ("yaw_rad", "yaw_rate_rad_s")] and None, ("course_slope", "course_offset", "course_against")),
    Damage("fin in degrees", scaled("rudder_rad", DEG), ("unit",)),
    Damage("fin normalised to 1", normalised, ("fin_range",)),
    Damage("fin in microseconds", counts(1500, 1000), ("unit",)),
    Damage("fin in counts about 128", counts(128, 200), ("unit",)),
    Damage("knots beside x and y", scaled("surge_m_s", KN), ("speed_unit",)),
    Damage("speed negative", scaled("surge_m_s", -1.0), ("speed_sign",)),
    Damage("x east beside heading from north", swapped("x_m", "y_m"), ("course_against",)),
    Damage("depth upwards", scaled("depth_m", -1.0), ("dive_sign",)),
    Damage("pitch nose down, with its rate", lambda log, random: [scaled(n, -1.0)(log, random) for n in
           ("pitch_rad", "pitch_rate_rad_s")] and None, ("dive_sign",)),
    Damage("yaw and pitch rate swapped", swapped("yaw_rate_rad_s", "pitch_rate_rad_s"), ("swapped",)),
    Damage("heading and fin swapped", swapped("yaw_rad", "rudder_rad"), ("swapped",)),
    Damage("rate and fin swapped", swapped("yaw_rate_rad_s", "rudder_rad"), ("swapped",)),
    Damage("heading and rate swapped", swapped("yaw_rad", "yaw_rate_rad_s"), ("swapped",)),
    Damage("heading and pitch swapped", swapped("yaw_rad", "pitch_rad"), ("swapped",)),
    Damage("rate 0.3 s late", shifted("yaw_rate_rad_s", 0.3), ("clock_offset",)),
    Damage("fin 0.3 s late", shifted("rudder_rad", 0.3), ("fin_late",)),
    Damage("single spikes of heading", at_places("yaw_rad", 0.005, spike(0.5)), ("spikes",)),
    Damage("single spikes of rate", at_places("yaw_rate_rad_s", 0.005, spike(0.5)), ("spikes",)),
    Damage("clusters of 3 spikes", at_places("yaw_rad", 0.01, spike(0.5), 3), ("spikes", "disagree")),
    Damage("frequent spikes, 7 %", at_places("yaw_rad", 0.07, spike(0.5)), ("spikes", "disagree")),
    Damage("clusters of 3 spikes of rate", at_places("yaw_rate_rad_s", 0.01, spike(0.8), 3), ("spikes", "disagree")),
    Damage("scattered zeros of heading", at_places("yaw_rad", 0.03, lambda v, _: 0.0 * v), ("dropouts", "disagree")),
    Damage("-999 at lost samples", at_places("yaw_rate_rad_s", 0.02, lambda v, _: 0.0 * v - 999.0), ("dropouts",)),
    Damage("9999 at lost samples", at_places("depth_m", 0.02, lambda v, _: 0.0 * v + 9999.0), ("dropouts", "unit")),
    Damage("-32.768 of an overflow", at_places("pitch_rate_rad_s", 0.02, lambda v, _: 0.0 * v - 32.768), ("dropouts", "unit")),
    Damage("speed zero without lock", at_places("surge_m_s", 0.2, lambda v, _: 0.0 * v, 5), ("dropouts",)),
    Damage("heading frozen", for_a_while("yaw_rad", lambda v: v), ("frozen",)),
    Damage("rate constant", scaled("yaw_rate_rad_s", 0.0), ("constant",)),
    Damage("samples missing", at_places("yaw_rate_rad_s", 0.2, lambda v, _: 0.0 * v + np.nan), ("missing",)),
    Damage("a gap of 5 s", gap, ("time_gap", "no samples for")),
    Damage("jitter of stamps", jittered, ("jitter",)),
    Damage("time in ms", scaled("time_s", 1e3), ("time_unit", "goes on by")),
    Damage("heading at 1 Hz under the rest", held("yaw_rad", 1.0), ("repeated",)),
    Damage("roll of 40 deg", rolled, ("rolled",)),
    Damage("fin 1 Hz under the rest", held("rudder_rad", 1.0), (), "the fin as it was measured, or the time of each command"),
    Damage("fin 0.3 s early", shifted("rudder_rad", -0.3), (), "the fin as it was measured: a servo may be as slow"),
    Damage("fin's sign", scaled("rudder_rad", -1.0), (), "`positive_rudder` in vehicle.yaml"),
    Damage("fin of 1 deg taken for rad", scaled("rudder_rad", 3.0), (), "`rudder_max_rad` in vehicle.yaml"),
)  # fmt: skip


def findings(log: Signals, folder: Path) -> set[str]:
    """Return the codes of what the doctor finds on a log that is read from a file, or the words of its refusal."""
    path = folder / "log.csv"
    with path.open("w") as stream:
        stream.write(",".join(log) + "\n")
        for row in zip(*log.values(), strict=True):
            stream.write(",".join("" if np.isnan(v) else f"{v:.6f}" for v in row) + "\n")
    try:
        run = load_run(path)
    except FieldsidError as error:
        return {error.what}
    return {note.code for note in run.notes} - EXPLAINING


def is_told(damage: Damage, found: set[str]) -> bool:
    return any(code in found or any(code in words for words in found) for code in damage.told_by)


def table(logs: int, folder: Path, first_seed: int = 0) -> tuple[dict[str, float], dict[str, float]]:
    """Return the share of logs in which each damage is told, and the share of good logs with each finding.

    Good logs have seeds from the first on, damaged ones from 1000 after it on.
    """
    good: dict[str, float] = {}
    false = 0
    told = {d.name: 0.0 for d in DAMAGES}
    for seed in range(first_seed, first_seed + logs):
        found = findings(good_log(seed), folder)
        false += bool(found)
        for code in found:
            good[code] = good.get(code, 0.0) + 1.0 / logs
    for seed in range(first_seed, first_seed + max(logs // 5, 1)):
        whole = good_log(1000 + seed)
        for damage in (d for d in DAMAGES if d.told_by):
            log = {name: values.copy() for name, values in whole.items()}
            damage.spoil(log, np.random.default_rng(seed))
            told[damage.name] += is_told(damage, findings(log, folder)) / max(logs // 5, 1)
    return told, {"any": false / logs} | good


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--logs", type=int, default=200)
    parser.add_argument("--seed", type=int, default=0, help="first seed of the logs")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        told, good = table(given.logs, Path(name), given.seed)
    for damage in DAMAGES:
        what = f"{100 * told[damage.name]:5.0f} %" if damage.told_by else f"undecidable; decided by {damage.decides}"
        print(f"{damage.name:36} {what}")
    decidable = [told[d.name] for d in DAMAGES if d.told_by]
    print(
        f"found {100 * np.mean(decidable):.1f} % of {len(decidable)} decidable kinds, {len(DAMAGES) - len(decidable)} undecidable"
    )
    print(f"{given.logs} good logs with a finding: {100 * good.pop('any'):.1f} %  {good}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
