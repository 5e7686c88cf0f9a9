"""What 20 % more or less of each threshold of a diagnosis costs, on cases of one bank or two.

    python tests/benchmarks/threshold_sensitivity.py --cases 20 --seed 1 [--bank DIR] [--only NAME ...] [--json out.json]

Cases are of the repository's own bank (tests/truth/bank.py), and of a folder of case.json, key.json, train_*.csv and valid_*.csv
where one is given. Prints for each threshold how many verdicts are right with 0.8, 1 and 1.2 times its value, and how
many differ from those at 1. A threshold that is a table is scaled in its shares; a share stays below one.
"""

from __future__ import annotations

import argparse
import importlib
import json
import os
import pkgutil
import sys
from pathlib import Path

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(name, "1")
sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from truth.bank import make_case  # noqa: E402

import fieldsid.diagnosis  # noqa: E402
from fieldsid.diagnosis import thresholds  # noqa: E402

NAMES = [n for n in vars(thresholds) if n.isupper()]
ROOMS = [importlib.import_module(m.name) for m in pkgutil.walk_packages(fieldsid.diagnosis.__path__, "fieldsid.diagnosis.")]


def main() -> int:
    """Run the cases under each value and print the table; returns the exit code."""
    options = parse()
    cases = [*own_cases(options.cases, options.seed), *(folder_cases(options.bank, options.cases) if options.bank else ())]
    usual = [case() for case in cases]
    right = sum(ok for ok, _ in usual)
    print(
        f"{len(cases)} cases, {right} right\n\n| threshold | right at 0.8 | at 1.2 | verdicts that differ |\n|---|---|---|---|",
        flush=True,
    )
    table = {}
    for name in options.only or NAMES:
        found = {}
        for factor in (0.8, 1.2):
            set_threshold(name, scaled(getattr(thresholds, name), factor))
            found[factor] = [case() for case in cases]
            set_threshold(name, getattr(thresholds, name))
        counts = [sum(ok for ok, _ in found[f]) for f in (0.8, 1.2)]
        differ = [sum(a != b for (_, a), (_, b) in zip(found[f], usual, strict=True)) for f in (0.8, 1.2)]
        table[name] = {"right": counts, "differ": differ}
        print(f"| `{name}` | {counts[0]} | {counts[1]} | {differ[0]}, {differ[1]} |", flush=True)
        if options.json:
            options.json.write_text(json.dumps({"cases": len(cases), "right": right, "thresholds": table}, indent=1))
    return 0


def parse():
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cases", type=int, default=20, help="of each bank")
    parser.add_argument("--seed", type=int, default=1, help="of the own bank")
    parser.add_argument("--bank", type=Path, help="folder of another bank")
    parser.add_argument("--only", nargs="*", choices=NAMES, help="thresholds, by default all")
    parser.add_argument("--json", type=Path)
    return parser.parse_args()


def own_cases(count, seed):
    """Callables of the own bank's first cases: whether the verdict is right, and what it is."""

    def run(index):
        case = make_case(index, seed)
        runs = [fs_run(f"train_{i}", log) for i, log in enumerate(case.training)]
        judged = [fs_run(f"valid_{i}", log) for i, log in enumerate(case.validation)]

        def answer():
            d = diagnosis(runs, case.axis, judged)
            named = not case.effects or bool(set(d.effects) & case.accepts)
            return d.verdict in case.expected and (named or d.verdict != "effect"), said(d)

        return answer

    return [run(i) for i in range(count)]


def folder_cases(folder, count):
    """Callables of a folder's first cases, one of each effect first."""
    import fieldsid as fs

    keys = {p.parent: json.loads(p.read_text()) for p in sorted(folder.glob("*/key.json"))}
    keys = {p: k for p, k in keys.items() if not k.get("weak")}
    first, seen = [], set()
    for path, key in keys.items():
        kind = "+".join(key["effects"]) or key["kind"]
        if kind not in seen:
            seen.add(kind)
            first.append(path)
    chosen = [*first, *(p for p in keys if p not in first)][:count]

    def run(path, key):
        runs, judged = (list(fs.load(sorted(path.glob(pattern)))) for pattern in ("train_*.csv", "valid_*.csv"))

        def answer():
            d = diagnosis(runs, key["axis"], judged)
            ok = (
                set(d.effects) & set(key["effects"])
                if key["effects"]
                else d.verdict in ("sufficient", "disturbed") or (key["kind"] != "none" and d.verdict == "unexplained")
            )
            return bool(ok), said(d)

        return answer

    return [run(path, keys[path]) for path in chosen]


def diagnosis(runs, axis, judged):
    """The diagnosis of some runs."""
    import fieldsid as fs

    return fs.diagnose(runs, axis, validate=judged)


def fs_run(name, log):
    """A log of the truth simulator as a run."""
    from fieldsid.logs.run import Run

    columns = dict(log)
    return Run(name, columns.pop("time_s"), columns)


def said(d):
    """A verdict with the effects it names."""
    return f"{d.verdict} {'+'.join(sorted(d.effects))}"


def set_threshold(name, value):
    """Give a threshold another value wherever it has been imported."""
    for room in ROOMS:
        if hasattr(room, name) and room is not thresholds:
            setattr(room, name, value)


def scaled(value, factor):
    """A threshold times a factor; of a table of shares and p-values, the shares."""
    if isinstance(value, tuple):
        return tuple((min(share * factor, 0.999), p) for share, p in value)
    return value * factor


if __name__ == "__main__":
    sys.exit(main())
