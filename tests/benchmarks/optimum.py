"""The optimum: the cost that fitting the true effect reaches, against the one reached from the true values.

    python tests/benchmarks/optimum.py --cases 100 --seed 1 [--bank own|hard|second|second-hard] [--fit diagnose] [--first 0]

Data sets with one effect are drawn from the repository's own bank (`hard`: forms that are not the textbook's) or from the second
bank beside the repository. Of each the true effect is fitted twice: as `identify --effects` does it (or as the search of
`diagnose` comes by it), and from the truth: with the true effect's numbers held first, then all free. Costs are negative log
likelihoods; prints every data set on which the first is more than 0.5 above the second, and the counts.
"""

from __future__ import annotations

import argparse
import importlib.util
import json
import os
import sys
import tempfile
import time
from dataclasses import dataclass
from functools import cache
from pathlib import Path

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(name, "1")
ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "tests"), str(ROOT)]

import numpy as np  # noqa: E402
import pandas as pd  # noqa: E402
from truth.bank import make_case  # noqa: E402
from truth.projection import of_own_bank, of_second_bank  # noqa: E402

from fieldsid.diagnosis.data.applicable_effects import applicable_effects  # noqa: E402
from fieldsid.diagnosis.evidence.likelihood_fit import fit_maximum_likelihood  # noqa: E402
from fieldsid.diagnosis.evidence.scored_model import score_model  # noqa: E402
from fieldsid.diagnosis.search.search import Search  # noqa: E402
from fieldsid.effects import all_effects  # noqa: E402
from fieldsid.estimators.output_error import found_minimum  # noqa: E402
from fieldsid.fitting.initial.equation_error import equation_error_start  # noqa: E402
from fieldsid.fitting.initial.trim_speed_law import groups_by_trim  # noqa: E402
from fieldsid.fitting.optimise.levenberg_marquardt import levenberg_marquardt  # noqa: E402
from fieldsid.fitting.optimise.residual_weights import negative_log_likelihood, white_weights  # noqa: E402
from fieldsid.fitting.problem.parameters import layout_of  # noqa: E402
from fieldsid.fitting.problem.problem import Problem  # noqa: E402
from fieldsid.logs.run import Run  # noqa: E402
from fieldsid.models.axis import NAMES, Axis  # noqa: E402
from fieldsid.models.effect import effect_named  # noqa: E402
from fieldsid.models.record import record_of  # noqa: E402

SECOND_BANK = ROOT.parent / "shared" / "bank"
BANKS = ("own", "hard", "second", "second-hard")
MOST = 0.5
"""What the cost reached may be above the one from the truth, in units of log likelihood."""
DESCENTS = 4
"""Descents from a start, each with the weights of its own residuals."""


@dataclass(frozen=True)
class DataSet:
    """One data set: its runs, the true effect, and a function from a reference speed in m/s to the truth's projection."""

    name: str
    axis: Axis
    effect: str
    training: list
    validation: list
    projection: object


@dataclass(frozen=True)
class Costs:
    """What was reached, what the truth leads to, where they end, and how long the fit took in s."""

    data: DataSet
    reached: float
    from_truth: float
    found: dict
    true_values: dict
    seconds: float
    note: str = ""

    @property
    def above(self):
        """How far the cost reached is above the one from the truth."""
        return self.reached - self.from_truth


def own(index, seed, kind="single"):
    """Data set of the own bank."""
    case = make_case(index, seed, kind=kind)

    def runs(logs, what):
        signals = ({k: v for k, v in log.items() if k != "time_s"} for log in logs)
        return [Run(f"{what}{i}", log["time_s"], s) for i, (log, s) in enumerate(zip(logs, signals, strict=True), 1)]

    return DataSet(
        case.name, Axis(case.axis), case.effects[0], runs(case.training, "train"), runs(case.validation, "check"),
        lambda reference: of_own_bank(case, reference),
    )  # fmt: skip


@cache
def generator():
    """The second bank's program."""
    spec = importlib.util.spec_from_file_location("second_bank", SECOND_BANK / "generate.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def second(index, seed, *, hard=False):
    """Data set of the second bank."""
    bank, rng = generator(), np.random.default_rng([seed, index, 2])
    axis = str(rng.choice(["yaw", "pitch"], p=[0.6, 0.4]))
    effect = str(rng.choice(list(bank.EFFECTS[axis])))
    with tempfile.TemporaryDirectory() as folder:
        bank.build_case((f"c{index}", folder, int(rng.integers(2**62)), axis, [effect], False, None, hard, hard))
        case = Path(folder) / f"c{index}"
        key, about = (json.loads((case / f"{n}.json").read_text(encoding="utf-8")) for n in ("key", "case"))
        training, validation = ([_run(case / f) for f in about[part]] for part in ("train", "valid"))
    run_s = float(training[0].time[-1] - training[0].time[0])
    truth = of_second_bank(key | {"train": about["train"]}, run_s)
    return DataSet(f"second-{seed}-{index}", Axis(axis), effect, training, validation, lambda _reference: truth)


def _run(path):
    table = pd.read_csv(path)
    signals = {n: table[n].to_numpy(float) for n in table.columns if n != "time_s" and table[n].notna().any()}
    return Run(path.stem, table["time_s"].to_numpy(float), signals)


def data_set(bank, index, seed):
    """Data set of a bank by its index."""
    if bank.startswith("second"):
        return second(index, seed, hard=bank == "second-hard")
    return own(index, seed, "imperfect" if bank == "hard" else "single")


def descended(problem, x):
    """The minimum next to x, weights from its own residuals: (cost, vector)."""
    cost = negative_log_likelihood(problem, x)
    for _ in range(DESCENTS):
        new = levenberg_marquardt(problem, x, white_weights(problem, x)).x
        after = negative_log_likelihood(problem, new)
        if not after < cost:
            break
        done, x, cost = cost - after < 1e-3, new, after
        if done:
            break
    return cost, x


def from_truth(problem, data):
    """The minimum that the truth leads to: the effect's numbers held at the true ones, then all free."""
    layout, names = problem.layout, NAMES[data.axis]
    truth = data.projection(layout.groups.speeds[layout.groups.reference])
    known = dict(truth.shared)
    starts = []
    for of_base in (False, True):
        x = equation_error_start(problem.records, layout)
        base = {names.damping: truth.base["damping"], names.stiffness: truth.base["stiffness"]} if of_base else {}
        for i, p in enumerate(layout.parameters):
            own = known | base if p.run < 0 else (truth.per_run[p.run] if truth.per_run else {})
            if p.name in own:
                x[i] = np.clip(own[p.name], p.low, p.high)
        free = [i for i, p in enumerate(layout.parameters) if p.name not in known]
        for _ in range(2):
            x = levenberg_marquardt(problem, x, white_weights(problem, x), free=free).x
        starts.append(descended(problem, x))
    return min(starts, key=lambda s: s[0])


def shown(problem, x, effect):
    """An effect's shared numbers at x."""
    own = {c.name for c in effect.all_coefficients}
    return {n: float(v) for n, v in zip(problem.layout.names, x, strict=False) if n in own}


def identified(data):
    """The costs of `identify --effects`."""
    records, effect = tuple(record_of(r, data.axis) for r in data.training), effect_named(data.effect)
    problem = Problem(records, layout_of(records, data.axis, (effect,), groups_by_trim(records)))
    began = time.perf_counter()
    found, _ = found_minimum(problem)
    seconds = time.perf_counter() - began
    cost, x = from_truth(problem, data)
    reached = negative_log_likelihood(problem, found.x)
    return Costs(data, reached, cost, shown(problem, found.x, effect), shown(problem, x, effect), seconds)


def diagnosed(data):
    """The costs of the model of the true effect that the search of `diagnose` ends with, minus the log evidence.

    That the likelier of two fits of a model validates worse is no failure: where the other is, the evidence is compared.
    """
    learned, unseen = ([record_of(r, data.axis) for r in part] for part in (data.training, data.validation))
    catalogue, _ = applicable_effects(all_effects(data.axis).values(), [*learned, *unseen])
    work = Search(tuple(learned), tuple(unseen), data.axis, catalogue)
    began = time.perf_counter()
    found = work.best()
    seconds = time.perf_counter() - began
    h = work.tried.get(frozenset({data.effect}))
    if h is None:
        return Costs(data, np.nan, np.nan, {}, {}, seconds, "not tried, found " + "+".join(found.names))
    ml_fit, effect = h.likelihood_fit, effect_named(data.effect)
    problem = ml_fit.fitted.problem.with_effects([effect])
    _, x = from_truth(problem, data)
    true = score_model(fit_maximum_likelihood(problem, x, ml_fit.noise, ml_fit.white, ml_fit.noise_kind), work.validation)
    by_cost = (-ml_fit.log_likelihood, -true.likelihood_fit.log_likelihood)
    by_evidence = (-h.log_evidence, -true.log_evidence)
    reached, best = min(by_cost, by_evidence, key=lambda pair: pair[0] - pair[1])
    fitted = ml_fit.fitted
    return Costs(
        data, reached, best, shown(fitted.problem, fitted.x, effect),
        shown(problem, true.likelihood_fit.fitted.x, effect), seconds, "found " + "+".join(found.names),
    )  # fmt: skip


def line(costs):
    """A data set in one line."""
    numbers = ", ".join(f"{n} {v:.4g} (from the truth {costs.true_values.get(n, np.nan):.4g})" for n, v in costs.found.items())
    head = f"{costs.data.name} {costs.data.axis.value} {costs.data.effect}"
    return f"{head}: {costs.above:+.2f} ({costs.reached:.1f}); {numbers}; {costs.seconds:.1f} s; {costs.note}"


def main(argv=None):
    """Fit the data sets and print those that miss the optimum."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cases", type=int, default=100)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--bank", choices=BANKS, default="own")
    parser.add_argument("--fit", choices=("identify", "diagnose"), default="identify")
    options = parser.parse_args(argv)
    compare = identified if options.fit == "identify" else diagnosed
    seen, missed = [], []
    for index in range(options.first, options.first + options.cases):
        costs = compare(data_set(options.bank, index, options.seed))
        seen.append(costs)
        if not costs.above <= MOST:
            missed.append(costs)
            print(line(costs), flush=True)
    gaps, seconds = np.array([c.above for c in seen]), np.array([c.seconds for c in seen])
    print(
        f"{len(seen)} data sets ({options.bank}, seed {options.seed}, {options.fit}): {len(missed)} above the cost from the "
        f"truth by more than {MOST}, {int(np.sum(gaps < -MOST))} below it; "
        f"median {np.median(seconds):.2f} s, worst {seconds.max():.1f} s"
    )
    return 0


if __name__ == "__main__":
    sys.exit(main())
