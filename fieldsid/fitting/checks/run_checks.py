"""Checks of a run before its axis is fitted: which fin is used, its limit, the other axis, an authority of impossible sign."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from fieldsid.fitting.fin_offset import offset_of
from fieldsid.logs.doctor.fin_findings import share_beyond
from fieldsid.logs.few_of import FEW
from fieldsid.logs.run import Note, Run
from fieldsid.models.axis import NAMES, Axis
from fieldsid.models.model import Model
from fieldsid.models.record import fin_holes, speed_beyond, speed_refused
from fieldsid.numerics.white_noise import white_noise_std
from fieldsid.vehicle import Vehicle

MAX_OTHER_AXIS_SHARE = 0.3
MAX_FIN_DISAGREEMENT = 0.2
SIGNS = {"port": -1.0, "starboard": 1.0, "nose_down": -1.0, "nose_up": 1.0}
"""Sign of the turn that a positive fin makes: yaw to starboard and pitch nose up are positive."""


def run_checks(run: Run, axis: Axis, vehicle: Vehicle | None = None) -> tuple[Note, ...]:
    """Return the notes on a run whose axis is to be fitted; the fin's limit is that of the vehicle, where one is given."""
    return (*fin_holes(run, axis), *_fins(run, axis), *_limit(run, axis, vehicle), *_speed(run), *_other_axis(run, axis))


def _fins(run: Run, axis: Axis) -> Iterator[Note]:
    names = NAMES[axis]
    if not (run.has(names.fin) and run.has(names.fin_measured)):
        return
    command, fin = run[names.fin], run[names.fin_measured]
    both = np.isfinite(command) & np.isfinite(fin)
    if not both.any():
        return
    difference = float(np.sqrt(np.mean((command[both] - fin[both]) ** 2)) / max(float(np.std(command[both])), 1e-9))
    if difference > MAX_FIN_DISAGREEMENT:
        yield Note(
            "fin_measured_used",
            f"run {run.name!r}: the measured fin is used, it is {100 * difference:.0f} % of the command away from it (rms, limit "
            f"{100 * MAX_FIN_DISAGREEMENT:.0f} %): the model knows nothing of the servo; for one from the command, leave "
            f"`{names.fin_measured}` out of the mapping",
            {"value": difference, "limit": MAX_FIN_DISAGREEMENT, "signal": names.fin_measured, "run": run.name},
        )


def _limit(run: Run, axis: Axis, vehicle: Vehicle | None) -> Iterator[Note]:
    limit = None if vehicle is None else vehicle.fin_max_rad(axis.value)
    name = NAMES[axis].fin
    if limit is None or not run.has(name):
        return
    share = share_beyond(run, name, limit)
    if share > FEW:
        yield Note(
            "fin_at_limit",
            f"run {run.name!r}: {name} is beyond its limit of {limit:.3g} rad for {100 * share:.0f} % of the time (limit "
            f"{100 * FEW:.0f} %): the fin stopped there, and the log does not show it; log the measured fin",
            {"value": share, "limit": FEW, "signal": name, "run": run.name},
        )


def _speed(run: Run) -> Iterator[Note]:
    refused_speed = speed_beyond(run)
    if refused_speed is None:
        return
    (middle, limit), why = refused_speed, speed_refused(run)
    yield Note(
        "no_speed",
        f"run {run.name!r}: {why}, so the speed is taken as not measured; correct its sign or unit, or map another one",
        {"value": middle, "limit": limit, "signal": "surge_m_s", "run": run.name},
    )


def _other_axis(run: Run, axis: Axis) -> Iterator[Note]:
    names = NAMES[axis]
    if not (run.has(names.rate) and run.has(names.other_rate)):
        return
    own, other = (_motion(run, n) for n in (names.rate, names.other_rate))
    if own > 0.0 and other > MAX_OTHER_AXIS_SHARE * own:
        yield Note(
            "other_axis_moving",
            f"run {run.name!r}: {names.other_rate} moves {other / own:.2f} times as much as {names.rate} (limit "
            f"{MAX_OTHER_AXIS_SHARE:g}): "
            "both axes act on each other; fly one axis at a time",
            {"value": other / own, "limit": MAX_OTHER_AXIS_SHARE, "signal": names.rate, "run": run.name},
        )


def _motion(run: Run, name: str) -> float:
    """Return the standard deviation of a rate less that of its white noise."""
    ok = np.isfinite(run[name])
    values = run[name][ok]
    floor = white_noise_std(np.where(ok, run[name], 0.0), ok)
    return float(np.sqrt(max(float(np.var(values)) - (floor**2 if np.isfinite(floor) else 0.0), 0.0)))


def offset_findings(model: Model, vehicle: Vehicle | None) -> tuple[Note, ...]:
    """Return the finding that the fin offset is larger than the vehicle's fin limit, or than the largest fin of the runs."""
    stated = None if vehicle is None else vehicle.fin_max_rad(model.axis.value)
    largest = stated if stated is not None else model.trained["fin_max"]
    offset = offset_of(model)
    if not abs(offset.value) > largest:
        return ()
    of = "the vehicle's limit" if stated is not None else "the largest fin of the runs"
    is_certain = abs(offset.value) - 2.0 * offset.std_error > largest
    straight = "straight" if model.axis is Axis.YAW else "level"
    says = (
        f"by this model no such fin holds the vehicle {straight}" if is_certain else "these data do not tell it from one within"
    )
    return (
        Note(
            "offset_beyond_fin",
            f"{offset.name} = {offset.value:.3g} +/- {offset.std_error:.2g} rad is beyond {of}, {largest:.3g} rad: {says}; check "
            "unit and sign of the fin, or see with `sysid diagnose` what else turns the vehicle",
            {"value": offset.value, "std_error": offset.std_error, "limit": largest, "parameter": offset.name},
        ),
    )


def sign_findings(model: Model, vehicle: Vehicle | None) -> tuple[Note, ...]:
    """Return the finding that the authority has the opposite sign of the one that the vehicle file states."""
    side = None if vehicle is None else vehicle.positive_rudder if model.axis is Axis.YAW else vehicle.positive_elevator
    name = NAMES[model.axis].authority
    value, error = model.values[name], model.std_error(name)
    if side is None or value * SIGNS[side] > -2.0 * error:
        return ()
    key = "positive_rudder" if model.axis is Axis.YAW else "positive_elevator"
    return (
        Note(
            "impossible_sign",
            f"{model.shown(name)} = {value:.3g} +/- {error:.2g} 1/s^2 has the wrong sign: the vehicle says that a positive fin "
            f"goes {side}; correct `sign` of the fin in the mapping, or `{key}` in vehicle.yaml",
            {"value": value, "std_error": error, "limit": 0.0, "expected": SIGNS[side]},
        ),
    )
