"""Something changes for good during the run, such as a lost fin: from the event on authority (1 - loss), moment + moment_step.

    b(t) = b (1 - loss H(t)),   moment = moment_step H(t),   H from 0 to 1 at event_time over one sample
event_time is a share of the run's length, estimated for each run. In its variant H rises over `ramp` seconds. Source: Blanke et
al. 2016, Diagnosis and Fault-Tolerant Control, chapter 2 (abrupt actuator fault).
"""

from __future__ import annotations

import numpy as np

from fieldsid.models.axis import Axis
from fieldsid.models.effect import Coefficient, Effect, Stage, Terms, Values, Variant
from fieldsid.models.record import Record
from fieldsid.numerics.arrays import FloatArray

GRID = tuple(round(0.05 * i, 2) for i in range(21))
"""Event times that are tried, as shares of a run: at 0 the change happened before the run, at 1 after it."""


def happened(share: float, record: Record, ramp: float = 0.0) -> FloatArray:
    """Return H (n,): 0 before the event, 1 after it; it rises over `ramp` s plus one sample, so that it has a derivative."""
    length = float(record.time[-1] - record.time[0])
    event = record.time[0] + share * length
    sample = length / max(record.time.size - 1, 1)
    return np.asarray(np.clip((record.time - event + 0.5 * sample) / (sample + ramp), 0.0, 1.0))


def terms(values: Values, record: Record) -> Terms:
    """Return the factor on the authority (n,) and the moment (n,) rad/s^2."""
    after = happened(values["event_time"], record, values.get("ramp", 0.0))
    return Terms(authority_factor=1.0 - values["loss"] * after, moment=values["moment_step"] * after)


EFFECT = Effect(
    name="step_change",
    says="something changes for good during the run, such as a lost or fouled fin",
    stage=Stage.HYDRODYNAMICS,
    axes=(Axis.YAW, Axis.PITCH),
    equation="b(t) = b * (1 - loss * H(t - event)), moment = moment_step * H(t - event)",
    coefficients=(
        Coefficient("loss", "1", -1.0, 1.0, 0.05, says="share of the authority lost at the event"),
        Coefficient("moment_step", "rad/s^2", -2.0, 2.0, 0.005, says="change of the trim moment at the event"),
        Coefficient(
            "event_time", "run", 0.0, 1.0, 0.5, scan=GRID, step=2e-3, per_run=True, says="when it happens, as a share of the run"
        ),
    ),
    telltale="the residual is white up to one moment and one-sided or too small in gain from there on",
    excited_by=("square_pulses", "multisine", "zigzag", "prbs"),
    mistaken_for=("trim_drift", "speed_varying", "asymmetric_fin", "prop_moment", "wave"),
    source="Blanke, Kinnaert, Lunze and Staroswiecki 2016, Diagnosis and Fault-Tolerant Control",
    terms=terms,
    log_prior_penalty=5.0,
    variants=(
        Variant(
            "it comes on gradually",
            (
                Coefficient(
                    "ramp", "s", 0.0, 20.0, 3.0, scan=(1.5, 5.0), step=1e-2, says="time from the event to the full change"
                ),
            ),
        ),
    ),
)
