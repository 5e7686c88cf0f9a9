"""Are the stated probabilities right: of the verdicts given with 0.9, are nine in ten right? From answers already made.

    python tests/benchmarks/hidden_effects.py --cases 200 --seed 1 --json own.json
    python tests/benchmarks/second_bank.py DIR --out answers.json
    python tests/benchmarks/reliability.py own.json DIR:answers.json [...]

A file of rows is of the repository's own bank, a folder and a file joined by a colon of the second bank. Counted are the verdicts
that name effects, with the probability of the set that is named: right where it is what is hidden and nothing else but what the
bank counts as no error besides (small effects of the second bank's `--hard`). Prints the share that is right by bins of the
stated probability, with its 95 % interval (Clopper and Pearson), and the Brier score.
"""

from __future__ import annotations

import argparse
import importlib.util
import json
import sys
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "tests")]

import numpy as np  # noqa: E402
from truth.shares import interval  # noqa: E402

EDGES = (0.0, 0.5, 0.8, 0.95, 0.99, 1.0 + 1e-9)
NAMING = ("effect", "undecided")


@dataclass(frozen=True)
class Named:
    """One verdict that names effects: its stated probability, whether it is right, and whether the error is well visible."""

    case: str
    probability: float
    right: bool
    visible: bool


def of_own_bank(path):
    """The verdicts in a file of rows of tests/benchmarks/hidden_effects.py."""
    named = []
    for row in json.loads(Path(path).read_text(encoding="utf-8")):
        if row["verdict"] not in NAMING or row["kind"] == "remus":  # what a hull of six degrees of freedom lacks is no one set
            continue
        said = set(row["said"])
        stated = dict(zip((frozenset(r.split("+")) for r in row["ranked"]), row["probability"], strict=True))
        truth, accepts = set(row["effects_hidden"]), set(row["accepts"])
        alone = len(truth) == 1 and len(said) == 1 and bool(said & accepts)
        p = stated.get(frozenset(said))
        if p is not None:
            named.append(Named(row["name"], p, alone or (bool(truth) and said == truth), bool(row["visible"])))
    return named


def of_second_bank(folder, answers):
    """The verdicts in an answers file of tests/benchmarks/second_bank.py, judged by the keys and the bank's own words."""
    score = _scorer(ROOT.parent / "shared" / "bank" / "score.py")
    named = []
    for case, answer in json.loads(Path(answers).read_text(encoding="utf-8")).items():
        key = json.loads((Path(folder) / case / "key.json").read_text(encoding="utf-8"))
        first, truth = answer["ranked"][0], set(key["effects"])
        said = score.names(first, key["axis"])
        if said & {"none", "unexplained"} or first.get("confidence") is None:
            continue
        minor = set().union(*(score.MINOR.get(small, set()) for small in key["small_effects"]))
        right = bool(truth) and truth <= said and not said - truth - minor
        named.append(Named(case, first["confidence"], right, not key["weak"]))
    return named


def _scorer(path):
    spec = importlib.util.spec_from_file_location("score_of_second_bank", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def table(named):
    """Share that is right by bins of the stated probability, and what was stated on the average."""
    lines = ["stated         cases   stated   right  (95 % interval)"]
    for low, high in pairwise(EDGES):
        part = [n for n in named if low <= n.probability < high]
        if not part:
            continue
        hits, mean = sum(n.right for n in part), np.mean([n.probability for n in part])
        least, most = interval(hits, len(part))
        share = f"{hits / len(part):.3f}  ({least:.3f}-{most:.3f})"
        lines.append(f"{low:4.2f} .. {min(high, 1.0):4.2f}   {len(part):5d}    {mean:.3f}   {share}")
    brier = np.mean([(n.probability - n.right) ** 2 for n in named])
    stated, right = np.mean([n.probability for n in named]), np.mean([n.right for n in named])
    return "\n".join([*lines, f"all            {len(named):5d}    {stated:.3f}   {right:.3f}  Brier score {brier:.4f}"])


def overstated(named):
    """The bins whose share that is right is surely below their lower edge: (edge, right, cases) each."""
    bins = []
    for low, high in pairwise(EDGES):
        part = [n.right for n in named if low <= n.probability < high]
        if part and interval(sum(part), len(part))[1] < low:
            bins.append((low, sum(part), len(part)))
    return bins


def main(argv=None):
    """Print the table of each file and of all together, and what was wrong at a probability above 0.8."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("answers", nargs="+", help="ROWS.json of the own bank, or DIR:ANSWERS.json of the second")
    options = parser.parse_args(argv)
    every = []
    for answers in options.answers:
        folder, colon, file = answers.rpartition(":")
        named = of_second_bank(folder, file) if colon else of_own_bank(answers)
        every += named
        print(f"{answers}\n{table(named)}\n")
    seen = [n for n in every if n.visible]
    print(f"all\n{table(every)}\n\nwell above the noise\n{table(seen)}\n")
    for n in sorted(every, key=lambda n: -n.probability):
        if not n.right and n.probability >= 0.8:
            print(f"wrong at {n.probability:.3f}: {n.case}{'' if n.visible else ' (weak)'}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
