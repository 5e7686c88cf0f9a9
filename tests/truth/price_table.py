"""What the prices of the gains' cost decide: each moved by 20 %, the gains designed again and flown on the hulls themselves.

Every hull is drawn, flown with sensor noise and identified once; what is said of a price is over hulls, speeds and steps:
    python tests/truth/price_table.py --draws 14 --seed 7 [--share 0.2] [--prices LACK_PRICE,OWN_PRICE]
Settled is the 95 % band of 5 % about the course, hunts is a limit cycle: as in `gain_table.py`.
"""

from __future__ import annotations

import argparse
import sys
import time
import warnings
from dataclasses import dataclass
from pathlib import Path
from unittest.mock import patch

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from fieldsid.errors import FieldsidError
from fieldsid.logs.run import Run
from fieldsid.models.axis import Axis
from fieldsid.plant.parameter_source import ParameterSource
from fieldsid.schedule import optimum
from fieldsid.schedule.wish import Wish
from fieldsid.schedule.make import design_schedule
from fieldsid.schedule.verify import STEPS_RAD
from truth.gain_table import FLOWN_S, HUNTS, identified, law_of
from truth.maneuvering.hulls import Hull, draw_hull
from truth.maneuvering.steered import steered
from truth.maneuvering.trials import SETS

PRICES = ("LACK_PRICE", "BANDWIDTH_PRICE", "DAMPING_PRICE", "BEYOND_PRICE", "OWN_PRICE")
SETTLED = 0.05


@dataclass(frozen=True, slots=True)
class Flights:
    """Settling (s), overshoot and swing over the step of the flights of a schedule, (n,) each, and its kp and kd, (k,)."""

    settling: np.ndarray
    overshoot: np.ndarray
    swing: np.ndarray
    gains: np.ndarray


def flights(hull: Hull, source: ParameterSource, runs: list[Run], controller: str) -> Flights | None:
    """Return the flights of the schedule that is designed now, None where none is."""
    try:
        schedule = design_schedule(source, hull.rudder_limit, wish=Wish(controller), runs=runs)
    except FieldsidError:
        return None
    law, found = law_of(schedule), []
    for speed in hull.speeds:
        for size in STEPS_RAD[Axis.YAW]:
            motion = steered(hull, speed, law, size, FLOWN_S)
            heading = motion[:, 1]
            off = np.flatnonzero(np.abs(heading - heading[-600:].mean()) > SETTLED * size)
            settled = float(motion[min(off[-1] + 1, heading.size - 1), 0]) if off.size else 0.0
            tail = heading[-round(0.25 * heading.size) :]
            found.append((settled, heading.max() / size - 1.0, np.ptp(tail) / size))
    return Flights(*np.array(found).T, law[:, [1, 3]])


def line(name: str, pairs: list[tuple[Flights, Flights]]) -> str:
    """Return one line: what moved from the schedules with the prices as they are to those with one of them moved."""
    gains = np.concatenate([((b.gains - a.gains) / np.where(a.gains == 0.0, 1.0, a.gains)).ravel() for a, b in pairs])
    slower = np.concatenate([np.log(np.maximum(b.settling, 0.1) / np.maximum(a.settling, 0.1)) for a, b in pairs])
    over = np.concatenate([b.overshoot - a.overshoot for a, b in pairs])
    hunts = sum(int(np.sum(b.swing > HUNTS)) - int(np.sum(a.swing > HUNTS)) for a, b in pairs)
    return (
        f"{name:24s} {slower.size:6d} {100 * np.median(np.abs(gains)):8.1f} {100 * np.abs(gains).max():8.1f} "
        f"{100 * slower.mean():+9.2f} {100 * slower.min():+8.1f} {100 * slower.max():+8.1f} {100 * over.max():+8.1f} {hunts:+6d}"
    )


def main() -> None:
    """Draw, fly and identify; design and fly with each price moved; print the table."""
    asked = argparse.ArgumentParser(description=__doc__)
    asked.add_argument("--draws", type=int, default=7)
    asked.add_argument("--first", type=int, default=0)
    asked.add_argument("--seed", type=int, default=7)
    asked.add_argument("--share", type=float, default=0.2)
    asked.add_argument("--controller", default="pd")
    asked.add_argument("--set", choices=SETS, default=SETS[0])
    asked.add_argument("--prices", default=",".join(PRICES))
    given = asked.parse_args()
    moved = [(p, way) for p in given.prices.split(",") for way in (1.0 - given.share, 1.0 + given.share)]
    pairs: dict[tuple[str, float], list[tuple[Flights, Flights]]] = {m: [] for m in moved}
    begun = time.monotonic()
    for draw in range(given.first, given.first + given.draws):
        hull = draw_hull(draw, given.seed)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            source, runs = identified(hull, draw, given.seed, given.set)
            before = flights(hull, source, runs, given.controller)
            for name, way in moved:
                with patch.object(optimum, name, way * getattr(optimum, name)):
                    after = flights(hull, source, runs, given.controller)
                if before is not None and after is not None:
                    pairs[name, way].append((before, after))
        print(f"{draw} {hull.kind} {time.monotonic() - begun:.0f} s", file=sys.stderr, flush=True)
    heads = "flights gain mid  most %  slower %    least     most   over %   hunt"
    print(f"{'':24s} {heads}")
    for (name, way), found in pairs.items():
        print(line(f"{name} x {way:g}", found) if found else f"{name} x {way:g}: none designed")


if __name__ == "__main__":
    main()
