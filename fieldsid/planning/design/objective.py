"""The objective of an experiment: expected errors by the Fisher information over the prior, and excursions within the envelope.

The information of a whitened free run is J^T J with J its sensitivities. Whitening is by the Kalman filter of the
prediction-error estimator, so that coloured sensor noise and a disturbance moment are accounted for (Ljung 1999, 7.4). Initial
states and per-run coefficients are nuisance parameters, removed by the Schur complement.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from fieldsid.fitting.optimise.levenberg_marquardt import normal_equations
from fieldsid.fitting.problem.parameters import ParameterLayout, layout_of
from fieldsid.fitting.problem.problem import Problem
from fieldsid.maneuvers import Autopilot
from fieldsid.models.axis import NAMES
from fieldsid.models.model import Model
from fieldsid.models.record import Record
from fieldsid.numerics.arrays import FloatArray
from fieldsid.planning.belief.prior_model import corner, scales_of
from fieldsid.planning.flight.excitation import Excitation, Window, flown, flown_all
from fieldsid.planning.flight.operating_point import OperatingPoint, autopilot_of, operating_point
from fieldsid.planning.flight.rule_flight import Response
from fieldsid.planning.safety.envelope import Envelope, excursions_of, used
from fieldsid.planning.safety.monte_carlo import ROLL_SPREAD

SMALLEST_PIVOT = 1e-10
"""Smallest eigenvalue of the information in correlation form of an identifiable direction; a ridge of this size is added."""


@dataclass(frozen=True, slots=True)
class Information:
    """The information matrix (p, p) of the parameters `names` at one speed, without nuisances; those of independent runs add."""

    names: tuple[str, ...]
    matrix: FloatArray

    def std_errors(self) -> dict[str, float]:
        """Return the standard error of every parameter, infinite where it is not identifiable from the flight."""
        errors = np.full(len(self.names), np.inf)
        excited = np.flatnonzero(np.diag(self.matrix) > 0.0)
        if np.isfinite(self.matrix).all() and excited.size:
            part = self.matrix[np.ix_(excited, excited)]
            scale = np.sqrt(np.diag(part))
            values, vectors = np.linalg.eigh(part / np.outer(scale, scale))
            singular = values < SMALLEST_PIVOT
            variance = (vectors[:, ~singular] ** 2 / values[~singular]).sum(axis=1)
            hidden = (vectors[:, singular] ** 2).sum(axis=1) > 1e-6
            errors[excited] = np.where(hidden, np.inf, np.sqrt(variance)) / scale
        return dict(zip(self.names, errors.tolist(), strict=True))


def problem_of(scene: OperatingPoint, record: Record) -> tuple[Problem, FloatArray]:
    """Return the estimation problem of an operating point's model on one record, and its vector of true values (N,)."""
    layout, x = _layout(scene)
    return Problem((record,), layout), x.copy()


@lru_cache(maxsize=32)
def _layout(scene: OperatingPoint) -> tuple[ParameterLayout, FloatArray]:
    """Return the parameter layout of an operating point's model on one run, at the model's reference speed, and true values."""
    law = scene.model.law
    reference = law.reference if np.isfinite(law.reference) else scene.speed
    plain = layout_of([scene.record(np.linspace(0.0, 0.2, 3), np.zeros(3))], scene.axis, scene.effects)
    layout = replace(plain, groups=replace(plain.groups, speeds=(reference,), reference=0, trim_of_fin=law.trim_of_fin))
    names, ratio = NAMES[scene.axis], scene.speed / reference
    at_reference = {names.damping: scene.base.damping / ratio, names.authority: scene.base.authority / ratio**2}
    at_reference[names.trim] = scene.base.trim / (ratio**2 if law.trim_of_fin else 1.0)
    known = {**scene.values, "angle0": 0.0, "rate0": 0.0, **at_reference}
    return layout, np.array([float(known.get(s.name, s.start)) for s in layout.parameters])


def information_of(scene: OperatingPoint, response: Response) -> Information:
    """Return the information of one flight on the shared parameters, which are those at the speed of the flight."""
    record = scene.record(response.time, response.command + scene.trim_fin)
    problem, x = problem_of(scene, record)
    _, normal, _, _ = normal_equations(problem, x, scene.model.noise, range(len(x)))
    layout, names = problem.layout, NAMES[scene.axis]
    shared = layout.shared
    matrix = _without_nuisances(normal, shared)
    unit = np.ones(shared)
    ratio = scene.speed / layout.groups.speeds[0]
    unit[layout.names.index(names.damping)] = ratio
    unit[layout.names.index(names.authority)] = ratio**2
    unit[layout.names.index(names.trim)] = ratio**2 if layout.groups.trim_of_fin else 1.0
    return Information(layout.names, matrix / np.outer(unit, unit))


def _without_nuisances(normal: FloatArray, shared: int) -> FloatArray:
    own = normal[shared:, shared:]
    scale = np.sqrt(np.maximum(np.diag(own), 1e-300))
    cross = normal[:shared, shared:] / scale
    unit = own / np.outer(scale, scale) + SMALLEST_PIVOT * np.eye(scale.size)
    return np.asarray(normal[:shared, :shared] - cross @ np.linalg.solve(unit, cross.T))


CORNER = 1.3
PENALTY = 30.0
LARGEST_ERROR = 1e6
"""Standard errors of the corners of the prior; penalty for an excursion beyond a limit, over the limit; largest weighted error,
for a parameter that is not identifiable."""


RUN_UP_S = 10.0
"""Default straight run before the window of each leg."""


@dataclass(frozen=True, slots=True)
class Setting:
    """The settings that all legs of a plan share; `open_loop` excludes maneuvers whose rule depends on the motion.

    `want` holds relative accuracy goals, empty for equal ones.
    """

    model: Model
    envelope: Envelope
    window: Window
    want: Mapping[str, float]
    run_up_s: float = RUN_UP_S
    seed: int = 1
    open_loop: bool = False


@dataclass(frozen=True, slots=True)
class Objective:
    """The objective of excitations at one speed.

    `scenes` are the operating points of the prior's mean and of its corners, `weights` 1 / (scale x relative accuracy goal) of
    each parameter: a largest weighted error of 1 means that every goal is just met.
    """

    setting: Setting
    scenes: tuple[OperatingPoint, ...]
    autopilot: Autopilot
    weights: Mapping[str, float]

    @property
    def envelope(self) -> Envelope:
        """The limits of a flight."""
        return self.setting.envelope

    @property
    def window(self) -> Window:
        """The part of a leg that is identified on."""
        return self.setting.window

    @property
    def run_up(self) -> float:
        """Length of the straight run before the window, m."""
        return self.setting.run_up_s * self.scene.speed

    @property
    def scene(self) -> OperatingPoint:
        """The prior's mean at this speed."""
        return self.scenes[0]

    def cost(self, candidate: Excitation, margin: float = 1.0) -> float:
        """Return the mean over `scenes` of the log of the largest weighted error, plus a penalty outside margin x envelope."""
        responses = flown_all(self.scenes, candidate, self.window, self.envelope.limits, self.autopilot)
        angle, rate = (np.stack([getattr(r, part) for r in responses], axis=1) for part in ("angle", "rate"))
        far = excursions_of(
            self.scene.axis, angle, rate, speed=self.scene.speed, step=1.0 / self.window.rate_hz, run_up=self.run_up,
            roll_gain=1.0 + ROLL_SPREAD,
        )  # fmt: skip
        errors = [self.worst(information_of(scene, response)) for scene, response in zip(self.scenes, responses, strict=True)]
        return float(np.mean(np.log(errors)) + PENALTY * max(0.0, np.max(used(far, self.envelope)) / margin - 1.0))

    def worst(self, information: Information) -> float:
        """Return the largest weighted error for an information matrix."""
        errors = information.std_errors()
        worst = max(errors[n] * w for n, w in self.weights.items())
        return float(min(worst, LARGEST_ERROR)) if np.isfinite(worst) else LARGEST_ERROR

    def expected(self, candidate: Excitation) -> Information:
        """Return the information of a candidate at the prior's mean."""
        return information_of(self.scene, flown(self.scene, candidate, self.window, self.envelope.limits, self.autopilot))


def make_objective(setting: Setting, speed: float) -> Objective:
    """Return the objective of excitations at one speed (m/s)."""
    model, envelope = setting.model, setting.envelope
    names = NAMES[model.axis]
    scene = operating_point(model, speed)
    damping, authority = names.damping, names.authority
    corners = [{damping: -CORNER, authority: _outward(scene)}, {damping: CORNER, authority: -_outward(scene)}]
    scenes = (scene, *(operating_point(corner(model, c), speed) for c in corners))
    scales = scales_of(model, scene.base, envelope.fin)
    # at constant speed, thrust and depth the effects of these signals are not identifiable
    unexcited = {c.name for e in scene.effects if e.needs for c in e.coefficients}
    goals = dict(setting.want) or {n: 1.0 for n in scales if n not in unexcited}
    weights = {n: 1.0 / (scales[n] * goal) for n, goal in goals.items()}
    return Objective(setting, scenes, autopilot_of(scene.base, envelope.limits), weights)


def _outward(scene: OperatingPoint) -> float:
    """Return the shift of the authority, in standard errors, at the corner of the prior with the stronger fin."""
    return CORNER if scene.base.authority > 0 else -CORNER
