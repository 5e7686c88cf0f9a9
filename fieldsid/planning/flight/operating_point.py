"""An operating point: a model at one speed with base parameters, effects and trim fin; and an autopilot for the recovery."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from fieldsid.dynamics.assemble import Base
from fieldsid.dynamics.free_run import base_at, command_record, effects_of
from fieldsid.errors import ModelError
from fieldsid.maneuvers import Autopilot, Limits
from fieldsid.models.axis import NAMES, Axis
from fieldsid.models.effect import Effect
from fieldsid.models.model import Model
from fieldsid.models.record import Record
from fieldsid.numerics.arrays import FloatArray

RECOVERY_DAMPING = 0.9
SLOWEST_RECOVERY = 0.4
"""Damping ratio and lowest natural frequency (rad/s) of the autopilot's recovery."""


@dataclass(frozen=True, slots=True, eq=False)
class OperatingPoint:
    """One model at one speed (m/s) with values of all coefficients, per-run ones at their start values.

    Equality is identity, so that kernel inputs can be cached for an operating point.
    """

    model: Model
    effects: tuple[Effect, ...]
    speed: float
    base: Base
    values: Mapping[str, float]

    @property
    def axis(self) -> Axis:
        """The axis of the model."""
        return self.model.axis

    @property
    def scale(self) -> float:
        """The speed over the model's reference speed."""
        return self.model.law.scale(self.speed)

    @property
    def trim_fin(self) -> float:
        """The fin angle (rad) that balances the trim moment."""
        return -self.base.trim / self.base.authority

    def record(self, time: FloatArray, fin: FloatArray) -> Record:
        """Return the record of a fin command (n,) rad over time (n,) s, with both sensors marked as measuring."""
        return command_record(self.axis, time, fin, speed=self.speed, measures=True)


def operating_point(model: Model, speed: float) -> OperatingPoint:
    """Return the operating point of a model at a speed; raises ModelError when its authority is zero."""
    effects = effects_of(model)
    base = base_at(model, speed)
    if not np.isfinite(base.authority) or base.authority == 0.0:
        name = NAMES[model.axis].authority
        raise ModelError(
            f"the prior's fin does nothing: {name} is {base.authority:g} at {speed:g} m/s",
            found=f"{name} = {model.values.get(name, float('nan')):g}",
            hint="start from `--prior torpedo`, or identify a first model",
        )
    values = {c.name: c.start for e in effects for c in e.nuisance} | dict(model.values)
    return OperatingPoint(model, effects, speed, base, values)


def autopilot_of(base: Base, limits: Limits) -> Autopilot:
    """Return a course-keeping controller for a base model: damping ratio 0.9, no faster than the hull allows.

    Poles of s^2 + (a + b kd) s + (k + b kp) are placed at omega = max(a / 2, 1.3 sqrt(k), 0.4 rad/s).
    """
    omega = max(0.5 * base.damping, 1.3 * float(np.sqrt(max(base.stiffness, 0.0))), SLOWEST_RECOVERY)
    rate_gain = max(0.0, (2.0 * RECOVERY_DAMPING * omega - base.damping) / abs(base.authority))
    angle_gain = max(0.0, (omega**2 - base.stiffness) / abs(base.authority))
    sign = 1.0 if base.authority > 0 else -1.0
    return Autopilot(sign * angle_gain, sign * rate_gain, limits.fin)
