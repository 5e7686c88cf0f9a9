"""Small fin angles do nothing: delta = 0 inside +/-width, command - width sign(command) outside (width >= 0, rad).

Subtractive, so the fin moves off smoothly at the edge. Source: Tao and Kokotovic 1996, Adaptive Control of Systems
with Actuator and Sensor Nonlinearities.
"""

from __future__ import annotations

import numpy as np

from fieldsid.effects._paths import through_map
from fieldsid.models.axis import Axis
from fieldsid.models.effect import Coefficient, Effect, FinPath, Stage, Values
from fieldsid.models.record import Record


def fin(path: FinPath, values: Values, record: Record) -> FinPath:
    """Return the path with the dead zone of half width `width` taken out, (n-1,) rad."""
    width = values["width"]
    if width <= 0.0:
        return path
    return through_map(
        path,
        lambda d: np.sign(d) * np.maximum(np.abs(d) - width, 0.0),
        lambda d: 0.5 * np.maximum(np.abs(d) - width, 0.0) ** 2,
    )


EFFECT = Effect(
    name="deadband",
    says="small fin angles do nothing",
    stage=Stage.ACTUATOR,
    axes=(Axis.YAW, Axis.PITCH),
    equation="delta = 0 for |command| <= width, else command - width * sign(command)",
    coefficients=(
        Coefficient("width", "rad", 0.0, 0.2, 0.03, scan=(0.01, 0.03, 0.08), step=5e-4, says="half width of the dead zone"),
    ),
    telltale="small commands give too little turn and large ones too much: the gain read from small steps is low",
    excited_by=("stairs", "multisine", "chirp", "square_pulses"),
    mistaken_for=("backlash", "stall", "quadratic_damping", "asymmetric_fin"),
    source="Tao and Kokotovic 1996, Adaptive Control of Systems with Actuator and Sensor Nonlinearities",
    order=50,
    fin=fin,
)
