"""Score (Lagrange multiplier) test for an unmodelled lag: a moment that depends on the past of the fin or of the motion.

Moments proportional to fading means of the fin, its square and the square of the rate are added to the model with coefficients of
zero. With everything else refitted to first order, the fall of the whitened sum of squares is chi-square distributed if none of
them is present. The noise model prevents a slow disturbance from being mistaken for such a moment. Source: Rao 1948.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fieldsid.diagnosis.evidence.likelihood_fit import FittedProblem
from fieldsid.fitting.initial.effect_screen import linearise_at, project_out, whitened_rows, with_effect
from fieldsid.models.axis import Axis
from fieldsid.models.effect import Coefficient, Effect, Stage, Terms, Values
from fieldsid.models.model import Noise
from fieldsid.models.record import Record
from fieldsid.numerics.arrays import FloatArray
from fieldsid.numerics.first_order_lag import held_first_order_lag
from fieldsid.numerics.gram_least_squares import solve_normal_equations
from fieldsid.numerics.tail_probabilities import chi_square_tail

MEMORY_TIME_CONSTANTS_S = (1.5, 5.0, 12.0)


@dataclass(frozen=True, slots=True)
class ScoreTest:
    """The p-value of the test, and, in words, the feature with which the moment is most correlated."""

    p: float
    what: str


def fading_mean(values: FloatArray, record: Record, memory: float) -> FloatArray:
    """Return the exponentially fading mean (n,) of values (n,) over a memory in s, started at their first value."""
    return held_first_order_lag(values[:-1], np.exp(-record.steps / memory), float(values[0]))


def features(record: Record) -> dict[str, FloatArray]:
    """Return the fading means (n,) by the name of their feature."""
    fin = record.fin - float(np.median(record.fin))
    rate = record.rate if record.rate_ok.any() else np.gradient(record.angle, record.time)
    parts = {"fin": fin, "fin squared": fin**2, "rate squared": rate**2}
    return {
        f"{name} of the last {m:g} s": fading_mean(v, record, m) for name, v in parts.items() for m in MEMORY_TIME_CONSTANTS_S
    }


NAMES = tuple(
    f"{name} of the last {m:g} s" for name in ("fin", "fin squared", "rate squared") for m in MEMORY_TIME_CONSTANTS_S
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
"""An effect outside the catalogue: it has no physical meaning except that a moment depends on the fin or the motion."""


def memory_score_test(fitted: FittedProblem, noise: Noise) -> ScoreTest:
    """Return the score test for a dependence of a fit's training residuals on the past of the fin or of the motion."""
    linearisation = linearise_at(fitted.problem, fitted.x, noise)
    problem, x = with_effect(fitted.problem, fitted.x, MEMORY, {})
    new = [i for i, s in enumerate(problem.layout.parameters) if s.name in NAMES]
    left = project_out(linearisation.basis, whitened_rows(linearisation, problem, x, new))
    gram = left @ left.T
    gain = float(gram[0, 1:] @ solve_normal_equations(gram[1:, 1:], gram[1:, 0]))
    alone = gram[0, 1:] ** 2 / np.maximum(np.diag(gram)[1:], np.finfo(float).tiny)
    return ScoreTest(chi_square_tail(gain, len(NAMES)), NAMES[int(np.argmax(alone))])
