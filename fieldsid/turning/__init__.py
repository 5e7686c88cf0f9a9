"""From models at a few speeds to laws, radius and measured circles.

`load_parameter_source(paths)` takes models, a table or a fit file; `fit_laws` is `sysid fit`, `turn_radius` is `sysid
turn-radius`, `measure_turn(run)` fits the circle of a run.
"""

from fieldsid.plant.laws.axis_laws import Laws, fit_laws, load_laws, save_laws
from fieldsid.plant.parameter_source import ParameterSource, load_parameter_source
from fieldsid.turning.measured.measured_turn import MeasuredTurn, measure_turn
from fieldsid.turning.prediction import TurnPrediction
from fieldsid.turning.radius import turn_radius

__all__ = [
    "Laws",
    "MeasuredTurn",
    "ParameterSource",
    "TurnPrediction",
    "fit_laws",
    "load_laws",
    "load_parameter_source",
    "measure_turn",
    "save_laws",
    "turn_radius",
]
