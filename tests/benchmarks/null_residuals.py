"""The residual tests where nothing is missing: are their p-values uniform, or at least not too small too often?

    python tests/benchmarks/null_residuals.py --cases 300 --seed 1 [--first 0] [--colour ar1] [--json out.json]

Logs of the repository's own bank with no effect hidden, in its four kinds of noise in turn (white sensors, a disturbance moment,
sensors that wander, both). Of each the base model is fitted as `diagnose` does it and its innovations are tested. Prints how
often each p-value is below a level, with the 95 % interval of that share (Clopper and Pearson).
"""

from __future__ import annotations

import argparse
import json
import os
import sys
from pathlib import Path

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(name, "1")
ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "tests"), str(ROOT)]

import numpy as np  # noqa: E402
from truth.bank import make_case  # noqa: E402
from truth.shares import interval  # noqa: E402

from fieldsid.diagnosis.evidence.noise_kind import joint_noise_fit  # noqa: E402
from fieldsid.diagnosis.residual_tests.residual_tests import residual_tests  # noqa: E402
from fieldsid.diagnosis.search.search import Search  # noqa: E402
from fieldsid.effects import all_effects  # noqa: E402
from fieldsid.logs.run import Run  # noqa: E402
from fieldsid.models.axis import Axis  # noqa: E402
from fieldsid.models.record import record_of  # noqa: E402

COLOURS = ("white", "disturbance", "ar1", "both")
LEVELS = (0.2, 0.1, 0.05, 0.02, 0.01)
TESTS = {"all three": "p", "dependence": "dependence", "bursts": "bursts", "whiteness": "colour"}
"""The tests by name, and the field of `ResidualTests` that has the p-value; the first is what a verdict takes."""


def null_row(index, seed, colour):
    """The p-values of the base model's innovations on one log without an effect."""
    case = make_case(index, seed, kind="none", colour=colour)
    axis = Axis(case.axis)

    def records(logs, what):
        signals = ({k: v for k, v in log.items() if k != "time_s"} for log in logs)
        runs = [Run(f"{what}{i}", log["time_s"], s) for i, (log, s) in enumerate(zip(logs, signals, strict=True), 1)]
        return tuple(record_of(run, axis) for run in runs)

    work = Search(records(case.training, "train"), records(case.validation, "check"), axis, tuple(all_effects(axis).values()))
    ml_fit = joint_noise_fit(work.base().likelihood_fit, work.parallel)
    left = residual_tests(ml_fit)
    return {
        "name": case.name, "colour": colour, "noise_kind": ml_fit.noise_kind, "moves_with": left.moves_with,
        "p": {test: float(getattr(left, field)) for test, field in TESTS.items()},
    }  # fmt: skip


def table(rows):
    """Share of p-values below each level, by test and kind of noise."""
    lines = []
    for test in TESTS:
        for colour in ("all", *dict.fromkeys(r["colour"] for r in rows)):
            p = np.array([r["p"][test] for r in rows if colour in ("all", r["colour"])])
            parts = []
            for level in LEVELS:
                low, high = interval(int(np.sum(p < level)), p.size)
                parts.append(f"<{level:g}: {np.mean(p < level):.3f} ({low:.3f}-{high:.3f})")
            lines.append(f"{test:<11}{colour:<12}{p.size:>4}  " + "  ".join(parts))
    return "\n".join(lines)


def main(argv=None):
    """Test the null logs and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cases", type=int, default=300)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--colour", choices=COLOURS, default=None)
    parser.add_argument("--json", type=Path, default=None)
    options = parser.parse_args(argv)
    rows = []
    for index in range(options.first, options.first + options.cases):
        rows.append(null_row(index, options.seed, options.colour or COLOURS[index % len(COLOURS)]))
        if rows[-1]["p"]["all three"] < 0.05:
            print(rows[-1], file=sys.stderr, flush=True)
        if options.json:
            options.json.write_text(json.dumps(rows, indent=1), encoding="utf-8")
    print(table(rows))
    return 0


if __name__ == "__main__":
    sys.exit(main())
