"""From models at a few speeds to laws, radius and measured circles.

`load_source(paths)` takes models, a table or a fit file; `fit_laws` is `sysid fit`, `turn_radius` is `sysid turn-radius`,
`measure_turn(run)` fits the circle of a run.
"""

from fieldsid.turning.laws import Laws, fit_laws, load_laws, save_laws
from fieldsid.turning.measured import MeasuredTurn, measure_turn
from fieldsid.turning.prediction import TurnPrediction
from fieldsid.turning.radius import turn_radius
from fieldsid.turning.source import Source, load_source

__all__ = [
    "Laws",
    "MeasuredTurn",
    "Source",
    "TurnPrediction",
    "fit_laws",
    "load_laws",
    "load_source",
    "measure_turn",
    "save_laws",
    "turn_radius",
]
