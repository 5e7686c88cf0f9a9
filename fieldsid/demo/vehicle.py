"""The vehicle of the tour: a small torpedo whose dynamics have one effect more than the textbook model.

The strength of the hidden effect follows from its declaration: it is the first of its start value, its scan values and their
multiples with which the fitted textbook model has an error above the sensors' noise.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from types import MappingProxyType

import numpy as np

from fieldsid.effects import all_effects, pick_effect
from fieldsid.errors import UsageError
from fieldsid.fitting.initial.equation_error import equation_error_start
from fieldsid.fitting.optimise.levenberg_marquardt import levenberg_marquardt
from fieldsid.fitting.problem.parameters import layout_of, speed_groups
from fieldsid.fitting.problem.problem import Problem
from fieldsid.logs.run import Run
from fieldsid.maneuvers import Limits, Maneuver, Schedule, all_maneuvers
from fieldsid.models.axis import Axis
from fieldsid.models.effect import Effect
from fieldsid.models.model import Model, Noise
from fieldsid.models.record import record_of
from fieldsid.models.speed_law import TRIM_OF_FIN, SpeedLaw
from fieldsid.numerics.arrays import FloatArray
from fieldsid.planning.flight.dry_run import dry_run, with_noise

SPEED = 1.4
SPEED_NOISE = 0.02
PULSES, ZIGZAG = "square_pulses", "zigzag"
LIMITS = Limits(0.35, 1.5)
NOISE = Noise(angle=np.radians(0.3), rate=np.radians(0.2))
BASE = {
    Axis.YAW: {"a22": 1.1, "b2": -1.15, "C0": 0.012},
    Axis.PITCH: {"c22": 1.3, "c23": 0.35, "d2": 1.25, "Cb": 0.015},
}
UNITS = {"a22": "1/s", "b2": "1/s^2", "C0": "rad/s^2", "c22": "1/s", "c23": "1/s^2", "d2": "1/s^2", "Cb": "rad/s^2"}
STRENGTHS: Mapping[str, Mapping[str, float]] = MappingProxyType(
    {
        "servo_lag": {"lag": 0.35},
        "sway_coupling": {"cross_damping": 1.0, "cross_rate": -0.6},
        "heave_coupling": {"cross_damping": 1.0, "cross_rate": -0.6},
    }
)
"""Strengths chosen by hand; those of all other effects follow from their declarations."""
VISIBLE, SEEN = 2.0, 1.3
"""Rms residual of the fitted textbook model over the sensor noise, from which on the effect counts as visible in the training
maneuver, and as noticeable in the validation maneuver."""
SEED = 5


def hidden_vehicle(effect: str) -> Model:
    """Return the vehicle with an effect hidden in it, by name; raises UsageError naming the near matches."""
    part = pick_effect(effect)
    axis = part.axes[0]
    if effect in STRENGTHS:
        return _model(axis, (effect,), STRENGTHS[effect])
    for values in _strengths(part):
        model = _model(axis, (effect,), values)
        if misfit(model) >= VISIBLE:
            return model
    raise UsageError(
        f"effect `{effect}` cannot be seen on the tour's maneuver",
        found=f"a model without it fits to less than {VISIBLE:g} x the noise at every strength tried",
        hint="choose another one of: " + ", ".join(sorted(n for n in all_effects(axis) if n != effect)),
    )


def varied(role: str, time: FloatArray, speed: float) -> FloatArray:
    """Return a helper signal (n,) that varies as on a real dive, so that an effect which needs it becomes visible."""
    shapes = {
        "surge": speed * (1.0 + 0.3 * np.sin(2 * np.pi * time / 17.0)),
        "thrust": 50.0 * (1.0 + 0.4 * np.sign(np.sin(2 * np.pi * time / 11.0))),
        "roll": 0.15 * np.sin(2 * np.pi * time / 9.0),
        "depth": 3.0 + 2.0 * np.sin(2 * np.pi * time / 25.0),
    }
    return np.asarray(shapes[role])


def helpers(effects: tuple[Effect, ...], time: FloatArray, speed: float) -> dict[str, FloatArray]:
    """Return the helper signals the effects need, by role, each (n,)."""
    return {role: varied(role, time, speed) for e in effects for role in e.needs}


def _model(axis: Axis, effects: tuple[str, ...], values: Mapping[str, float]) -> Model:
    return Model(
        axis=axis,
        effects=effects,
        values=BASE[axis] | dict(values),
        units=UNITS,
        free=(),
        covariance=np.zeros((0, 0)),
        law=SpeedLaw(SPEED, trim_of_fin=TRIM_OF_FIN[axis]),
        noise=NOISE,
        method="made up",
    )


def _strengths(effect: Effect) -> Iterator[dict[str, float]]:
    """Yield values of an effect's shared coefficients, from the likely to the extreme."""
    starts = {c.name: c.start for c in effect.shared}
    yield starts
    for c in effect.shared:
        for value in c.scan:
            yield starts | {c.name: value}
    for factor in (2.0, 4.0, 8.0, 16.0):
        yield {c.name: float(np.clip(factor * c.start, c.low, c.high)) for c in effect.shared}


def training_maneuver(model: Model) -> Maneuver:
    """Return the paper's pulses where they excite the hidden effect, else the first maneuver that does."""
    wanted = [name for effect in model.effects for name in pick_effect(effect).excited_by]
    known = all_maneuvers()
    return known[PULSES if PULSES in wanted else next((n for n in wanted if n in known), PULSES)]


def flown(
    model: Model, maneuver: Maneuver, speed: float, seed: int, *,
    schedule: Schedule | None = None, parameters: Mapping[str, float] = MappingProxyType({}),
) -> Run:  # fmt: skip
    """Return a maneuver flown by the vehicle at a speed in m/s, measured with its sensors' noise of a seed."""
    effects = tuple(pick_effect(n) for n in model.effects)
    values = maneuver.checked(parameters)
    run = dry_run(
        model, maneuver, values,
        speed=speed, limits=LIMITS, schedule=schedule, helpers=lambda time: helpers(effects, time, speed),
    )  # fmt: skip
    surge = run["surge_m_s"] + np.random.default_rng(1000 + seed).normal(0.0, SPEED_NOISE, len(run))
    return with_noise(replace(run, signals={**run.signals, "surge_m_s": surge}), model, seed)


def judging_maneuver(model: Model) -> Maneuver:
    """Return a zigzag where the hidden effect shows on it, else the maneuver that excites the effect."""
    zigzag = all_maneuvers()[ZIGZAG]
    return zigzag if misfit(model, zigzag) >= SEEN else training_maneuver(model)


def misfit(model: Model, maneuver: Maneuver | None = None) -> float:
    """Return the residual of the fitted textbook model over the noise, of angle or rate, on the motion of a model.

    The motion is that of the training maneuver if none is given.
    """
    record = record_of(flown(model, maneuver or training_maneuver(model), SPEED, SEED), model.axis)
    problem = Problem((record,), layout_of((record,), model.axis, (), speed_groups((record,))))
    residual, _ = problem.residual(levenberg_marquardt(problem, equation_error_start((record,), problem.layout), NOISE).x, 0)
    return float(np.max(np.sqrt(np.mean(residual**2, axis=1)) / (NOISE.angle, NOISE.rate)))
