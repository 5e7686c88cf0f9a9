"""Rivals told apart: what `diagnose` says before and after the maneuver that `plan --separate` proposes, on the truth.

python tests/benchmarks/separation.py [--seeds 20] [--pairs servo_lag/delay,deadband/stall]
For every pair and each of the two as the truth: two runs of the paper's pulses to learn from and one to judge on, then the
same with the proposed maneuver flown twice. A verdict is right when it names exactly the effect that is there.
"""

from __future__ import annotations

import argparse
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

sys.path[:0] = [str(Path(__file__).resolve().parents[1]), str(Path(__file__).resolve().parents[2])]

from plan_flights import SENSOR, Day, flown  # noqa: E402
from truth.physics import Physics  # noqa: E402

from fieldsid.diagnosis import diagnose  # noqa: E402
from fieldsid.errors import FieldsidError  # noqa: E402
from fieldsid.fitting.fit import fit  # noqa: E402
from fieldsid.maneuvers import parse_spec  # noqa: E402
from fieldsid.models.axis import Axis  # noqa: E402
from fieldsid.models.record import record_of  # noqa: E402
from fieldsid.planning.discriminate.discriminate import separate  # noqa: E402
from fieldsid.planning.flight.excitation import Excitation, Window  # noqa: E402
from fieldsid.planning.safety.envelope import Envelope  # noqa: E402

SPEED, FIN = 1.4, 0.35
STRENGTHS = {
    "servo_lag": {"servo_tau": 0.25},
    "delay": {"delay": 0.2},
    "deadband": {"deadband_width": 0.03},
    "stall": {"stall_angle": 0.16, "stall_slope": 0.2},
    "quadratic_damping": {"quadratic": 1.5},
    "sway_coupling": {"cross_damping": 0.8, "cross_rate": 0.5, "cross_moment": 0.6},
    "current": {"current_sin": 0.04, "current_cos": 0.03},
    "trim_drift": {"drift": 0.001},
    "compass_deviation": {"compass_sin": 0.06, "compass_cos": 0.04},
    "asymmetric_fin": {"asymmetry": 0.15},
    "rate_limit": {"max_rate": 0.4},
}
PAIRS = (
    "servo_lag/delay", "deadband/stall", "stall/quadratic_damping", "quadratic_damping/sway_coupling", "current/trim_drift",
    "current/compass_deviation", "asymmetric_fin/trim_drift", "rate_limit/servo_lag",
)  # fmt: skip
PULSES = Excitation("square_pulses", parse_spec("square_pulses:amplitude=0.26,second=0.15")[1])


def day_with(effect: str) -> Day:
    """The truth with one effect hidden in it."""
    physics = Physics(damping=1.1, authority=-0.9, trim=-0.005, nominal_speed=SPEED, fin_limit=FIN, kp=0.35, kd=0.0)
    return Day(physics._replace(**STRENGTHS[effect]), SPEED, SENSOR, disturbance=0.003)


def runs_of(day: Day, candidate: Excitation, window: Window, seeds: tuple[int, ...], name: str):
    """Flights of one candidate, named apart."""
    return [replace(flown(day, candidate, window, s), name=f"{name}{s}") for s in seeds]


def said(training, validation) -> tuple[str, ...]:
    """The effects a diagnosis names, empty unless it is sure."""
    found = diagnose(training, Axis.YAW, validation)
    return found.effects if found.verdict == "effect" else ()


def proposed(training, pair: tuple[str, str]):
    """The maneuver that tells the pair apart, each of the two fitted to what was flown so far."""
    records = [record_of(r, Axis.YAW) for r in training]
    models = [fit(records, Axis.YAW, method="output_error", effects=(e,)).model for e in pair]
    return separate(models, Envelope(FIN), speed=SPEED)


def trial(pair: tuple[str, str], truth: str, seed: int) -> tuple[bool, bool, str, float]:
    """Whether the verdict is right before and after, the maneuver, and the log odds it promised."""
    day, window = day_with(truth), Window(45.0)
    first = runs_of(day, PULSES, window, (10 * seed, 10 * seed + 1), "pulses")
    check = runs_of(day, PULSES, window, (10 * seed + 2,), "check")
    before = said(first, check)
    found = proposed(first, pair)
    more = runs_of(day, found.candidate, found.window, (10 * seed + 3, 10 * seed + 4), "apart")
    after = said([*first, more[0]], [*check, more[1]])
    return before == (truth,), after == (truth,), found.maneuver, found.expected_log_odds


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--pairs", default=",".join(PAIRS))
    options = parser.parse_args()
    print(f"{'pair':36}{'truth':20}{'before':>8}{'after':>8}{'log odds':>10}  maneuver", flush=True)
    totals = np.zeros(3)
    began = time.perf_counter()
    for pair in (tuple(p.split("/")) for p in options.pairs.split(",")):
        for truth in pair:
            rows, failed = [], 0
            for seed in range(1, options.seeds + 1):
                try:
                    rows.append(trial(pair, truth, seed))
                except FieldsidError as error:
                    failed += 1
                    print(f"  seed {seed}: {error.what}", file=sys.stderr)
            before, after = (sum(r[i] for r in rows) for i in (0, 1))
            totals += (before, after, options.seeds)
            odds = float(np.median([r[3] for r in rows])) if rows else float("nan")
            names = ",".join(sorted({r[2] for r in rows}))
            n = options.seeds
            print(f"{'/'.join(pair):36}{truth:20}{before:5d}/{n:<2d}{after:5d}/{n:<2d}{odds:10.1f}  {names}", flush=True)
    print(f"right before {totals[0] / totals[2]:.2f}, after {totals[1] / totals[2]:.2f}; {time.perf_counter() - began:.0f} s")


if __name__ == "__main__":
    main()
