"""Predicted full-rudder radius of random hulls that nothing was tuned on: errors, coverage and width of the bands.

Every hull is drawn, flown with sensor noise, identified, and turned to both sides at five speeds:
    python tests/truth/radius_table.py --draws 300 --seed 7 --json rows.json [--minutes 8] [--sets pulses,pulses+zigzag]
    python tests/truth/radius_table.py --pool rows.json more.json
Rows are saved after every hull; the same command resumes where the last one ended. With `--minutes` it ends after so many.
With `--length` the hull's length is stated, as in vehicle.yaml.
Further sets: pulses+uturn, pulses+half, "pulses+zigzag by rpm".
Of every fourteen hulls seven log no sway. The prior was made with seed 1 (`radius_prior.py`): use another one.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
import warnings
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from fieldsid.errors import FieldsidError
from fieldsid.fitting.identify import identify
from fieldsid.logs.run import Run
from fieldsid.models.axis import Axis
from fieldsid.plant.parameter_source import source_of_models
from fieldsid.turning.radius import turn_radius
from truth.maneuvering.hulls import KINDS, Hull, draw_hull
from truth.maneuvering.motion import true_turn
from truth.maneuvering.trials import MORE_SETS, SETS, TURNS, Log, training

EFFECTS = ("servo_lag", "sway_coupling", "quadratic_damping")
WANTED = {"pulses": 0.8, "pulses+zigzag": 0.35, "pulses+circle": 0.35} | dict.fromkeys(MORE_SETS, 0.35)
"""Largest desired width of the band, as a share of the radius."""


@dataclass(frozen=True, slots=True)
class Outcome:
    """One predicted turn and the true one, in m; the prediction is NaN where it was refused."""

    draw: int
    kind: str
    training: str
    sway: bool
    speed: float
    side: str
    truth: float
    radius: float
    low: float
    high: float
    trust: str
    refused: str = ""
    seed: int = 0
    length_stated: bool = False

    @property
    def error(self) -> float:
        """Relative error of the prediction."""
        return self.radius / self.truth - 1.0

    @property
    def holds(self) -> bool:
        """Whether the band contains the true radius."""
        return self.low <= self.truth <= self.high

    @property
    def width(self) -> float:
        """Width of the band as a share of the true radius."""
        return (self.high - self.low) / self.truth


def as_run(log: Log) -> Run:
    """Return a log as a Run of the package."""
    return Run(log.name, log.time, log.columns)


def evaluate(hull: Hull, draw: int, which: str, seed: int, *, length_stated: bool) -> list[Outcome]:
    """Return the predicted turns of one hull from one training set, its length stated or not."""
    sway = draw // len(KINDS) % 2 == 0
    rng = np.random.default_rng([seed, draw, (*SETS, *MORE_SETS).index(which)])
    logs = training(hull, which, rng, sway=sway)
    truth = {(v, side): true_turn(hull, v, sign)[0] for v in hull.speeds for side, sign in (("port", -1.0), ("starboard", 1.0))}
    nan, length = float("nan"), hull.of.length if length_stated else None

    def outcome(key: tuple[float, str], radius: float, low: float, high: float, trust: str, refused: str = "") -> Outcome:
        of, turn = (draw, hull.kind, which, sway, *key), (truth[key], radius, low, high)
        return Outcome(*of, *turn, trust, refused, seed, length_stated)

    try:
        models = []
        for speed in hull.speeds:
            runs = [as_run(log) for log in logs if log.speed == speed and log.name not in TURNS and "surge_m_s" in log.columns]
            models += [f.model for f in identify(runs, Axis.YAW, effects=EFFECTS, joint=len(runs) > 1)]
        source = source_of_models(models, [f"m{i}" for i in range(len(models))])
        circles = [as_run(log) for log in logs if log.name in TURNS]
        runs = [as_run(log) for log in logs if log.name not in TURNS]
        found = turn_radius(source, hull.speeds, hull.rudder_limit, runs=runs, measured=circles, length=length)
    except FieldsidError as error:
        return [outcome(key, nan, nan, nan, "refused", str(error)) for key in truth]
    return [outcome((r.speed, r.side), r.radius, *r.interval95, r.trust) for r in found.rows]


def line(name: str, rows: list[Outcome]) -> str:
    """Return one line of the table."""
    known = [r for r in rows if np.isfinite(r.radius) and np.isfinite(r.truth)]
    if not known:
        return f"{name:42s} {len(rows):5d}  none predicted"
    off = 100.0 * np.abs([r.error for r in known])
    bias = 100.0 * float(np.median([r.error for r in known]))
    held = 100.0 * float(np.mean([r.holds for r in known]))
    width = np.array([r.width for r in known])
    p90 = float(np.percentile(off, 90))
    return (
        f"{name:42s} {len(known):5d} {len(rows) - len(known):4d} {bias:+7.1f} {np.median(off):7.1f} {p90:7.1f} {off.max():8.1f} "
        f"{held:7.0f} {np.median(width):7.2f} {np.percentile(width, 90):7.2f}"
    )


def table(rows: list[Outcome]) -> list[str]:
    """Return the lines of the table: for each training set all rows, then by kind, by logged sway and by trust."""
    head = ("rows", "bad", "bias %", "mid %", "90th %", "worst %", "held %", "width", "w 90th")
    wide = (5, 4, 7, 7, 7, 8, 7, 7, 7)
    lines = [" ".join([" " * 42, *(f"{h:>{w}s}" for h, w in zip(head, wide, strict=True))])]
    for which in (*SETS, *MORE_SETS):
        own = [r for r in rows if r.training == which]
        if not own:
            continue
        lines.append(line(f"{which} (width wanted {WANTED[which]})", own))
        lines += [line(f"  {kind}", part) for kind in KINDS if (part := [r for r in own if r.kind == kind])]
        lines += [
            line(f"  sway {'' if s else 'not '}logged", part) for s in (True, False) if (part := [r for r in own if r.sway == s])
        ]
        trusts = sorted({r.trust for r in own} - {"refused"})
        lines += [line(f"  trusted: {t}", [r for r in own if r.trust == t]) for t in trusts]
    return lines


def saved(paths: Sequence[Path]) -> list[Outcome]:
    """Return the rows of some files, without duplicates."""
    rows = [Outcome(**row) for path in paths if path.exists() for row in json.loads(path.read_text())]
    return list({(r.seed, r.draw, r.training, r.length_stated, r.speed, r.side): r for r in rows}.values())


def measured(given: argparse.Namespace) -> list[Outcome]:
    """Return the rows of the given draws and sets, computing those that were not saved before."""
    rows = saved([given.json] if given.json else [])
    done = {(r.seed, r.draw, r.training, r.length_stated) for r in rows}
    begun = time.monotonic()
    for draw in range(given.first, given.first + given.draws):
        missing = [which for which in given.sets.split(",") if (given.seed, draw, which, given.length) not in done]
        if not missing:
            continue
        if time.monotonic() - begun > 60.0 * given.minutes:
            print(f"stopped before hull {draw}: the same command goes on", file=sys.stderr)
            break
        hull = draw_hull(draw, given.seed)
        for which in missing:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                rows += evaluate(hull, draw, which, given.seed, length_stated=given.length)
        print(f"{draw} {hull.kind} {time.monotonic() - begun:.0f} s", file=sys.stderr, flush=True)
        if given.json:
            given.json.write_text(json.dumps([asdict(r) for r in rows]))
    return rows


def main() -> None:
    """Draw, fly, identify, turn, and print the table; with `--pool` print that of saved rows."""
    asked = argparse.ArgumentParser(description=__doc__)
    asked.add_argument("--draws", type=int, default=14)
    asked.add_argument("--first", type=int, default=0)
    asked.add_argument("--seed", type=int, default=7)
    asked.add_argument("--sets", default=",".join(SETS))
    asked.add_argument("--length", action="store_true", help="state the hull's length")
    asked.add_argument("--minutes", type=float, default=float("inf"))
    asked.add_argument("--json", type=Path)
    asked.add_argument("--pool", type=Path, nargs="+", default=())
    given = asked.parse_args()
    print("\n".join(table(saved(given.pool) if given.pool else measured(given))))


if __name__ == "__main__":
    main()
