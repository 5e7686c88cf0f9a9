"""What `diagnose` answers on the second bank: an answers file for its own `score.py`.

    python ../shared/bank/generate.py --out DIR --seed 1 --scale 0.5 --jobs 1
    python tests/benchmarks/second_bank.py DIR --out answers.json [--first 0] [--cases 60]
    python ../shared/bank/score.py DIR answers.json --cases

The keys are not read.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import time
from pathlib import Path

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(name, "1")
ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "tests"), str(ROOT)]

import pandas as pd  # noqa: E402

from fieldsid.diagnosis import diagnose  # noqa: E402
from fieldsid.logs.run import Run  # noqa: E402
from fieldsid.models.axis import Axis  # noqa: E402

WORDS = {"sufficient": "none", "disturbed": "unexplained", "unexplained": "unexplained"}


def run_of(path):
    """A log of the bank as a run; columns without a measurement are left out."""
    table = pd.read_csv(path)
    signals = {n: table[n].to_numpy(float) for n in table.columns if n != "time_s" and table[n].notna().any()}
    return Run(path.stem, table["time_s"].to_numpy(float), signals)


def answer(folder):
    """The answer of one case in the form `score.py` reads, with the verdict."""
    about = json.loads((folder / "case.json").read_text(encoding="utf-8"))
    training, validation = ([run_of(folder / name) for name in about[part]] for part in ("train", "valid"))
    began = time.perf_counter()
    said = diagnose(training, Axis(about["axis"]), validation)
    seconds = time.perf_counter() - began
    ranked = [{"effect": c.effect, "confidence": float(c.probability)} for c in said.candidates]
    word = WORDS.get(str(said.verdict))
    named = "+".join(sorted(said.effects))
    own = next((c["confidence"] for c in ranked if "+".join(sorted(c["effect"].split("+"))) == named), None)
    first = {"effect": word or "+".join(said.effects)} | ({} if own is None else {"confidence": own})
    rest = [c for c in ranked if word or "+".join(sorted(c["effect"].split("+"))) != named]

    def rms(errors):
        return {"angle_rad": errors.angle_rms_rad, "rate_rad_s": errors.rate_rms_rad_s}

    return {
        "ranked": [first, *rest], "time_s": seconds, "rms_before": rms(said.base.validation),
        "rms_after": rms(said.final.validation), "verdict": str(said.verdict),
    }  # fmt: skip


def main(argv=None):
    """Answer the cases of a folder and write the answers."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--cases", type=int, default=1000)
    options = parser.parse_args(argv)
    answers = json.loads(options.out.read_text(encoding="utf-8")) if options.out.is_file() else {}
    cases = sorted(p for p in options.folder.iterdir() if (p / "case.json").is_file())
    for case in cases[options.first : options.first + options.cases]:
        if case.name not in answers:
            answers[case.name] = answer(case)
            options.out.write_text(json.dumps(answers, indent=1), encoding="utf-8")
            print(case.name, answers[case.name]["verdict"], answers[case.name]["ranked"][0], file=sys.stderr, flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
