"""A fit: from records to a Model with standard errors, with each run's free run and measurement."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fieldsid.display import Plotted
from fieldsid.dynamics.assemble import fin_path
from fieldsid.effects import refuse_clash
from fieldsid.errors import DataError, UsageError
from fieldsid.fitting.auto_method import best_start, choose
from fieldsid.fitting.checks.parameter_checks import parameter_checks
from fieldsid.fitting.checks.record_checks import record_checks
from fieldsid.fitting.checks.score_tests import score_tests
from fieldsid.fitting.covariance.input_errors import with_input_errors
from fieldsid.fitting.covariance.noise_selection import residual_whiteness
from fieldsid.fitting.estimates import estimates
from fieldsid.fitting.fin_sense import fin_sense
from fieldsid.fitting.initial.trim_speed_law import groups_by_trim
from fieldsid.fitting.predict.goodness_of_fit import goodness_of_fit
from fieldsid.fitting.predict.predict import Prediction, refit_nuisances
from fieldsid.fitting.problem.estimator import Estimator, History, Options, Solution
from fieldsid.fitting.problem.parameters import layout_of
from fieldsid.fitting.problem.problem import Problem
from fieldsid.logs.run import Note
from fieldsid.logs.segments import Answer, excursions
from fieldsid.models.axis import NAMES, Axis
from fieldsid.models.effect import Effect, definitions_of, effect_named
from fieldsid.models.model import Model, Noise
from fieldsid.models.record import Record
from fieldsid.noise.white_floor import lowered_noise_floor, told_floor, white_noise_floor
from fieldsid.numerics.arrays import FloatArray
from fieldsid.registry import members, near, pick

FEWEST_SAMPLES = 40
DRAG_EXPONENT = 2.0
THRUST_EXPONENTS = (0.0, 3.0)
"""Bounds of the exponent of thrust over speed on straight runs: from one command at every speed to a drag that grows as u^3."""
MIN_LOG_SPEED_SPREAD = 0.1
"""Least spread of the runs' log speed at which the exponent of thrust over speed is estimated."""
AUTO = "auto"


@dataclass(frozen=True, slots=True, repr=False)
class Fit(Plotted):
    """A fitted model with the free run of every run, the noise floor, the notes, and the history of recursive least squares."""

    model: Model
    predictions: tuple[Prediction, ...]
    floor: Noise
    correlation: FloatArray
    notes: tuple[Note, ...]
    history: History | None = None

    def interval95(self, name: str) -> tuple[float, float]:
        """Return the 95 % interval of a parameter; for a derived fin offset by propagation. Raises UsageError."""
        known = {e.name: e for e in estimates(self.model)}
        if name not in known:
            raise UsageError(f"the fit has no parameter {name!r}", found=", ".join(known), hint=near(name, list(known)))
        return known[name].interval95


def estimators() -> Mapping[str, Estimator]:
    """Return the registered estimators by name."""
    return members("fieldsid.estimators", "ESTIMATOR")


def fit(
    records: Sequence[Record],
    axis: Axis,
    *,
    method: str = AUTO,
    effects: Sequence[str] = (),
    options: Options | None = None,
) -> Fit:
    """Return the joint fit of records on one axis.

    The method "auto" is output error, or prediction error where a disturbance, and no missing effect, colours the residuals.
    Raises DataError for records that are too short or in which the fin does not move, UsageError for a method that cannot take
    the effects or several runs, EffectError for two effects that cannot be in one model.
    """
    check(records, axis)
    parts = check_signals(records, effects)
    problem = Problem(tuple(records), layout_of(records, axis, parts, groups_by_trim(records)))
    solution = _solve(problem, method, options or Options())
    return fitted(problem, solution)


def _solve(problem: Problem, method: str, options: Options) -> Solution:
    first: Estimator = pick("fieldsid.estimators", "ESTIMATOR", "output_error" if method == AUTO else method)
    if problem.layout.effects and not first.takes_effects:
        raise UsageError(
            f"`{first.name}` cannot estimate effects",
            found=", ".join(e.name for e in problem.layout.effects),
            hint="use `--method output_error`",
        )
    if len(problem.records) > 1 and not first.joint:
        raise UsageError(
            f"`{first.name}` takes one run at a time", found=f"{len(problem.records)} runs", hint="leave `--joint` out"
        )
    solution = first.solve(problem, options)
    if method == AUTO:
        finer: Estimator = pick("fieldsid.estimators", "ESTIMATOR", "pem")
        plain = solution
        solution = choose(problem, plain, lambda: finer.refined(problem, plain, options))
    if not solution.nuisances_fitted:
        x = solution.x
        for run, record in enumerate(problem.records):
            x = refit_nuisances(problem, x, run, white_noise_floor([record]))
        solution = replace(solution, x=x, nuisances_fitted=True)
    return with_input_errors(problem, solution)


def check(records: Sequence[Record], axis: Axis) -> None:
    """Refuse records that no estimator can use; raises DataError."""
    if not records:
        raise DataError("there is no run to fit", hint="give at least one log file")
    for r in records:
        measured = int(max(r.angle_ok.sum(), r.rate_ok.sum()))
        if measured < FEWEST_SAMPLES:
            raise DataError(
                f"run {r.name!r} is too short to identify {axis.value}",
                found=f"{measured} measured samples in {r.time[-1] - r.time[0]:.3g} s, at least {FEWEST_SAMPLES} are needed",
                hint="take a longer run or part of one, two pulses of 2 s each at least, or one that was sampled more often",
            )
        names = NAMES[axis]
        is_angle, ok = not r.rate_ok.any(), r.rate_ok if r.rate_ok.any() else r.angle_ok
        measurement = (r.angle if is_angle else r.rate)[ok]
        fin = names.fin_measured if r.fin_is_measured else names.fin
        excursions(r.name, axis.value, fin, r.time, r.fin, Answer(r.time[ok], measurement, is_angle))
        if float(np.ptp(measurement)) == 0.0:
            raise DataError(
                f"run {r.name!r}: the {axis.value} sensor is constant",
                found=f"{measurement.size} samples of {measurement[0]:.4g}",
                hint="check the sensor, and which column or topic was mapped",
            )


def check_signals(records: Sequence[Record], effects: Sequence[str]) -> tuple[Effect, ...]:
    """Return the effects with these names; raises DataError for a signal that a record lacks, EffectError for two that clash."""
    parts = tuple(effect_named(name) for name in dict.fromkeys(effects))
    for i, part in enumerate(parts):
        refuse_clash(part, parts[:i])
    lacking = ((e.name, r, role) for e in parts for r in records for role in e.needs if role not in r.signals)
    missing = [f"{name} needs {role}, {r.why_without(role)} ({r.name})" for name, r, role in lacking]
    if missing:
        raise DataError(
            "an effect needs a signal that a run does not give",
            found="; ".join(missing),
            hint="map the signal on import, where the log has it, or leave the effect out",
        )
    return parts


def fitted(problem: Problem, solution: Solution) -> Fit:
    """Return the fit record of a solution."""
    floor = white_noise_floor(problem.records)
    if not all(r.is_whole for r in problem.records):  # where samples are missing, differences of the signals contain the motion
        residuals = [problem.residual(solution.x, run)[0] for run in range(len(problem.records))]
        floor = lowered_noise_floor(floor, problem.records, residuals)
    names = problem.layout.names
    notes = (
        *parameter_checks(problem, solution, floor),
        *score_tests(problem, solution),
        *record_checks(problem, solution),
        *solution.notes,
    )
    model = model_of(problem, solution)
    # initial states of least prediction error do not give the best free run, which every other command shows
    shown = solution.x if solution.weights is None else best_start(problem, solution.x, floor)
    predictions = tuple(prediction_of(problem, shown, run) for run in range(len(problem.records)))
    sigma = np.sqrt(np.maximum(np.diag(solution.covariance), 1e-300))
    correlation = solution.covariance / np.outer(sigma, sigma)
    order = [names.index(n) for n in model.free]
    told = told_floor(floor, problem.records)
    model = replace(model, info={**model.info, "left": _residual_summary(predictions, told)})
    return Fit(model, predictions, told, correlation[np.ix_(order, order)], notes, solution.history)


def _residual_summary(predictions: Sequence[Prediction], floor: Noise) -> dict[str, Any]:
    """Return the residuals' root mean squares and the noise floor of the sensors, which the model file keeps."""
    merit = goodness_of_fit(predictions)
    noise = {"angle_rad": floor.angle, "rate_rad_s": floor.rate}
    return {"angle_rms_rad": merit.angle_rms, "rate_rms_rad_s": merit.rate_rms, "noise_floor": noise}


def prediction_of(problem: Problem, x: FloatArray, run: int) -> Prediction:
    """Return a run's free run at a solution."""
    motion, _ = problem.simulate(x, run)
    values = problem.values_of(x, run)
    fin = fin_path(problem.records[run], problem.layout.effects, values)
    nuisance = {c.name: values[c.name] for e in problem.layout.effects for c in e.nuisance}
    path = np.append(fin.start, fin.end[-1])
    return Prediction(problem.records[run], motion.angle, motion.rate, path, problem.state_of(x, run), nuisance)


def model_of(problem: Problem, solution: Solution) -> Model:
    """Return the model of a solution, its values at the law's reference speed."""
    layout, names = problem.layout, NAMES[problem.layout.axis]
    values = dict(zip(layout.names, solution.x[: layout.shared].tolist(), strict=True))
    units = {s.name: s.unit for s in layout.parameters[: layout.shared]}
    law = layout.law(values)
    of_groups = {n for n in values if n.startswith(f"{names.authority}@")}
    free = tuple(n for n in values if n not in of_groups)
    order = [layout.names.index(n) for n in free]
    p = residual_whiteness(problem, solution.x, solution.noise)
    sigma = dict(zip(layout.names, np.sqrt(np.maximum(np.diag(solution.covariance), 0.0)).tolist(), strict=True))
    return Model(
        axis=layout.axis,
        effects=tuple(e.name for e in layout.effects),
        values={n: values[n] for n in free},
        units={n: units[n] for n in free},
        free=free,
        covariance=solution.covariance[np.ix_(order, order)],
        law=law,
        noise=solution.noise,
        trained=trained(problem) | fin_sense(problem, solution),
        method=solution.method,
        runs=tuple(r.name for r in problem.records),
        info={
            "whiteness_p": p,
            "law_parameters": {n: {"value": values[n], "std_error": sigma[n]} for n in sorted(of_groups)},
        },
        own=definitions_of(layout.effects),
    )


def trained(problem: Problem) -> dict[str, float]:
    """Return the range of the data: speeds, largest fin and rate, duration, longest constant fin, helper means, thrust law."""
    records = problem.records
    speeds = [r.speed for r in records if np.isfinite(r.speed)]
    rates = [float(np.max(np.abs(r.rate[r.rate_ok]))) for r in records if r.rate_ok.any()]
    known = {
        "speed_low": min(speeds) if speeds else float("nan"),
        "speed_high": max(speeds) if speeds else float("nan"),
        "fin_max": max(float(np.max(np.abs(r.fin))) for r in records),
        "rate_max": max(rates) if rates else float("nan"),
        "seconds": float(sum(r.time[-1] - r.time[0] for r in records)),
        "held_s": max(longest_hold(r) for r in records),
    }
    roles = {role for r in records for role in r.signals}
    means = {f"{o}_mean": float(np.mean([r.signals[o].mean() for r in records if o in r.signals])) for o in sorted(roles)}
    return known | means | (_thrust_law(records) if "thrust" in roles else {})


def _thrust_law(records: Sequence[Record]) -> dict[str, float]:
    """Return the thrust over the speed u of the runs as a power law: thrust_at_1_m_s u^thrust_exponent.

    The exponent is fitted to the means of the runs where their speeds differ enough, else it is 2, as for a hull's drag.
    """
    runs = [r for r in records if "thrust" in r.signals and r.speed > 0]
    if not runs:
        return {}
    thrust, speed = np.array([r.signals["thrust"].mean() for r in runs]), np.array([r.speed for r in runs])
    mean, exponent = float(np.mean(thrust)), DRAG_EXPONENT
    if np.ptp(np.log(speed)) > MIN_LOG_SPEED_SPREAD and np.all(thrust * mean > 0):
        faster = np.log(speed) - np.mean(np.log(speed))
        exponent = float(np.clip(faster @ np.log(np.abs(thrust)) / (faster @ faster), *THRUST_EXPONENTS))
    return {"thrust_at_1_m_s": mean / float(np.mean(speed**exponent)), "thrust_exponent": exponent}


def longest_hold(record: Record) -> float:
    """Return the longest time the fin stayed within a tenth of its range while well off its median, in s."""
    span = float(np.ptp(record.fin))
    if span == 0.0:
        return 0.0
    off = np.abs(record.fin - np.median(record.fin)) > 0.25 * span
    still = np.abs(np.diff(record.fin, prepend=record.fin[0])) < 0.1 * span
    edges = np.flatnonzero(~(off & still))
    edges = np.concatenate([[-1], edges, [len(record)]])
    longest = int(np.argmax(np.diff(edges)))
    first, last = edges[longest] + 1, min(edges[longest + 1], len(record)) - 1
    return float(record.time[last] - record.time[first]) if last > first else 0.0
