"""What `sysid diagnose` takes from its start to its end, on CSV files, and what `diagnose` takes inside a process that runs.

    python tests/benchmarks/command_line.py --cases 20 --seed 1

Prints a line per case, then the medians, the worst, and their difference: the start of Python, imports, reading.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

sys.path[:0] = [str(Path(__file__).resolve().parents[1]), str(Path(__file__).resolve().parents[2])]

from hidden_effects import answer, run_case  # noqa: E402
from truth.bank import make_case  # noqa: E402


def main():
    """Time the cases both ways."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cases", type=int, default=20)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    run_case((0, options.seed, None, 1.0, False))  # what is compiled is compiled, what is imported is imported
    inside, outside = [], []
    for index in range(options.cases):
        case = make_case(index, options.seed, kind=None)
        row = answer(case)
        with tempfile.TemporaryDirectory() as folder:
            took, said = commanded(case, Path(folder))
        inside.append(row["seconds"])
        outside.append(took)
        same = "" if (said["verdict"], said["effects"]) == (row["verdict"], row["said"]) else f"  and says {said['effects']}"
        print(f"{case.name:22s} {row['verdict']:12s} {row['seconds']:5.2f} s, as a command {took:5.2f} s{same}", flush=True)
    for what, times in (("inside", inside), ("as a command", outside)):
        print(f"{what}: median {np.median(times):.2f} s, worst {max(times):.1f} s")
    print(f"a command takes {np.median(np.subtract(outside, inside)):.2f} s more")


def commanded(case, folder):
    """Seconds that the command takes on a case's logs, and what it says."""
    files = {"train": [], "check": []}
    for kind, logs in (("train", case.training), ("check", case.validation)):
        for i, log in enumerate(logs, 1):
            files[kind].append(path := folder / f"{kind}{i}.csv")
            np.savetxt(path, np.column_stack(list(log.values())), delimiter=",", header=",".join(log), comments="", fmt="%.17g")
    unseen = [word for path in files["check"] for word in ("--validate", path)]
    words = [sys.executable, "-m", "fieldsid", "diagnose", *files["train"], "--axis", case.axis, *unseen, "--json"]
    began = time.perf_counter()
    done = subprocess.run(words, capture_output=True, text=True, check=True, cwd=folder)
    return time.perf_counter() - began, json.loads(done.stdout)


if __name__ == "__main__":
    main()
