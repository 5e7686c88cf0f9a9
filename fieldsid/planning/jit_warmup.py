"""The compile warm-up of planning; fitting/jit_warmup.py compiles the kernels that a fit needs as well."""

from __future__ import annotations

from fieldsid.dynamics.linear_kernel import linear_sensitivities
from fieldsid.maneuvers import Autopilot, Limits, Schedule, all_maneuvers, fly
from fieldsid.models.axis import Axis
from fieldsid.noise.kalman.univariate import kalman_filter
from fieldsid.planning.belief.prior_model import named_prior
from fieldsid.planning.flight.operating_point import operating_point
from fieldsid.planning.flight.rule_flight import plant_of

SHARED_KERNELS = (linear_sensitivities, kalman_filter)
"""The kernels of a fit that planning calls."""


def compile_planning() -> None:
    """Call each kernel of planning once, on vehicles at rest."""
    # sizes above one, so that the arrays have the memory layout of a real plan
    scene = operating_point(named_prior("torpedo", Axis.YAW), 1.0)
    plant = plant_of([scene, scene], 3, 20.0)
    still, short = Autopilot(0.0, 0.0), Schedule(20.0, 0.0, 0.0)
    for maneuver in all_maneuvers().values():
        if maneuver.rule is not None:
            shortest = {p.name: p.low for p in maneuver.parameters}
            fly(maneuver, shortest, plant.again(plant.off), limits=Limits(0.1), autopilot=still, schedule=short)
