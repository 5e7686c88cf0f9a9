"""The schedule against the best constant gain and the paper's P with feed-forward, on random hulls that nothing was tuned on.

Every hull is drawn, flown with sensor noise, identified from pulses, and steered by each of the three laws at its speeds:
    python tests/truth/against_table.py --draws 7 --seed 7 [--controller pd] [--settling quickest]
`said` is what `verify_schedule` predicts at the rows, `flown` what a step of 20 deg does on the hull itself. The last line counts
the rows where the constant gain is better by more than 1 %: it misses the requirements by less, settles sooner where the row is
too slow, or uses less fin.
"""

from __future__ import annotations

import argparse
import sys
import time
import warnings
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from fieldsid.errors import FieldsidError
from fieldsid.schedule.check import Check
from fieldsid.schedule.make import design_schedule
from fieldsid.schedule.record import Schedule
from fieldsid.schedule.verify import verify_schedule
from fieldsid.schedule.wish import QUICKEST, Wish
from truth.gain_table import FLOWN_S, identified, law_of
from truth.maneuvering.hulls import Hull, draw_hull
from truth.maneuvering.steered import steered

STEP = 0.3490658503988659
PAPER, ONE, OWN = "paper's P", "one constant", "schedule"


@dataclass(frozen=True, slots=True)
class Rows:
    """One law at a hull's k speeds, (k,) each: settling (s) predicted and flown, overshoot and fin use (shares), phase margin."""

    said: np.ndarray
    flown: np.ndarray
    overshoot: np.ndarray
    fin: np.ndarray
    margin: np.ndarray


def rows_of(hull: Hull, law: np.ndarray, checks: list[Check]) -> Rows:
    """Return what the checks predict of a law, and what it does on the hull."""
    settled, over = zip(*(flown(hull, law, c.speed) for c in checks), strict=True)
    said, fin, margin = zip(*((c.steps[1].settling_most, c.outcome.fin, c.phase_least_deg) for c in checks), strict=True)
    return Rows(*(np.array(part, dtype=float) for part in (said, settled, over, fin, margin)))


def flown(hull: Hull, law: np.ndarray, speed: float) -> tuple[float, float]:
    """Return the settling time (s) and the overshoot, as a share, of the step on the hull."""
    motion = steered(hull, speed, law, STEP, FLOWN_S)
    heading = motion[:, 1]
    off = np.flatnonzero(np.abs(heading - heading[-600:].mean()) > 0.05 * STEP)
    return float(motion[min(off[-1] + 1, heading.size - 1), 0]) if off.size else 0.0, float(heading.max() / STEP - 1.0)


def compared(hull: Hull, draw: int, seed: int, wish: Wish) -> tuple[dict[str, Rows], int]:
    """Return the rows of each law on one hull, and at how many rows the constant gain is better."""
    source, runs = identified(hull, draw, seed, "pulses")
    own = design_schedule(source, hull.rudder_limit, wish=wish, runs=runs)
    found = verify_schedule(own, source, runs=runs)
    one = replace(own, rows=tuple(replace(r, gains=found.constant_row.gains) for r in own.rows))
    both = ((OWN, own, found.scheduled), (ONE, one, found.constant))
    laws = {name: rows_of(hull, law_of(s), [c for c in checks if c.knot]) for name, s, checks in both}
    try:
        paper: Schedule = design_schedule(source, hull.rudder_limit, wish=Wish("p"), runs=runs)
        checks = [c for c in verify_schedule(paper, source, runs=runs).scheduled if c.knot]
        laws[PAPER] = rows_of(hull, law_of(paper), checks)
    except FieldsidError as error:
        print(f"  {PAPER}: {error.what}", file=sys.stderr)
    return laws, len(found.worse)


def line(name: str, rows: Rows) -> str:
    """Return one line of the table: ranges over the speeds; the fin from the slowest speed to the fastest."""
    spans = [f"{part.min():6.2f} .. {part.max():6.2f}" for part in (rows.said, rows.flown)]
    over, fin = 100.0 * rows.overshoot.max(), 100.0 * rows.fin
    return f"  {name:14s} {spans[0]}   {spans[1]} {over:7.1f} {fin[0]:6.0f} .. {fin[-1]:4.0f} {rows.margin.min():7.0f}"


def main() -> None:
    """Draw, fly, identify, design, verify, steer, and print the table."""
    asked = argparse.ArgumentParser(description=__doc__)
    asked.add_argument("--draws", type=int, default=7)
    asked.add_argument("--first", type=int, default=0)
    asked.add_argument("--seed", type=int, default=7)
    asked.add_argument("--controller", default="pd")
    asked.add_argument("--settling", choices=["quickest"])
    given = asked.parse_args()
    wish, begun, worse = Wish(given.controller, settling=QUICKEST if given.settling else None), time.monotonic(), 0
    print(f"{'':16s} {'s said':>16s}   {'s flown':>16s}  over %  fin %, slow..fast  margin")
    for draw in range(given.first, given.first + given.draws):
        hull = draw_hull(draw, given.seed)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            laws, count = compared(hull, draw, given.seed, wish)
        worse += count
        print(f"{draw} {hull.kind}, {hull.of.length:.1f} m, {hull.speeds[0]:.2f} .. {hull.speeds[-1]:.2f} m/s")
        print("\n".join(line(name, rows) for name, rows in laws.items()), flush=True)
        print(f"{draw} {time.monotonic() - begun:.0f} s", file=sys.stderr, flush=True)
    print(f"rows that one constant gain is better than by more than 1 %: {worse}")


if __name__ == "__main__":
    main()
