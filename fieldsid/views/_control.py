"""A plant and a controller as python-control state spaces whose names fit, so that `control.interconnect` closes the loop.

The plant's input is the fin command (rad), its outputs angle (rad) and rate (rad/s); the controller's inputs are the reference,
angle and rate, its output is the fin without the feed-forward. A delay is a Pade approximation.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

import numpy as np

from fieldsid.errors import FieldsidError
from fieldsid.models.axis import NAMES, Axis
from fieldsid.models.model import Model
from fieldsid.plant.parameter_source import source_of_models
from fieldsid.schedule.linear_plant import FinLimits, LinearPlant, plants_at
from fieldsid.schedule.record import Row

PADE_ORDER = 4


def python_control() -> Any:
    """Return the module; raises FieldsidError where python-control is not installed."""
    try:
        return import_module("control")
    except ImportError as error:
        raise FieldsidError("python-control is not installed", found=str(error), hint="pip install control") from error


def model_system(model: Model, speed: float | None) -> Any:
    """Return the plant of a model at a speed (m/s), without one that of its law."""
    at = model.law.reference if speed is None else speed
    ((plant, _),) = plants_at(source_of_models([model], ["model"]), at, FinLimits(), 1, 0)
    return plant_system(plant)


def plant_system(plant: LinearPlant) -> Any:
    """Return the estimate of a plant: the lag and delay of the fin in series with the hull, with sway or heave if present."""
    control, names = python_control(), NAMES[plant.axis]
    a, k, c, c_r, c_f = plant.straight[:, 0].tolist()
    b, lag, delay = (float(part[0]) for part in (plant.authority, plant.lag, plant.delay))
    ways, fin = np.array([[0.0, 1.0, 0.0], [-k, -a, 1.0], [0.0, -c_r, -c]]), np.array([[0.0], [b], [c_f]])
    states = 3 if c_r or c_f else 2
    hull = control.ss(ways[:states, :states], fin[:states], np.eye(2, states), np.zeros((2, 1)))
    path = control.ss([], [], [], [[1.0]])
    if lag > 0.0:
        path = control.ss([[-1.0 / lag]], [[1.0 / lag]], [[1.0]], [[0.0]])
    if delay > 0.0:
        path = path * control.tf2ss(*control.pade(delay, PADE_ORDER))
    series = hull * path
    return control.ss(series.A, series.B, series.C, series.D, inputs=[names.fin], outputs=[names.angle, names.rate])


def controller_system(row: Row, axis: Axis) -> Any:
    """Return a row's controller."""
    control, names, g = python_control(), NAMES[axis], row.gains
    inputs, direct = [names.goal, names.angle, names.rate], [[g.kp + row.reference_gain, -g.kp, -g.kd]]
    if g.ki == 0.0:
        return control.ss([], [], [], direct, inputs=inputs, outputs=[names.fin])
    return control.ss([[0.0]], [[1.0, -1.0, 0.0]], [[g.ki]], direct, inputs=inputs, outputs=[names.fin])
