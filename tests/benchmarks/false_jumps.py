"""How often the live estimate tells a jump of authority that is not there, and how soon it tells one that is.

    python ../shared/bank/generate.py --out DIR --seed 3052 --scale 0.5 --hard --forms
    python tests/benchmarks/false_jumps.py DIR [DIR ...] [--cases 54]

The runs of a case of the second bank's form are flown one after the other, at their own speeds, with a hidden effect in most: no
authority jumps, but for that of `step_change`. Then linear vehicles lose or gain authority, and damping with it, after a minute.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "tests"), str(ROOT), str(ROOT / "tests" / "benchmarks")]

from online_flights import flown  # noqa: E402
from second_bank import run_of  # noqa: E402

from fieldsid.models.axis import Axis  # noqa: E402
from fieldsid.models.record import record_of  # noqa: E402
from fieldsid.online import OnlineIdentifier  # noqa: E402

BETWEEN_S, BEFORE_S, LOOK_EVERY = 5.0, 65.0, 20
CHANGES = ((0.5, 1.0), (0.7, 1.0), (0.7, 0.7), (0.5, 0.5), (1.4, 1.4))
"""Factors of the authority and of the damping."""


def told(folder):
    """The jumps told on the runs of one case, and how long they are together in s."""
    about = json.loads((folder / "case.json").read_text(encoding="utf-8"))
    online, begin, known, jumps = OnlineIdentifier(about["axis"]), 0.0, None, []
    for name in (*about["train"], *about["valid"]):
        r = record_of(run_of(folder / name), Axis(about["axis"]))
        angle, rate = (np.where(ok, v, np.nan) for v, ok in zip(r.both, r.ok, strict=True))
        for i, sample in enumerate(zip(begin + r.time, r.fin, angle, rate, strict=True)):
            online.update(*map(float, sample), r.speed, fin_is_held=r.fin_is_held)
            if i % LOOK_EVERY == 0 and (jump := online.estimate().jump) != known:
                jumps.append(f"{folder.name} {name}: x {jump.factor:.2f} +/- {jump.std_error:.2f} at {jump.time - begin:.0f} s")
                known = jump
        begin += float(r.time[-1]) + BETWEEN_S
    return jumps, begin


def seconds_until_told(axis, factor, damped, seed):
    """How long after the change a jump is told, NaN where none is."""
    online = OnlineIdentifier(axis)
    for sample in zip(*flown(axis, seed=seed), strict=True):
        online.update(*map(float, sample))
    after = zip(*flown(axis, seed=seed + 100, factor=factor, damped=damped), strict=True)
    for i, (time, *rest) in enumerate(after):
        online.update(BEFORE_S + float(time), *map(float, rest))
        if i % LOOK_EVERY == 0 and online.estimate().jump is not None:
            return float(time)
    return float("nan")


def main(argv=None):
    """Print both tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folders", type=Path, nargs="+")
    parser.add_argument("--cases", type=int, default=1000)
    parser.add_argument("--seeds", type=int, default=4)
    options = parser.parse_args(argv)
    for where in options.folders:
        found = [told(case) for case in sorted(where.glob("case_*"))[: options.cases]]
        jumps = [jump for of_case, _ in found for jump in of_case]
        print(f"{where}: {len(jumps)} in {sum(length for _, length in found) / 60:.0f} min", *jumps, sep="\n  ", flush=True)
    for axis in ("yaw", "pitch"):
        for factor, damped in CHANGES:
            after = [seconds_until_told(axis, factor, damped, seed) for seed in range(options.seeds)]
            print(
                f"{axis} authority x {factor}, damping x {damped}: told after",
                " ".join(f"{s:.0f}" for s in after),
                "s",
                flush=True,
            )
    return 0


if __name__ == "__main__":
    sys.exit(main())
