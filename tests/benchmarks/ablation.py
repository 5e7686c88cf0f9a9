"""What each stage of a diagnosis earns: banks by other hands, answered with and without it.

    python ../shared/bank/generate.py --out DIR --seed 1 --scale 0.5 --hard --forms
    python tests/benchmarks/ablation.py DIR ../shared/bank6dof/data [--stages whole_hull drop] [--cases 54]

Each stage is a function of the search; without it that function does nothing. The table counts the right effect first, both of
two, an effect named where there is none and where no catalogue has the cause, beside those that the hull has by nature, and
processor time.
A stage that earns less than one case in a hundred on all banks is to be deleted.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import time
from pathlib import Path
from unittest.mock import patch

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(name, "1")
os.environ.setdefault("FIELDSID_IS_WORKER", "1")  # one process, so that processor time is all there is
ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "tests"), str(ROOT), str(ROOT / "tests" / "benchmarks")]

from second_bank import run_of  # noqa: E402

from fieldsid.diagnosis import diagnose  # noqa: E402
from fieldsid.models.axis import Axis  # noqa: E402

SEARCH, MOVES = "fieldsid.diagnosis.search", "fieldsid.diagnosis.moves"
STAGES = {
    "nothing left out": [],
    "whole_hull": [(f"{SEARCH}.search", "whole_hull", lambda base, *_of: base)],
    "variants": [(f"{SEARCH}.search", "try_variants", lambda *_of: False), (f"{MOVES}.grow", "try_variants", lambda *_of: False)],
    "laws": [(f"{SEARCH}.search", "under_other_law", lambda *_of: None)],
    "free_run": [(f"{MOVES}.grounds", "Grounds.fit_from_the_free_run", lambda _grounds, h: h.likelihood_fit)],
    "drop": [(f"{SEARCH}.search", "drop_each", lambda *_of: False)],
}
"""By stage: the module, the name and what stands in its place."""


def asked(folder, stage):
    """The answer to one case without a stage: its kind, what is right, and the time."""
    about = json.loads((folder / "case.json").read_text(encoding="utf-8"))
    training, validation = ([run_of(folder / name) for name in about[part]] for part in ("train", "valid"))
    patches = [patch(f"{module}.{name}", new) for module, name, new in STAGES[stage]]
    for one in patches:
        one.start()
    began = time.process_time()
    try:
        said = diagnose(training, Axis(about["axis"]), validation)
    finally:
        for one in patches:
            one.stop()
    seconds = time.process_time() - began
    key = key_of(folder)
    truth, named = set(key["effects"]), set(said.effects)
    alien = named - set(key.get("natural", ()))
    return {"kind": key["kind"], "first": truth <= named, "exact": truth == named, "named": bool(alien), "seconds": seconds}


def key_of(folder):
    """What is right in a case: in its folder, or in a folder of keys beside that of the cases."""
    own = folder / "key.json"
    file = own if own.is_file() else folder.parents[1] / "keys" / f"{folder.name}.json"
    key = json.loads(file.read_text(encoding="utf-8"))
    return key | {"kind": {"ooc": "out"}.get(key["kind"], key["kind"])}


def row(stage, answers):
    """One line of the table."""
    of = {kind: [a for a in answers if a["kind"].startswith(kind)] for kind in ("single", "combo", "none", "out")}

    def count(kind, key):
        return f"{sum(a[key] for a in of[kind])}/{len(of[kind])}"

    seconds = sorted(a["seconds"] for a in answers)
    times = f"{sum(seconds):6.0f} {seconds[len(seconds) // 2]:6.2f} {seconds[-1]:6.1f}"
    counts = (count("single", "first"), count("combo", "exact"), count("none", "named"), count("out", "named"))
    return f"{stage:18s} " + " ".join(f"{c:>8s}" for c in counts) + f" {times}"


def main(argv=None):
    """Answer the cases with and without each stage and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folders", type=Path, nargs="+")
    parser.add_argument("--stages", nargs="*", default=list(STAGES))
    parser.add_argument("--cases", type=int, default=1000)
    options = parser.parse_args(argv)
    cases = [c for folder in options.folders for c in sorted(folder.iterdir()) if (c / "case.json").is_file()][: options.cases]
    print(f"{'without':18s} {'first':>8s} {'both':>8s} {'false':>8s} {'alien':>8s} {'sum s':>6s} {'median':>6s} {'worst':>6s}")
    for stage in options.stages:
        print(row(stage, [asked(case, stage) for case in cases]), flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
