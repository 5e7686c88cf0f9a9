"""Score a candidate: expected errors over the prior's spread, and how much of the envelope it uses."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from fieldsid.maneuvers import Autopilot
from fieldsid.models.axis import NAMES
from fieldsid.models.model import Model
from fieldsid.planning.belief.prior_model import corner, scales_of
from fieldsid.planning.design.information import Information, information_of
from fieldsid.planning.flight.excitation import Excitation, Window, flown, flown_all
from fieldsid.planning.flight.operating_point import OperatingPoint, autopilot_of, operating_point
from fieldsid.planning.safety.envelope import Envelope, excursions_of, used
from fieldsid.planning.safety.monte_carlo import ROLL_SPREAD

CORNER = 1.3
PENALTY = 30.0
LOST = 1e6
"""Standard errors at which the envelope is tried; cost of leaving it per share of a limit; cost of an unknown parameter."""


@dataclass(frozen=True, slots=True)
class Objective:
    """The objective of excitations at one speed.

    `scenes`: operating points of the prior's mean and of its corners. `weights`: 1 / (scale x relative accuracy goal) of each
    parameter; the cost of an excitation is its largest weighted error, 1 where every goal is just met.
    """

    scenes: tuple[OperatingPoint, ...]
    envelope: Envelope
    window: Window
    autopilot: Autopilot
    weights: Mapping[str, float]
    run_up: float

    @property
    def scene(self) -> OperatingPoint:
        """The prior's mean at this speed."""
        return self.scenes[0]

    def cost(self, candidate: Excitation, margin: float = 1.0) -> float:
        """Return the mean log of the worst weighted error over the scenes, plus a penalty outside margin x envelope."""
        responses = flown_all(self.scenes, candidate, self.window, self.envelope.limits, self.autopilot)
        angle, rate = (np.stack([getattr(r, part) for r in responses], axis=1) for part in ("angle", "rate"))
        far = excursions_of(
            self.scene.axis, angle, rate, speed=self.scene.speed, step=1.0 / self.window.rate_hz, run_up=self.run_up,
            roll_gain=1.0 + ROLL_SPREAD,
        )  # fmt: skip
        errors = [self.worst(information_of(scene, response)) for scene, response in zip(self.scenes, responses, strict=True)]
        return float(np.mean(np.log(errors)) + PENALTY * max(0.0, np.max(used(far, self.envelope)) / margin - 1.0))

    def worst(self, information: Information) -> float:
        """Return the largest weighted error of an information."""
        errors = information.std_errors()
        worst = max(errors[n] * w for n, w in self.weights.items())
        return float(min(worst, LOST)) if np.isfinite(worst) else LOST

    def expected(self, candidate: Excitation) -> Information:
        """Return the information of a candidate at the prior's mean."""
        return information_of(self.scene, flown(self.scene, candidate, self.window, self.envelope.limits, self.autopilot))


def make_objective(
    model: Model, speed: float, envelope: Envelope, window: Window, want: Mapping[str, float], run_up_s: float
) -> Objective:
    """Return the objective of excitations at one speed (m/s); `want` holds relative accuracy goals, empty for equal ones."""
    names = NAMES[model.axis]
    scene = operating_point(model, speed)
    damping, authority = names.damping, names.authority
    corners = [{damping: -CORNER, authority: _outward(scene)}, {damping: CORNER, authority: -_outward(scene)}]
    scenes = (scene, *(operating_point(corner(model, c), speed) for c in corners))
    scales = scales_of(model, scene.base, envelope.fin)
    # at steady speed, thrust and depth no maneuver shows what follows them
    steady = {c.name for e in scene.effects if e.needs for c in e.coefficients}
    wanted = dict(want) or {n: 1.0 for n in scales if n not in steady}
    weights = {n: 1.0 / (scales[n] * w) for n, w in wanted.items()}
    return Objective(scenes, envelope, window, autopilot_of(scene.base, envelope.limits), weights, run_up_s * speed)


def _outward(scene: OperatingPoint) -> float:
    """Return the sign of the move that makes the fin stronger, times the corner's distance."""
    return CORNER if scene.base.authority > 0 else -CORNER
