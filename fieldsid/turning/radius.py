"""Turning radius over speed, both sides, with bands: from all runs together, the models simulated, or the paper's formula."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from fieldsid.dynamics.free_run import effects_of
from fieldsid.errors import ModelError, UsageError
from fieldsid.logs.doctor.fin_findings import FIN_ZERO
from fieldsid.logs.run import Note, Run
from fieldsid.logs.several.sifting import Refused
from fieldsid.models.axis import NAMES, Axis
from fieldsid.models.effect import Effect
from fieldsid.numerics.arrays import FloatArray
from fieldsid.plant.parameter_source import LEAST_SHARE, ParameterSource
from fieldsid.plant.remedies import fin_limit_hint, limiting_damping_hint, refuse_fin_limit
from fieldsid.rounding import TWO_SIDED_95
from fieldsid.turning.believed_rows import believed_rows, doubts_of_draws
from fieldsid.turning.flown_circles import against_rudder, against_rudder_note, circles_of, compared_with, with_measurement
from fieldsid.turning.maneuvering.belief import SEED, Belief, believe, not_fitted
from fieldsid.turning.model_error import DataCoverage, data_coverage, model_error
from fieldsid.turning.paper_formulas import refuse_short_fin, refuse_unstable, u_turn
from fieldsid.turning.prediction import SIDES, TurnPrediction, TurnRow, predicted_row
from fieldsid.turning.steady.speed_loss import SurgeModel, fit_surge
from fieldsid.turning.steady.steady_turn import BlendedTurns, blended_turns

RADIUS_DRAWS = 500
METHODS = ("auto", "u_turn", "steady", "simulated", "maneuvering")
MIN_REPORTED_OFFSET_RAD = 0.0025
"""Fin offset that changes a radius by 1 %."""


def turn_radius(
    source: ParameterSource,
    speeds: Sequence[float],
    rudder_max: float,
    *,
    runs: Sequence[Run] = (),
    measured: Sequence[Run] = (),
    method: str = "auto",
    draws: int = RADIUS_DRAWS,
    fin_zero: float = FIN_ZERO,
    unfit: Refused[Run] | None = None,
    length: float | None = None,
) -> TurnPrediction:
    """Return the turn at every speed (m/s) to both sides with the rudder at rudder_max (rad).

    runs are those the models were fitted to, measured are runs of turns. The method "maneuvering" predicts the turn of a vehicle
    in surge, sway and yaw that is fitted to all of them; `length` (m) is the vehicle's where it is known. A measured circle is
    compared with the prediction from the other runs, and is used once where the models were fitted to it too. "auto" takes this
    method where the models have effects and the runs a speed; without runs it simulates models with effects; otherwise it takes
    the u-turn formula, which ignores a fin offset below `fin_zero` (rad). unfit is called for each of several measured runs
    without a circle; without unfit, and where no run has one, DataError is raised. Raises UsageError, and ModelError for an
    unstable model.
    """
    _check(source, speeds, rudder_max, method)
    source = source.with_speeds_of(runs)
    runs = _other_runs(runs, measured)
    chosen = _chosen(source, method)
    if chosen in ("simulated", "maneuvering") and source.own_laws:
        raise UsageError(
            "a law of one's own goes with the formula, not with a simulation of models that carry effects",
            found=f"--law {', '.join(source.own_laws)}",
            hint="add `--method u_turn`, or leave `--law` out",
        )
    before, belief, unfitted = _beliefs(source, runs, measured, length, method, chosen)
    surge = fit_surge(runs) if chosen in ("simulated", "maneuvering") and runs else None
    turns, notes = circles_of(measured, unfit, needed=belief is None)

    def rows_at(at: Sequence[float], rudder: float, known: Belief | None = before) -> list[TurnRow]:
        if known is not None:
            return believed_rows(source, known, at, rudder, surge)
        if chosen == "simulated":
            return _simulated_rows(source, at, rudder, surge, draws)
        return _formula_rows(source, at, rudder, chosen, draws, fin_zero)

    by_formula = belief is None and chosen != "simulated"
    if by_formula:
        _refuse_turns(source, speeds, rudder_max)
    rows = rows_at(speeds, rudder_max, belief)
    least = (lambda _speed: 0.0) if not by_formula else (lambda speed: abs(_offset(source, speed)))
    against = [turn for turn in turns if against_rudder(turn, source)]
    notes += [against_rudder_note(turn) for turn in against]
    compared = [compared_with(turn, rows_at, least) for turn in turns if not any(turn is other for other in against)]
    rows = [with_measurement(row, compared, rudder_max) for row in rows]
    return TurnPrediction(
        tuple(rows), tuple(compared), rudder_max, surge, (*unfitted, *notes, *_notes(source, rows, chosen, surge, fin_zero))
    )


def _other_runs(runs: Sequence[Run], measured: Sequence[Run]) -> Sequence[Run]:
    """Return the runs that are not among the measured turns; all of them if every one is."""
    files = {run.source.resolve() for run in measured if run.source is not None}
    others = [r for r in runs if not any(r is m for m in measured) and (r.source is None or r.source.resolve() not in files)]
    return others or runs


def _beliefs(
    source: ParameterSource, runs: Sequence[Run], measured: Sequence[Run], length: float | None, method: str, chosen: str
) -> tuple[Belief | None, Belief | None, list[Note]]:
    """Return the posterior from the runs, that from runs and measured turns, and notes; None where they are not used or fail."""
    before = belief = None
    notes: list[Note] = []
    if chosen in ("simulated", "maneuvering") and method != "simulated" and runs:
        try:
            before = believe(runs, source.models, length)
            belief = believe((*runs, *measured), source.models, length) if measured else before
        except ModelError as error:
            if method == "maneuvering":
                raise
            before = belief = None
            notes.append(not_fitted(error, runs))
    if method == "maneuvering" and belief is None:
        raise UsageError(
            "surge, sway and yaw cannot be fitted without runs that have a speed, a fin and a turn", found=f"{len(runs)} runs",
            hint="name them with `--runs`, with surge_m_s mapped",
        )  # fmt: skip
    return before, belief, notes


def _formula_rows(
    source: ParameterSource, speeds: Sequence[float], rudder: float, method: str, draws: int, fin_zero: float
) -> list[TurnRow]:
    names = NAMES[Axis.YAW]
    rows = []
    rng = np.random.default_rng(SEED)
    for speed in speeds:
        base = source.base_draws(speed, draws, rng)
        a, b, c = base[names.damping], base[names.authority], base[names.trim]
        for side, sign in SIDES.items():
            fin = _usable(rudder, c / b, sign * float(np.sign(b[0])), fin_zero, rng)
            turn = u_turn(speed, a, b, fin)
            radius = turn.radius if method == "u_turn" else turn.steady_radius
            coverage = _reach(source, speed, rudder, float(turn.yaw_rate_max[0]), float(turn.time[0]) / 2)
            spread = model_error((), coverage, formula=method == "u_turn").factors(draws, SEED)
            found = _found(coverage, radius, spread, turn.time, float(radius[0]))
            if any(model.effects for model in source.models):
                found["of_model"] = np.nan  # the model turns by its effects too
            rows.append(
                predicted_row(
                    float(speed), side, rudder, **found, method=method, steady_radius=float(turn.steady_radius[0]),
                    u_turn_radius=float(turn.radius[0]), yaw_rate_max=float(turn.yaw_rate_max[0]), turn_speed=float(speed),
                )
            )  # fmt: skip
    return [row for side in SIDES for row in rows if row.side == side]


def _refuse_turns(source: ParameterSource, speeds: Sequence[float], rudder: float) -> None:
    """Raise ModelError or UsageError where the formula has no turn, for the speed of the least damping or the largest offset."""
    source.require(speeds)
    damping = {speed: source.base_at(speed)[NAMES[Axis.YAW].damping] for speed in speeds}
    least_damped = min(damping, key=lambda speed: damping[speed])
    refuse_unstable(damping[least_damped], f"at {least_damped:.3g} m/s", limiting_damping_hint(source, least_damped))
    worst = max(speeds, key=lambda speed: abs(_offset(source, speed)))
    offset = _offset(source, worst)
    if abs(offset) >= rudder:
        _refuse_untold(source, worst)
    refuse_short_fin(rudder, offset, f"at {worst:.3g} m/s", fin_limit_hint("--fin-max", abs(offset), source))


def _refuse_untold(source: ParameterSource, speed: float) -> None:
    """Raise ModelError where the authority b2 at a speed may be zero (95 %): the offset C0/b2 is then any."""
    b, error = source.base_at(speed)[NAMES[Axis.YAW].authority], source.base_std_at(speed).get(NAMES[Axis.YAW].authority, 0.0)
    if abs(b) < TWO_SIDED_95 * error:
        raise ModelError(
            f"b2 cannot be told from zero at {speed:.3g} m/s: no radius follows from it, nor the offset of the fin",
            found=f"b2 = {b:.3g} +/- {error:.2g} 1/s^2",
            hint="fly larger or longer pulses of the rudder, and identify again",
        )


def _offset(source: ParameterSource, speed: float) -> float:
    """Return the fin's offset delta_r0 at a speed, rad."""
    base, names = source.base_at(speed), NAMES[Axis.YAW]
    return base.get(names.trim, 0.0) / base[names.authority]


def _simulated_rows(
    source: ParameterSource, speeds: Sequence[float], rudder: float, surge: SurgeModel | None, draws: int
) -> list[TurnRow]:
    entry = np.array(speeds, dtype=np.float64)
    both = blended_turns(source, entry, rudder, surge, draws, np.random.default_rng(SEED))
    effects = [e for model in source.models for e in effects_of(model)]
    return [_simulated_row(source, turns, i, side, rudder, effects) for side, turns in both.items() for i in range(entry.size)]


def _simulated_row(
    source: ParameterSource, turns: BlendedTurns, index: int, side: str, rudder: float, effects: Sequence[Effect]
) -> TurnRow:
    speed, rate = float(turns.entry[index]), float(turns.rate[index])
    if not np.isfinite(turns.radius[0, index]):
        raise ModelError(
            f"the model has no steady turn to {side} at {speed:.3g} m/s: it is unstable, and nothing in it holds the rate",
            found=f"a22 = {source.base_at(speed).get('a22', 0.0):.4g} 1/s, effects: {', '.join(turns.effects) or 'none'}",
            hint=limiting_damping_hint(source, speed, turns.effects),
        )
    time = turns.transient.time_180[index]
    coverage = _reach(source, speed, rudder, rate, float(np.nan_to_num(turns.transient.time_90[index], nan=60.0)))
    spread = model_error(effects, coverage, formula=False).factors(turns.radius.shape[0], SEED + 1)
    radius = turns.radius[:, index]
    value = _median(radius * spread)
    found = _found(coverage, radius, spread, time * radius / radius[0], value)
    return predicted_row(
        speed, side, rudder, **found, method="simulated", steady_radius=value, yaw_rate_max=rate,
        turn_speed=float(turns.path_speed[index]), **turns.transient.of(index),
    )  # fmt: skip


def _found(coverage: DataCoverage, radius: FloatArray, spread: FloatArray, time: FloatArray, value: float) -> dict[str, Any]:
    """Return radius and time of a turn with their bands, from draws and the model error's factors `spread`, and `because`."""
    interval = _interval(radius * spread, value)
    return {
        "because": (*coverage.missing, *doubts_of_draws(value, interval, float(np.mean(~np.isfinite(radius))))),
        "radius": value,
        "interval95": interval,
        "u_turn_time": float(time[0]),
        "u_turn_time95": _interval(time * spread, float(time[0])),
        "of_model": float(radius[0]),
    }


def _median(draws: FloatArray) -> float:
    """Return the median of the draws that have a settled turn."""
    return float(np.median(draws[np.isfinite(draws)]))


def _interval(draws: FloatArray, value: float) -> tuple[float, float]:
    """Return the 95 % interval of the draws that have a settled turn, extended to contain the value."""
    if not np.isfinite(value):
        return float("nan"), float("nan")
    low, high = np.percentile(draws[np.isfinite(draws)], [2.5, 97.5])
    return min(float(low), value), max(float(high), value)


def _usable(rudder: float, offset: FloatArray, sign: float, fin_zero: float, rng: np.random.Generator) -> FloatArray:
    """Return draws of the usable fin angle; an offset below `fin_zero` is not added, but widens the band to both sides."""
    if abs(offset[0]) > fin_zero:
        fin = rudder + sign * offset
    else:
        fin = rudder + rng.uniform(-1.0, 1.0, offset.size) * abs(offset[0])
        fin[0] = rudder
    return np.maximum(fin, LEAST_SHARE * rudder)


def _reach(source: ParameterSource, speed: float, rudder: float, rate: float, quarter_s: float) -> DataCoverage:
    flown = source.supports(speed)
    if not source.models:
        return data_coverage({}, fin=rudder, rate=abs(rate), quarter_s=quarter_s, speed_flown=flown)
    model = source.models[source.near(speed)[0][0]]
    slowest = model.values.get("cross_damping", np.inf) * model.law.scale(speed)
    settles = slowest * model.trained.get("held_s", 0.0) >= 1.0
    return data_coverage(model.trained, fin=rudder, rate=abs(rate), quarter_s=quarter_s, speed_flown=flown, sway_settles=settles)


def _chosen(source: ParameterSource, method: str) -> str:
    if method != "auto":
        return method
    return "simulated" if any(m.effects for m in source.models) else "u_turn"


def _check(source: ParameterSource, speeds: Sequence[float], rudder_max: float, method: str) -> None:
    if source.axis is not Axis.YAW:
        raise UsageError("a turning radius needs the yaw axis", found="pitch parameters", hint="identify with `--axis yaw`")
    if method not in METHODS:
        raise UsageError(f"there is no method {method!r}", found=", ".join(METHODS), hint="leave `--method` out")
    if method in ("simulated", "maneuvering") and not source.models:
        raise UsageError("a table cannot be simulated", found="no model", hint="give model files, or `--method u_turn`")
    refuse_fin_limit("the rudder held in a turn", rudder_max)
    if not len(speeds) or not all(s > 0 and np.isfinite(s) for s in speeds):
        raise UsageError("speeds must be above zero", found=f"{list(speeds)}", hint="write `--speeds 0.5:2.5:0.1` or `1.0,1.5`")


def _notes(
    source: ParameterSource, rows: Sequence[TurnRow], method: str, surge: SurgeModel | None, fin_zero: float
) -> list[Note]:
    notes = []
    outside = sorted({r.speed for r in rows if not source.supports(r.speed)})
    if outside:
        low, high = float(source.speeds[0]), float(source.speeds[-1])
        notes.append(
            Note(
                "outside_support",
                f"{len(outside)} speeds from {outside[0]:.3g} to {outside[-1]:.3g} m/s lie outside {low:.3g} .. {high:.3g} m/s, "
                "where data were taken",
                {"speeds": outside},
            )
        )
    if method in ("simulated", "maneuvering") and (surge is None or not surge.surge_measured):
        notes.append(Note("surge_not_measured", "no surge in the runs: the loss of speed in a turn is taken as 15 % (5 .. 50 %)"))
    shaping = sorted({e.name for m in source.models for e in effects_of(m) if e.extra_states or e.limits_rate})
    if method in ("u_turn", "steady") and shaping:
        words = "the formula has damping and authority alone: in it and its band is nothing of "
        notes.append(Note("effects_not_in_formula", f"{words}{', '.join(shaping)}, by which the models turn as well"))
    if method == "u_turn":
        notes += _offset_notes(source, fin_zero)
    return [*notes, *source.notes]


def _offset_notes(source: ParameterSource, fin_zero: float) -> list[Note]:
    names = NAMES[Axis.YAW]
    offsets = [
        (p, p.values[names.trim] / p.values[names.authority])
        for p in source.points
        if {names.trim, names.authority} <= set(p.values)
    ]
    small = [o for _, o in offsets if MIN_REPORTED_OFFSET_RAD < abs(o) <= fin_zero]
    if not small:
        return []
    return [
        Note(
            "offset_not_counted",
            f"fin offsets up to {max(map(abs, small)):.3g} rad are within {fin_zero:.3g} rad, the tolerance of a fin's zero: "
            "port and starboard are taken alike (`--fin-zero 0` counts them)",
        )
    ]
