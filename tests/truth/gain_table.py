"""Settling times that `verify_schedule` predicts against those flown, on random hulls that nothing was tuned on, by kind.

Every hull is drawn, flown with sensor noise, identified from a training set, and steered at its speeds by a schedule designed
from that:
    python tests/truth/gain_table.py --draws 14 --seed 7 [--controller pd] [--set pulses+zigzag] [--json rows.json]
"""

from __future__ import annotations

import argparse
import json
import sys
import time
import warnings
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from fieldsid.errors import FieldsidError
from fieldsid.fitting.identify import identify
from fieldsid.logs.run import Run
from fieldsid.models.axis import Axis
from fieldsid.plant.parameter_source import ParameterSource, source_of_models
from fieldsid.schedule.check import StepCheck
from fieldsid.schedule.make import design_schedule
from fieldsid.schedule.record import Schedule
from fieldsid.schedule.verify import STEPS_RAD, verify_schedule
from fieldsid.schedule.wish import Wish
from truth.maneuvering.hulls import KINDS, Hull, draw_hull
from truth.maneuvering.steered import steered
from truth.maneuvering.trials import SETS, training

EFFECTS = ("servo_lag", "sway_coupling", "quadratic_damping")
WITHIN, AT_LEAST_S = 0.25, 0.5
"""How far the settling time may differ from the predicted median: a share of it, or seconds."""
HUNTS = 0.1
"""Peak-to-peak heading in the last quarter of a flight, over the step, above which the loop is in a limit cycle."""
FLOWN_S = 240.0
"""Duration in which the largest hull settles after a step of 90 deg."""


BAND_EDGE = 0.05
"""Share by which the 2.5 and 97.5 % points of 60 draws vary from seed to seed."""


@dataclass(frozen=True, slots=True)
class Outcome:
    """The settling time (s) of one flown step, and its prediction: median (`said`) and 95 % band of the draws.

    All are NaN without a schedule; only `said` is NaN where verify predicts no settling time, as for a step that depends on
    motion that no run contains.
    """

    draw: int
    kind: str
    length: float
    stable: bool
    speed: float
    step_deg: float
    said: float
    said_low: float
    said_high: float
    flown: float
    swing: float
    overshoot: float
    margin: float
    refused: str = ""
    extrapolated: bool = False
    """Whether verify reported that the step turns tighter than any run."""

    @property
    def as_said(self) -> bool:
        """Whether the settling time equals the predicted median, to WITHIN or AT_LEAST_S."""
        return bool(np.isfinite(self.said)) and abs(self.flown - self.said) <= max(WITHIN * self.said, AT_LEAST_S)

    @property
    def in_band(self) -> bool:
        """Whether the settling time is as predicted, or in the predicted band, whose edges 60 draws determine to BAND_EDGE."""
        edges = (1.0 - BAND_EDGE) * self.said_low, (1.0 + BAND_EDGE) * self.said_high
        return self.as_said or edges[0] <= self.flown <= edges[1]

    @property
    def hunts(self) -> bool:
        """Whether the loop is in a limit cycle."""
        return not self.swing <= HUNTS


def identified(hull: Hull, draw: int, seed: int, which: str) -> tuple[ParameterSource, list[Run]]:
    """Return the models of a hull's training set, one for each speed, fitted to its pulses, and the runs."""
    logs = training(hull, which, np.random.default_rng([seed, draw, SETS.index(which)]), sway=True)
    runs = [Run(log.name, log.time, log.columns) for log in logs]
    models = [f.model for run in runs if run.name.startswith("pulses") for f in identify([run], Axis.YAW, effects=EFFECTS)]
    return source_of_models(models, [f"m{i}" for i in range(len(models))]), runs


def law_of(schedule: Schedule) -> np.ndarray:
    """Return a schedule as the table (k, 7) that `steered` takes."""
    names = ("speed_m_s", "kp", "ki", "kd", "feed_forward_rad", "reference_gain", "fin_limit_rad")
    return np.array([schedule.column(n) for n in names], dtype=float).T


def evaluate(hull: Hull, draw: int, seed: int, kind: str, which: str) -> list[Outcome]:
    """Return the outcome of each step on one hull, refused ones included."""
    nan = float("nan")
    try:
        source, runs = identified(hull, draw, seed, which)
        schedule = design_schedule(source, hull.rudder_limit, wish=Wish(kind), runs=runs)
        found = verify_schedule(schedule, source, runs=runs)
    except FieldsidError as error:
        sizes = [np.degrees(s) for s in STEPS_RAD[Axis.YAW]]
        return [
            Outcome(draw, hull.kind, hull.of.length, hull.stable, v, float(size), nan, nan, nan, nan, nan, nan, nan, str(error))
            for v in hull.speeds
            for size in sizes
        ]
    rows, beyond = [], found.extrapolated[0] if found.extrapolated is not None else np.inf
    for check in (c for c in found.scheduled if c.knot):
        for size, said in zip(STEPS_RAD[Axis.YAW], check.steps, strict=True):
            row = flown(hull, draw, law_of(schedule), check.speed, size, said, check.phase_least_deg)
            rows.append(replace(row, extrapolated=size >= beyond))
    return rows


def flown(hull: Hull, draw: int, law: np.ndarray, speed: float, size: float, said: StepCheck, margin: float) -> Outcome:
    """Return the outcome of a course step (rad) on the hull, next to its prediction."""
    motion = steered(hull, speed, law, size, FLOWN_S)
    heading = motion[:, 1]
    tail = heading[-round(0.25 * heading.size) :]
    off = np.flatnonzero(np.abs(heading - heading[-600:].mean()) > 0.05 * size)
    settled = float(motion[min(off[-1] + 1, heading.size - 1), 0]) if off.size else 0.0
    return Outcome(
        draw, hull.kind, hull.of.length, hull.stable, speed, float(np.degrees(size)), said.settling_median, *said.settling95,
        settled, float(np.ptp(tail) / size), float(heading.max() / size - 1.0), margin,
    )  # fmt: skip


def line(name: str, rows: list[Outcome]) -> str:
    """Return one line of the table."""
    flights = [r for r in rows if np.isfinite(r.flown)]
    known = [r for r in flights if not np.isnan(r.said)]
    if not known:
        why = "none said" if flights else f"none designed: {rows[0].refused[:60]}"
        return f"{name:34s} {len(rows):5d} {why}"
    # a step that was predicted never to settle counts as 100 % off
    off = np.array([abs(r.flown - r.said) / max(r.said, AT_LEAST_S / WITHIN) if np.isfinite(r.said) else 1.0 for r in known])
    held = 100.0 * float(np.mean([r.as_said for r in known]))
    below = 100.0 * float(np.mean([r.in_band for r in known]))
    return (
        f"{name:34s} {len(known):5d} {len(rows) - len(known):4d} {100 * np.median(off):7.0f} {100 * off.max():8.0f} {held:9.0f} "
        f"{below:9.0f} {sum(r.hunts for r in flights):5d} {100 * max(r.overshoot for r in known):7.0f} "
        f"{min(r.margin for r in known):8.0f}"
    )


def table(rows: list[Outcome]) -> list[str]:
    """Return the lines of the table: all hulls, then by kind, size of step, extrapolation and stability."""
    heads = "rows none   mid %  worst %  as said% in band %  hunt  over %   margin"
    lines = [f"{'settling flown against said':34s}  {heads}", line("all", rows)]
    lines += [line(f"  {kind}", part) for kind in KINDS if (part := [r for r in rows if r.kind == kind])]
    sizes = sorted({r.step_deg for r in rows})
    lines += [line(f"  {size:.0f} deg", [r for r in rows if r.step_deg == size]) for size in sizes]
    for said, beyond in (("turns the runs held", False), ("extrapolated, as verify says", True)):
        if part := [r for r in rows if r.extrapolated == beyond]:
            lines.append(line(f"  {said}", part))
    for said, stable in (("stable", True), ("unstable without a pilot", False)):
        if part := [r for r in rows if r.stable == stable]:
            lines.append(line(f"  {said}", part))
    return lines


def main() -> None:
    """Draw, fly, identify, design, verify, steer, and print the table."""
    asked = argparse.ArgumentParser(description=__doc__)
    asked.add_argument("--draws", type=int, default=7)
    asked.add_argument("--first", type=int, default=0)
    asked.add_argument("--seed", type=int, default=7)
    asked.add_argument("--controller", default="pd")
    asked.add_argument("--set", choices=SETS, default=SETS[0])
    asked.add_argument("--json", type=Path)
    given = asked.parse_args()
    rows: list[Outcome] = []
    begun = time.monotonic()
    for draw in range(given.first, given.first + given.draws):
        hull = draw_hull(draw, given.seed)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            rows += evaluate(hull, draw, given.seed, given.controller, given.set)
        print(f"{draw} {hull.kind} {time.monotonic() - begun:.0f} s", file=sys.stderr, flush=True)
        if given.json:
            given.json.write_text(json.dumps([asdict(r) for r in rows]))
    print("\n".join(table(rows)))


if __name__ == "__main__":
    main()
