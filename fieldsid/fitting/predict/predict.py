"""A model's free run on a record: the initial state and the nuisance parameters of the run are refitted, nothing else."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from fieldsid.display import Brief
from fieldsid.dynamics.assemble import fin_path
from fieldsid.dynamics.free_run import effects_of, growing_hint
from fieldsid.errors import DivergenceError
from fieldsid.fitting.initial.initial_state_prior import initial_state_prior
from fieldsid.fitting.initial.other_event_times import starts_at_other_times
from fieldsid.fitting.optimise.levenberg_marquardt import levenberg_marquardt
from fieldsid.fitting.predict import command_timing, own_moment, speed_correction
from fieldsid.fitting.problem.parameters import Parameter, ParameterLayout, SpeedGroups, layout_of
from fieldsid.fitting.problem.problem import Problem
from fieldsid.logs.run import Note
from fieldsid.models.axis import NAMES, Axis
from fieldsid.models.effect import Effect
from fieldsid.models.model import Model, Noise
from fieldsid.models.record import Record
from fieldsid.models.speed_law import SpeedLaw
from fieldsid.noise.white_floor import lowered_noise_floor, white_noise_floor
from fieldsid.noise.whiten import is_white
from fieldsid.numerics.arrays import FloatArray
from fieldsid.runtime.evaluation_counter import EvaluationCounter

MAX_NUISANCE_ITERATIONS, NUISANCE_COST_TOLERANCE = 15, 1e-6
"""Most iterations for the nuisance parameters of a run, and the relative gain of the cost at which they end."""
MAX_STARTS = 4
"""Most starts with other event times that are tried in addition to the present times."""


@dataclass(frozen=True, slots=True, repr=False)
class Prediction(Brief):
    """Free run of a model on a record: angle and rate (n,) as the sensors show them, fin (n,), initial state and nuisances.

    `faster` is the relative speed correction, see speed_correction.py. `moment` (rad/s^2) is the moment of the run and
    `moment_std` its prior standard deviation, see own_moment.py. `as_logged` is the rms residual (rad, rad/s) with the model's
    trim and the logged speed and command times, None where these are unchanged.
    """

    record: Record
    angle: FloatArray
    rate: FloatArray
    fin: FloatArray
    state: tuple[float, float, float]
    nuisance: Mapping[str, float]
    faster: float = 0.0
    as_logged: tuple[float, float] | None = None
    moment: float = 0.0
    moment_std: float = 0.0

    @property
    def residual(self) -> FloatArray:
        """Measured minus simulated, (2, n), zero where nothing was measured."""
        return np.where(self.record.ok, self.record.both - np.stack([self.angle, self.rate]), 0.0)

    @property
    def notes(self) -> tuple[Note, ...]:
        """The notes on what differs in the run from the log and the model: command times, speed, trim."""
        return tuple(
            n
            for n in (
                command_timing.timing_note(self.record),
                speed_correction.speed_note(self.record, self.faster),
                own_moment.moment_note(self.record, self.moment, self.moment_std),
            )
            if n is not None
        )


def predict(model: Model, record: Record, *, effects: tuple[Effect, ...] | None = None) -> Prediction:
    """Return a model's free run on a record; raises DivergenceError when it grows without bound."""
    floor = white_noise_floor([record])
    logged, x = frozen_problem(model, record, effects_of(model) if effects is None else effects)
    if not record.is_whole:  # where samples are missing, differences of the signals contain the motion
        floor = lowered_noise_floor(floor, [record], [logged.residual(refit_nuisances(logged, x, 0, floor), 0)[0]])
    problem, x = with_command_timing(logged, x, floor)
    as_timed = problem
    problem, x, faster = speed_correction.correct_speed(problem, x, floor)
    x = refit_nuisances(problem, x, 0, floor, rescan=False)
    unmoved = as_timed is logged and not speed_correction.is_worth_reporting(faster) and model.noise.own_moment == 0.0
    as_logged = None if unmoved else _rms_as_logged(logged, x)
    x, moment = own_moment.with_own_moment(problem, x, model.noise.own_moment, floor)
    x = refit_nuisances(problem, x, 0, floor, rescan=False) if moment else x
    motion, _ = problem.simulate(x, 0)
    if not np.isfinite(motion.rate).all():
        at = float(record.time[np.argmin(np.isfinite(motion.rate))])
        raise DivergenceError(
            f"the model grows without bound on run {record.name!r}",
            found=f"diverged at t = {at:.2f} s",
            hint=growing_hint(model),
        )
    values = problem.values_of(x, 0)
    fin = fin_path(problem.records[0], problem.layout.effects, values)
    nuisance = {c.name: values[c.name] for e in problem.layout.effects for c in e.nuisance}
    path = np.append(fin.start, fin.end[-1])
    state, std = problem.state_of(x, 0), model.noise.own_moment
    return Prediction(problem.records[0], motion.angle, motion.rate, path, state, nuisance, faster, as_logged, moment, std)


def as_flown(model: Model, records: Sequence[Record]) -> tuple[Note, ...]:
    """Return the notes on what differs in the runs from their logs, without runs on which the model diverges."""
    notes: list[Note] = []
    for record in records:
        try:
            notes += predict(model, record).notes
        except DivergenceError:
            continue
    return tuple(notes)


def frozen_problem(
    model: Model, record: Record, effects: Sequence[Effect], evaluations: EvaluationCounter | None = None
) -> tuple[Problem, FloatArray]:
    """Return the problem of one record at its speed, and x with the model's parameters and start values of the nuisances."""
    layout = layout_of([record], model.axis, effects)
    of_fin = model.law.trim_of_fin
    exponent, speed = model.law.damping_exponent, model.law.effective(record.speed)
    groups = SpeedGroups((model.law.reference,), (0,), 0, (speed,), trim_of_fin=of_fin, exponent=exponent)
    layout = replace(layout, groups=groups)
    values = values_at_speed(model.law, model.values, model.axis, record.speed)
    x = np.array([values[s.name] if i < layout.shared else s.start for i, s in enumerate(layout.parameters)])
    return Problem((record,), layout, evaluations or EvaluationCounter()), x


def values_at_speed(law: SpeedLaw, values: Mapping[str, float], axis: Axis, speed: float) -> dict[str, float]:
    """Return a model's values as the one-run problem at a speed takes them.

    The problem scales the authority by s^2, and a trim that scales with the authority too; the values by the law are divided by
    that.
    """
    names, scale = NAMES[axis], law.scale(speed)
    trim = values[names.trim] * law.trim_factor(speed) / (scale**2 if law.trim_of_fin else 1.0)
    return dict(values) | {names.authority: law.authority(speed, values[names.authority]) / scale**2, names.trim: trim}


def _rms_as_logged(problem: Problem, x: FloatArray) -> tuple[float, float]:
    """Return the rms residual of a one-run problem, angle (rad) and rate (rad/s), NaN for a channel not measured."""
    record = problem.records[0]
    residual, _ = problem.residual(refit_nuisances(problem, x, 0, white_noise_floor([record])), 0)
    rms = [float(np.sqrt(np.mean(e[ok] ** 2))) if ok.any() else float("nan") for e, ok in zip(residual, record.ok, strict=True)]
    return rms[0], rms[1]


def with_command_timing(problem: Problem, x: FloatArray, noise: Noise) -> tuple[Problem, FloatArray]:
    """Return a one-run problem and x with the run's nuisances fitted under a noise.

    The times of the command's jumps between samples are estimated where that explains the motion better.
    """
    record = problem.records[0]
    x = refit_nuisances(problem, x, 0, noise)
    better = command_timing.command_timing(problem, x, white_noise_floor([record]))
    if better is None:
        return problem, x
    problem = replace(problem, records=(better,))
    return problem, refit_nuisances(problem, x, 0, noise, rescan=False)


def refit_nuisances(problem: Problem, x: FloatArray, run: int, noise: Noise, *, rescan: bool = True) -> FloatArray:
    """Return x with a run's nuisances (initial state, phases, event times) refitted, the rest unchanged.

    With `rescan`, event times are searched over their grids and not only from their present values.

    Under white noise a second pass weights the run by its residual and applies the prior of the initial state, so that the
    initial state cannot hide an error of the model.
    """
    own = problem.layout.nuisances_of(run)
    single = replace(problem, records=(problem.records[run],), layout=_layout_of_one(problem.layout, run))
    keep = [*range(problem.layout.shared), *own]
    free = range(problem.layout.shared, len(keep))
    starts = [x[keep], *(starts_at_other_times(single, x[keep], noise, MAX_STARTS, free) if rescan else [])]
    found = [
        levenberg_marquardt(
            single, start, noise, free=free, max_iterations=MAX_NUISANCE_ITERATIONS, tolerance=NUISANCE_COST_TOLERANCE
        )
        for start in starts
    ]
    best = min(found, key=lambda d: d.cost)
    out = x.copy()
    if not np.isfinite(best.cost):
        return out
    prior = initial_state_prior(single, 0, noise) if is_white(noise) else None
    if prior is not None:
        best = levenberg_marquardt(
            single,
            best.x,
            _residual_noise(single, best.x, noise),
            free=free,
            max_iterations=MAX_NUISANCE_ITERATIONS,
            tolerance=NUISANCE_COST_TOLERANCE,
            prior=prior,
        )
    out[keep] = best.x
    return out


def _residual_noise(problem: Problem, x: FloatArray, noise: Noise) -> Noise:
    """Return the residual standard deviations of one run, at least those of its noise."""
    residual, _ = problem.residual(x, 0)
    record = problem.records[0]
    rms = [float(np.sqrt(np.mean(e[ok] ** 2))) if ok.any() else 0.0 for e, ok in zip(residual, record.ok, strict=True)]
    return Noise(max(rms[0], noise.angle), max(rms[1], noise.rate))


def _layout_of_one(layout: ParameterLayout, run: int) -> ParameterLayout:
    slots = [*layout.parameters[: layout.shared], *[_of_run_zero(layout.parameters[i]) for i in layout.nuisances_of(run)]]
    g = layout.groups
    groups = replace(g, of_run=(g.of_run[run],), run_speeds=(g.run_speeds[run],))
    return replace(layout, groups=groups, parameters=tuple(slots))


def _of_run_zero(slot: Parameter) -> Parameter:
    return Parameter(slot.name, slot.unit, slot.low, slot.high, slot.start, 0)
