"""The blind bank: hide an effect in a truth that fieldsid does not know, ask `diagnose`, and count.

    python tests/benchmarks/hidden_effects.py --cases 200 --seed 1 [--jobs 2] [--kind single] [--first 0] [--json out.json]

Prints the table of targets, then every miss as `truth -> verdict effects`. Writes nothing but what --json names.
`--dry` makes the cases only and prints what is in the bank.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import os
import sys
import time
import traceback
from collections import Counter
from pathlib import Path

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(name, "1")
sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np  # noqa: E402
from truth.bank import KINDS, make_case  # noqa: E402
from truth.remus_cases import remus_case  # noqa: E402
from truth.scene import GUSTY  # noqa: E402

CHANNELS = {"angle_rad": "angle_rms_rad", "rate_rad_s": "rate_rms_rad_s"}


def main(argv=None):
    """Run the bank and print the table; returns the exit code."""
    options = parse(argv)
    tasks = [
        (i, options.seed, options.kind, options.sensors, options.dry) for i in range(options.first, options.first + options.cases)
    ]
    rows = []
    for row in results(tasks, options.jobs):
        rows.append(row)
        print(f"{len(rows)}/{len(tasks)} {one_line(row)}", file=sys.stderr, flush=True)
    rows.sort(key=lambda r: r["name"])
    print(contents(rows))
    if not options.dry:
        print(table(rows))
        print(misses(rows))
    if options.json:
        Path(options.json).write_text(json.dumps(rows, indent=1, default=float), encoding="utf-8")
    return 0


def parse(argv):
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cases", type=int, default=200)
    parser.add_argument("--first", type=int, default=0, help="index of the first case")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--kind", choices=[*KINDS, "remus"], default=None)
    parser.add_argument("--sensors", type=float, default=1.0, help="share of the sensors' noise in the logs; 0 as a simulator's")
    parser.add_argument("--dry", action="store_true", help="make the cases, do not diagnose")
    parser.add_argument("--json", default=None, metavar="FILE")
    return parser.parse_args(argv)


def results(tasks, jobs):
    """Rows as they come, from this process or several."""
    if jobs <= 1:
        yield from map(run_case, tasks)
        return
    with multiprocessing.get_context("spawn").Pool(jobs) as pool:
        yield from pool.imap_unordered(run_case, tasks)


def run_case(task):
    """Make one case, diagnose it, and keep what the table needs."""
    index, seed, kind, sensors, dry = task
    case = remus_case(index, seed) if kind == "remus" else make_case(index, seed, kind=kind, sensors=sensors)
    row = {
        "name": case.name, "index": index, "kind": case.kind, "axis": case.axis,
        "truth": list(case.details["causes"]), "accepts": sorted(case.accepts), "effects_hidden": list(case.effects),
        "expected": sorted(case.expected), "ratio": case.ratio,
        "ratio_training": case.ratio_training, "visible": case.visible, "causes": case.details["causes"],
        "colour": case.details.get("colour"), "cross_measured": case.details.get("cross_measured"),
    }  # fmt: skip
    return row if dry else row | answer(case)


def answer(case):
    """What `diagnose` says of a case, and how long it took."""
    from fieldsid.diagnosis import diagnose
    from fieldsid.logs.run import Run
    from fieldsid.models.axis import Axis

    def runs(logs, what):
        signals = ({k: v for k, v in log.items() if k != "time_s"} for log in logs)
        return [Run(f"{what}{i}", log["time_s"], s) for i, (log, s) in enumerate(zip(logs, signals, strict=True), 1)]

    training, validation = runs(case.training, "train"), runs(case.validation, "check")
    started = time.perf_counter()
    try:
        said = diagnose(training, Axis(case.axis), validation)
    except Exception:  # noqa: BLE001  a crash is one of the answers that are counted
        return {"verdict": "error", "said": [], "ranked": [], "error": traceback.format_exc(limit=-3), "seconds": 0.0}
    seconds = time.perf_counter() - started
    ratios = [getattr(said.final.validation, CHANNELS[c]) / case.floor[c] for c in CHANNELS]
    estimated = {c: _floor(said.noise_floor, c) / case.floor[c] for c in CHANNELS}
    return {
        "verdict": str(said.verdict), "said": list(said.effects), "seconds": seconds,
        "ranked": [str(c.effect) for c in said.candidates[:5]],
        "probability": [float(c.probability) for c in said.candidates[:5]],
        "over_floor": float(np.sqrt(np.mean(np.square(ratios)))), "floor_estimate": estimated,
    }  # fmt: skip


def _floor(noise_floor, channel):
    """Floor of a channel, whether it comes as a mapping or as a record of angle and rate."""
    if isinstance(noise_floor, dict):
        return noise_floor[channel]
    return getattr(noise_floor, channel.partition("_")[0])


def first(row):
    """The effect named first: of the verdict when it names any, else the best candidate's."""
    order = row["said"] or (row["ranked"][0].split("+") if row["ranked"] else [""])
    return order[0]


def first_three(row):
    """Effects among the first three answers."""
    return {first(row)} | {part for name in row["ranked"][:3] for part in name.split("+")}


def right(row):
    """Whether the answer is the one the case's truth deserves."""
    if row["kind"] in ("single", "imperfect", "remus"):
        return first(row) in row["accepts"]
    if row["kind"] == "pair":
        missing = set(row["effects_hidden"]) - set(row["said"])
        return not missing or (missing == {"clock_offset"} and "delay" in row["accepts"] and "delay" in row["said"])
    return row["verdict"] in row["expected"]


def share(rows, test):
    """A share with its count, as text."""
    hits = sum(map(test, rows))
    return f"{hits / len(rows):6.3f}  ({hits}/{len(rows)})" if rows else "   -    (0)"


def table(rows):
    """The figures of the issue, one a line, with their targets."""
    seen = [r for r in rows if r["visible"]]
    of = {kind: [r for r in seen if r["kind"] == kind] for kind in (*KINDS, "remus")}
    nothing = [r for r in rows if r["kind"] == "none"]
    known = [r for r in seen if r["kind"] in ("single", "imperfect", "pair", "remus") and "over_floor" in r]
    calm = [r for r in known if r["colour"] not in GUSTY]
    over = np.array([r["over_floor"] for r in known])
    seconds = np.array([r["seconds"] for r in rows])
    lines = [
        ("right effect first, singles", ">= 0.95", share(of["single"], right)),
        ("  and the verdict says `effect`", "", share(of["single"], lambda r: right(r) and r["verdict"] == "effect")),
        ("  and nothing else is added", "", share(of["single"], lambda r: right(r) and len(r["said"]) == 1)),
        ("right effect first, imperfect forms", ">= 0.93", share(of["imperfect"], right)),
        ("right in the first three, singles", ">= 0.99", share(of["single"], lambda r: bool(first_three(r) & set(r["accepts"])))),
        ("false alarm when nothing is missing", "<= 0.05", share(nothing, lambda r: not right(r))),
        ("  of which `effect`", "", share(nothing, lambda r: r["verdict"] == "effect")),
        ("no effect named when not in the catalogue", ">= 0.90", share(of["uncatalogued"], right)),
        ("  of which `disturbed`", "", share(of["uncatalogued"], lambda r: r["verdict"] == "disturbed")),
        ("both of two effects", ">= 0.85", share(of["pair"], right)),
        ("one of the REMUS' own effects first", "", share(of["remus"], right)),
        ("error over floor, unseen runs: median", "<= 1.02", f"{np.median(over):6.3f}" if known else "   -"),
        ("  share within 1.15", ">= 0.95", share(known, lambda r: r["over_floor"] <= 1.15)),
        ("  share within 1.15, calm days", "", share(calm, lambda r: r["over_floor"] <= 1.15)),
        ("  95th percentile", "<= 1.15", f"{np.percentile(over, 95):6.3f}" if known else "   -"),
        ("time per case: median s", "<= 3", f"{np.median(seconds):6.2f}"),
        ("  worst s", "<= 10", f"{seconds.max():6.2f}"),
        ("crashed", "0", str(sum(r["verdict"] == "error" for r in rows))),
    ]
    return "\n".join(f"{what:<42}{target:>8}   {value}" for what, target, value in lines)


def contents(rows):
    """How many cases of each kind, and how many of them stand clear of the floor."""
    count, clear = Counter(r["kind"] for r in rows), Counter(r["kind"] for r in rows if r["visible"])
    parts = [f"{kind} {count[kind]} ({clear[kind]} above the floor)" for kind in count]
    return f"{len(rows)} cases: " + ", ".join(sorted(parts)) + "\n"


def one_line(row):
    """A case in one line: truth, visibility, answer."""
    truth = "+".join(row["truth"]) or "nothing"
    head = f"{row['name']:<20} {row['axis']:<5} {truth:<34} x{row['ratio']:.2f}/{row['ratio_training']:.2f}"
    if "verdict" not in row:
        return head
    mark = "ok " if right(row) else ("-- " if not row["visible"] and row["kind"] != "none" else "BAD")
    said = "+".join(row["said"]) or "none"
    return f"{head} {mark} {row['verdict']} {said} [{', '.join(row['ranked'][:3])}] {row['seconds']:.1f} s"


def misses(rows):
    """The confusion list: every wrong answer above the floor."""
    wrong = [r for r in rows if not right(r) and (r["visible"] or r["kind"] == "none")]
    lines = ["", f"{len(wrong)} misses:"]
    for row in wrong:
        lines.append(one_line(row) + (f" x{row['over_floor']:.2f} after" if "over_floor" in row else ""))
        lines += [row["error"]] if "error" in row else []
    return "\n".join(lines)


if __name__ == "__main__":
    sys.exit(main())
