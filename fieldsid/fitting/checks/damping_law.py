"""Whether a vehicle turns by itself, asked of damping that goes with a free power of the rate, not of one law that is assumed.

a22 is the slope at rest of a curve fitted to turns: -a22 r - q r |r|^(p - 1). The power p decides where the curve goes between
the turns and rest: a hull that is stable and damped by r^3 looks unstable to a fit by r |r|. The likelihood is maximised over all
else at each power (its profile); the slope's error at the best power is that of a fit with it and, by the profile's curvature,
that of the power itself, with samples whose residuals are correlated counted once. At an end of the powers' range the law is
not known, and the whole range within reach of it counts.
Source: Norrbin 1971, Theory and observations on the use of a mathematical model for ship manoeuvring (the cubic form).
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
"""Powers of the rate that are tried: below the first, damping is next to linear and no slope can be told from it."""
SQUARE = 2.0
APART = 0.1
"""Half the distance over which the profile's curvature is taken."""
CLEAR_STD_ERRORS = 2.0
"""Standard errors from which a value's sign is clear."""


@dataclass(frozen=True, slots=True)
class SlopeAtRest:
    """The damping at rest under damping of a free power of the rate, 1/s, its error, the power, and the log likelihood gained."""

    value: float
    std_error: float
    power: float
    gained: float

    @property
    def is_negative(self) -> bool:
        """Whether it is so clearly."""
        return self.value < -CLEAR_STD_ERRORS * self.std_error

    @property
    def is_positive(self) -> bool:
        """Whether it is so clearly."""
        return self.value > CLEAR_STD_ERRORS * self.std_error


def slope_at_rest(problem: Problem, x: FloatArray) -> SlopeAtRest | None:
    """Return the slope at rest that refits of a fit x give with damping of a free power; None where they do not converge."""
    try:
        return _Profile(problem, x).best()
    except FieldsidError:  # no refit, no answer
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
        """Return what the power of the largest likelihood gives."""
        from scipy.optimize import minimize_scalar

        found = minimize_scalar(lambda p: self.refit(float(p))[0], bounds=POWERS, method="bounded", options={"xatol": 0.02})
        power = float(np.clip(found.x, POWERS[0] + APART, POWERS[1] - APART))
        low, high = self.refit(power - APART), self.refit(power + APART)
        middle = self.refit(power)
        at_end = power != found.x
        bend = max((low[0] - 2.0 * middle[0] + high[0]) / APART**2, 1e-12)
        repeated = self._correlated()
        of_power = POWERS[1] - POWERS[0] if at_end else np.sqrt(repeated / bend)
        error = float(np.hypot(np.sqrt(repeated) * middle[2], (high[1] - low[1]) / (2.0 * APART) * of_power))
        gained = self.before - middle[0]
        return SlopeAtRest(middle[1], error, power, gained) if np.isfinite([gained, error, middle[1]]).all() else None

    def _correlated(self) -> float:
        """Return how many samples of what is left count once."""
        lengths = [1.0]
        for run, record in enumerate(self.problem.records):
            residual, _ = self.problem.residual(self.at, run)
            lags = round(MAX_CORRELATION_LAG_S / float(np.median(record.steps)))
            lengths += [correlation_length(e[ok], lags) for e, ok in zip(residual, record.ok, strict=True) if ok.any()]
        return max(lengths)
