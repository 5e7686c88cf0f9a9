"""Small fin angles do nothing: delta = 0 inside +/-width, command - width sign(command) outside (width >= 0, rad).

Subtractive, so the fin moves off smoothly at the edge. In its other forms the edge is rounded over deadband_blend, or the
fin jumps at it by the share deadband_jump of the width. Source: Tao and Kokotovic 1996, Adaptive Control of Systems
with Actuator and Sensor Nonlinearities.
"""

from __future__ import annotations

import numpy as np

from fieldsid.effects._paths import Beyond, through_map
from fieldsid.logs.run import FloatArray
from fieldsid.models.axis import Axis
from fieldsid.models.effect import Coefficient, Effect, FinPath, Form, Stage, Values
from fieldsid.models.record import Record


def fin(path: FinPath, values: Values, record: Record) -> FinPath:
    """Return the path with the dead zone of half width `width` taken out, (n-1,) rad."""
    width, kept = values["width"], values.get("deadband_jump", 0.0)
    if width <= 0.0:
        return path
    beyond = Beyond(width, values.get("deadband_blend", 0.0))

    def value(d: FloatArray) -> FloatArray:
        return beyond.value(d) + kept * width * np.sign(d) * (np.abs(d) > width)

    def area(d: FloatArray) -> FloatArray:
        return beyond.area(d) + kept * width * np.maximum(np.abs(d) - width, 0.0)

    return through_map(path, value, area)


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
    forms=(
        Form(
            "the edge is smooth",
            (
                Coefficient(
                    "deadband_blend",
                    "rad",
                    0.0,
                    0.2,
                    0.03,
                    scan=(0.02, 0.06),
                    step=5e-4,
                    says="angle over which the edge is rounded",
                ),
            ),
        ),
        Form(
            "the fin jumps at the edge",
            (
                Coefficient(
                    "deadband_jump", "1", 0.0, 1.0, 0.8, scan=(0.5, 1.0), step=1e-3, says="share of the width it jumps by"
                ),
            ),
        ),
    ),
    fin=fin,
)
