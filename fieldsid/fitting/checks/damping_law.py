"""Whether a vehicle is unstable at rest, from a fit with damping by a free power of the rate instead of one assumed law.

a22 is the slope at rest of the damping curve -a22 r - q r |r|^(p - 1), which is fitted to turns. The power p determines the curve
between the turns and rest: a stable hull with damping by r^3 looks unstable in a fit with r |r|. The profile likelihood,
maximised over all other parameters, gives the best power. The error of the slope combines that of the fit at this power with that
of the power, which follows from the curvature of the profile; correlated samples are counted once. Where the best power is at a
bound of its range, the error of the power is the width of the range. Source: Norrbin 1971, Theory and observations on the use of
a mathematical model for ship manoeuvring (the cubic form).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fieldsid.errors import FieldsidError
from fieldsid.fitting.initial.effect_screen import carry_parameters
from fieldsid.fitting.optimise.levenberg_marquardt import covariance, levenberg_marquardt
from fieldsid.fitting.optimise.residual_weights import negative_log_likelihood, white_weights
from fieldsid.fitting.predict.command_timing import MAX_CORRELATION_LAG_S, correlation_length
from fieldsid.fitting.problem.problem import Problem
from fieldsid.models.axis import NAMES
from fieldsid.models.effect import as_fitted, effect_named
from fieldsid.models.model import Noise
from fieldsid.numerics.arrays import FloatArray

POWERS = (1.4, 4.0)
"""Bounds of the power of the rate: below the first, the damping is nearly linear and cannot be separated from the slope."""
SQUARE = 2.0
POWER_STEP = 0.1
"""Half width of the difference that gives the curvature of the profile."""
CLEAR_STD_ERRORS = 2.0
"""Standard errors from which a value's sign is clear."""


@dataclass(frozen=True, slots=True)
class SlopeAtRest:
    """The damping at rest (1/s) in a fit with a free power of the rate, its error, the power, and the log likelihood gained."""

    value: float
    std_error: float
    power: float
    gained: float

    @property
    def is_negative(self) -> bool:
        """Whether the slope is significantly negative."""
        return self.value < -CLEAR_STD_ERRORS * self.std_error

    @property
    def is_positive(self) -> bool:
        """Whether the slope is significantly positive."""
        return self.value > CLEAR_STD_ERRORS * self.std_error


def slope_at_rest(problem: Problem, x: FloatArray) -> SlopeAtRest | None:
    """Return the slope at rest from refits of a fit x with damping by a free power; None where they do not converge."""
    try:
        return _Profile(problem, x).best()
    except FieldsidError:  # a refit failed
        return None


class _Profile:
    """Refits of a fit x with damping of given powers, each begun where the last one ended."""

    def __init__(self, problem: Problem, x: FloatArray) -> None:
        known = dict(zip(problem.layout.names, x.tolist(), strict=False))
        start = {"quadratic": max(known.get("quadratic", 0.0), 0.05), "rate_power": SQUARE}
        others = [e for e in problem.layout.effects if not e.limits_rate]
        self.before = negative_log_likelihood(problem, x)
        self.problem = problem.with_effects((*others, as_fitted(effect_named("quadratic_damping"), start)))
        names = self.problem.layout.names
        self.power, self.slope = names.index("rate_power"), names.index(NAMES[problem.layout.axis].damping)
        self.free = [i for i in range(len(self.problem.layout.parameters)) if i != self.power]
        self.at = carry_parameters(self.problem.layout, (problem.layout, x), otherwise=start)
        self.weights: Noise = white_weights(problem, x)
        self.refit(SQUARE)
        self.weights = white_weights(self.problem, self.at)

    def refit(self, power: float) -> tuple[float, float, float]:
        """Return minus the log likelihood at a power, the slope at rest and its error there."""
        begin = self.at.copy()
        begin[self.power] = power
        found = levenberg_marquardt(self.problem, begin, self.weights, free=self.free, max_iterations=30, tolerance=1e-7)
        self.at = found.x
        error = float(np.sqrt(covariance(found.normal)[self.free.index(self.slope), self.free.index(self.slope)]))
        return negative_log_likelihood(self.problem, found.x), float(found.x[self.slope]), error

    def best(self) -> SlopeAtRest | None:
        """Return the slope at rest at the power of the largest likelihood."""
        from scipy.optimize import minimize_scalar

        found = minimize_scalar(lambda p: self.refit(float(p))[0], bounds=POWERS, method="bounded", options={"xatol": 0.02})
        power = float(np.clip(found.x, POWERS[0] + POWER_STEP, POWERS[1] - POWER_STEP))
        low, high = self.refit(power - POWER_STEP), self.refit(power + POWER_STEP)
        middle = self.refit(power)
        is_at_bound = power != found.x
        curvature = max((low[0] - 2.0 * middle[0] + high[0]) / POWER_STEP**2, 1e-12)
        correlation = self._correlation_length()
        power_error = POWERS[1] - POWERS[0] if is_at_bound else np.sqrt(correlation / curvature)
        error = float(np.hypot(np.sqrt(correlation) * middle[2], (high[1] - low[1]) / (2.0 * POWER_STEP) * power_error))
        gained = self.before - middle[0]
        return SlopeAtRest(middle[1], error, power, gained) if np.isfinite([gained, error, middle[1]]).all() else None

    def _correlation_length(self) -> float:
        """Return the correlation length of the residuals in samples, the largest over runs and channels."""
        lengths = [1.0]
        for run, record in enumerate(self.problem.records):
            residual, _ = self.problem.residual(self.at, run)
            lags = round(MAX_CORRELATION_LAG_S / float(np.median(record.steps)))
            lengths += [correlation_length(e[ok], lags) for e, ok in zip(residual, record.ok, strict=True) if ok.any()]
        return max(lengths)
