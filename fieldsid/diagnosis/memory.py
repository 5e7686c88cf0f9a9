"""Whether a moment follows the fin or the motion with a memory that no effect of the catalogue describes.

A score test: moments proportional to fading means of the fin, its square and the square of the rate join the model at
zero. The fall of the whitened sum of squares, everything else refitted to first order, is chi-square when none of them
is there: the noise model keeps a slow disturbance from being taken for one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fieldsid.diagnosis.trial import Trial
from fieldsid.fitting.products import solved
from fieldsid.fitting.starts import all_rows, ground_of, grown, projected
from fieldsid.fitting.tails import chi_square_tail
from fieldsid.logs.run import FloatArray
from fieldsid.models.axis import Axis
from fieldsid.models.effect import Coefficient, Effect, Stage, Terms, Values
from fieldsid.models.jit import jit
from fieldsid.models.model import Noise
from fieldsid.models.record import Record

MEMORIES_S = (1.5, 5.0, 12.0)


@dataclass(frozen=True, slots=True)
class Follows:
    """p-value of the test, and in words what the moment follows best."""

    p: float
    what: str


def fading_mean(values: FloatArray, record: Record, memory: float) -> FloatArray:
    """Return the exponentially fading mean (n,) of values (n,) over a memory in s, started at their first value."""
    return _faded(values, np.exp(-record.steps / memory))


@jit
def _faded(values: FloatArray, kept: FloatArray) -> FloatArray:
    out = np.empty(values.shape[0])
    out[0] = values[0]
    for i in range(kept.shape[0]):
        out[i + 1] = kept[i] * out[i] + (1.0 - kept[i]) * values[i]
    return out


def features(record: Record) -> dict[str, FloatArray]:
    """Return the fading means (n,) by what they follow."""
    fin = record.fin - float(np.median(record.fin))
    rate = record.rate if record.rate_ok.any() else np.gradient(record.angle, record.time)
    parts = {"fin": fin, "fin squared": fin**2, "rate squared": rate**2}
    return {f"{name} of the last {m:g} s": fading_mean(v, record, m) for name, v in parts.items() for m in MEMORIES_S}


NAMES = tuple(
    f"{name} of the last {m:g} s" for name in ("fin", "fin squared", "rate squared") for m in MEMORIES_S
)  # fmt: skip


def terms(values: Values, record: Record) -> Terms:
    """Return the moment of all features, (n,) rad/s^2."""
    known = features(record)
    return Terms(moment=np.asarray(sum(values[n] * known[n] for n in NAMES)))


MEMORY = Effect(
    name="memory",
    says="a moment follows the fin or the motion with a memory",
    stage=Stage.HYDRODYNAMICS,
    axes=(Axis.YAW, Axis.PITCH),
    equation="moment = sum of coefficients times fading means",
    coefficients=tuple(Coefficient(n, "rad/s^2", -1e6, 1e6, 0.0, step=1e-3) for n in NAMES),
    telltale="",
    excited_by=(),
    mistaken_for=(),
    source="score test, Rao 1948",
    terms=terms,
)
"""Not in the catalogue: no physics is claimed, only that something follows the fin or the motion."""


def follows(trial: Trial, noise: Noise) -> Follows:
    """Return whether what a trial leaves on its training runs follows the fin or the motion with a memory."""
    ground = ground_of(trial.problem, trial.x, noise)
    problem, x = grown(trial.problem, trial.x, MEMORY, {})
    new = [i for i, s in enumerate(problem.layout.slots) if s.name in NAMES]
    left = projected(ground.basis, all_rows(ground, problem, x, new))
    gram = left @ left.T
    gain = float(gram[0, 1:] @ solved(gram[1:, 1:], gram[1:, 0]))
    alone = gram[0, 1:] ** 2 / np.maximum(np.diag(gram)[1:], np.finfo(float).tiny)
    return Follows(chi_square_tail(gain, len(NAMES)), NAMES[int(np.argmax(alone))])
