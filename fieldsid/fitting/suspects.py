"""What a fit's residual says of the path from the log to the fin: an ignored delay, a clock that is off, a hidden instability.

Each is one Gauss-Newton step from the fit with one effect more, under the noise of the fit: a score test. A hidden
instability is confirmed by a refit.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from fieldsid.errors import FieldsidError
from fieldsid.fitting.descent import covariance, descend
from fieldsid.fitting.method import Solution
from fieldsid.fitting.problem import Problem
from fieldsid.fitting.restricted import ENOUGH, generalised, lines_of
from fieldsid.fitting.starts import grown
from fieldsid.fitting.weights import misfit, white_weights
from fieldsid.fitting.whitening import noise_vector
from fieldsid.logs.run import FloatArray, Note
from fieldsid.models.axis import NAMES
from fieldsid.models.effect import effect_named

CLEAR = 4.0
"""Standard errors from which an estimate counts."""
LEAST_DELAY_S = 0.02
WORTH = 10.0
"""Log likelihood the refit with quadratic damping must gain."""
FIN_TIMING = ("delay", "servo_lag", "rate_limit", "backlash", "clock_offset")
HOLDS = ("quadratic_damping", "crossflow_drag")


def suspects(problem: Problem, solution: Solution) -> tuple[Note, ...]:
    """Return the suspicions a fit's residual raises."""
    problem, known = problem.first(ENOUGH // len(problem.records)), {e.name for e in problem.layout.effects}
    notes: list[Note] = []
    if not known & set(FIN_TIMING):
        notes += _timing(problem, solution)
    if not known & set(HOLDS):
        notes += _instability(problem, solution)
    return tuple(notes)


def score(problem: Problem, solution: Solution, effect: str, name: str, at: float) -> tuple[float, float, FloatArray]:
    """Return what one step gives for a coefficient of an effect that is not in the fit, its error, and all values (N,)."""
    longer, x = grown(problem, solution.x, effect_named(effect), {name: at})
    step, inverse = generalised(lines_of(longer, x), len(x), noise_vector(solution.noise))
    slot = longer.layout.names.index(name)
    return at + float(step[slot]), float(np.sqrt(inverse[slot, slot])), x + step


def _timing(problem: Problem, solution: Solution) -> Iterator[Note]:
    value, error, with_it = score(problem, solution, "delay", "delay", 0.5 * LEAST_DELAY_S)
    if not np.isfinite(value) or abs(value) < max(CLEAR * error, LEAST_DELAY_S):
        return
    name = NAMES[problem.layout.axis].damping
    at = problem.layout.names.index(name)
    step, _ = generalised(lines_of(problem, solution.x), len(solution.x), noise_vector(solution.noise))
    without = float(solution.x[at] + step[at])
    bias = 100.0 * (without - float(with_it[at])) / max(abs(float(with_it[at])), 1e-9)
    data = {"value": value, "std_error": error, "limit": max(CLEAR * error, LEAST_DELAY_S), "bias_percent": bias}
    if value > 0.0:
        yield Note(
            "ignored_delay",
            f"the vehicle answers about {1e3 * value:.0f} +/- {1e3 * error:.0f} ms after the logged fin (limit "
            f"{1e3 * LEAST_DELAY_S:.0f} ms): left out, it moves {name} by about {bias:+.0f} %; log the measured fin, or "
            "use `--effects delay` or `--effects servo_lag`",
            data,
        )
    else:
        yield Note(
            "negative_delay",
            f"the vehicle answers about {-1e3 * value:.0f} +/- {1e3 * error:.0f} ms BEFORE the logged fin: no lag can be "
            "negative, it is a clock that is off, or a controller; use `--effects clock_offset`, or stamp both by one clock",
            data,
        )


def _instability(problem: Problem, solution: Solution) -> Iterator[Note]:
    """Yield the finding that quadratic damping holds a vehicle whose linear yaw is unstable."""
    value, error, _ = score(problem, solution, "quadratic_damping", "quadratic", 0.05)
    if not value > CLEAR * error:
        return
    longer, x = grown(problem, solution.x, effect_named("quadratic_damping"), {"quadratic": 0.05})
    try:
        found = descend(longer, x, white_weights(problem, solution.x), rounds=15, tolerance=1e-5)
    except FieldsidError:
        return
    name = NAMES[problem.layout.axis].damping
    slot = longer.layout.names.index(name)
    damping = float(found.x[slot])
    spread = float(np.sqrt(covariance(found.normal)[slot, slot]))
    gained = misfit(problem, solution.x) - misfit(longer, found.x)
    if damping < -2.0 * spread and gained > WORTH:
        yield Note(
            "hidden_instability",
            f"UNSTABLE: with quadratic damping the fit is far better (log likelihood {gained:+.0f}) and {name} = {damping:.3g} "
            f"+/- {spread:.2g} 1/s is negative: the vehicle turns by itself, the linear fit hides it; "
            "use `--effects quadratic_damping`",
            {"value": damping, "std_error": spread, "limit": 0.0, "gained": gained},
        )
