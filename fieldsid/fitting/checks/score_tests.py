"""Score tests of a fit's residual for an ignored delay, a clock offset between fin and motion, and a hidden instability.

Each test is one Gauss-Newton step from the fit with one effect more, under the noise of the fit. Where it is significant, the
model is refitted with the effect, and the note reports the refit: the step shows whether there is an effect, but not how large.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from fieldsid.fitting.checks.damping_law import slope_at_rest
from fieldsid.fitting.covariance.reml import MAX_NOISE_SAMPLES, gls_step, linearise_runs
from fieldsid.fitting.initial.effect_screen import with_effect
from fieldsid.fitting.optimise.levenberg_marquardt import covariance, levenberg_marquardt
from fieldsid.fitting.optimise.residual_weights import white_weights
from fieldsid.fitting.problem.estimator import Solution
from fieldsid.fitting.problem.problem import Problem
from fieldsid.logs.run import Note
from fieldsid.models.axis import NAMES
from fieldsid.models.effect import effect_named
from fieldsid.noise.whiten import noise_vector
from fieldsid.rounding import TWO_SIDED_95

CLEAR_STD_ERRORS = 4.0
"""Standard errors from which an estimate is significant."""
STEP_AT_S, MAX_INITIAL_DELAY_S = 0.01, 0.2
"""The delay at which the Gauss-Newton step is taken, and the largest delay from which a refit starts: a larger step is less
reliable."""
MIN_BIAS = 0.005
"""Least relative change of the damping by an ignored delay that is reported: no plan asks for a higher accuracy."""
MIN_DRAG_LIKELIHOOD_GAIN = 10.0
"""Least gain of log likelihood by the refit with damping that grows with the rate."""
FIN_TIMING = ("delay", "servo_lag", "rate_limit", "backlash", "clock_offset")


def score_tests(problem: Problem, solution: Solution) -> tuple[Note, ...]:
    """Return the notes of the score tests on a fit's residual."""
    problem, known = problem.first(MAX_NOISE_SAMPLES // len(problem.records)), {e.name for e in problem.layout.effects}
    notes: list[Note] = []
    if not known & set(FIN_TIMING):
        notes += _timing(problem, solution)
    if not any(e.limits_rate for e in problem.layout.effects):
        notes += _instability(problem, solution)
    return tuple(notes)


def score_test(problem: Problem, solution: Solution, effect: str, name: str, at: float) -> tuple[float, float]:
    """Return the estimate of a coefficient of an absent effect after one Gauss-Newton step from `at`, and its error."""
    longer, x = with_effect(problem, solution.x, effect_named(effect), {name: at})
    step, inverse = gls_step(linearise_runs(longer, x), len(x), noise_vector(solution.noise))
    slot = longer.layout.names.index(name)
    return at + float(step[slot]), float(np.sqrt(inverse[slot, slot]))


@dataclass(frozen=True, slots=True)
class Lateness:
    """A refit with a delay `late` of the response to the fin (s, negative: early), and the damping with and without it."""

    late: float
    damping: float
    damping_error: float
    without: float

    @property
    def moves(self) -> float:
        """The absolute change of the damping where the delay is left out, 1/s."""
        return abs(self.without - self.damping)


def lateness(problem: Problem, solution: Solution, begin: float) -> Lateness | None:
    """Return the delay of the vehicle's response to the logged fin, from a refit that starts at `begin` in s, of either sign.

    A negative delay can only be a clock offset. None where the refit does not converge within the bounds of the coefficient, to a
    significant delay and a lower cost.
    """
    effect, name = ("delay", "delay") if begin > 0.0 else ("clock_offset", "offset")
    weights = solution.weights or white_weights(problem, solution.x)
    longer, x = with_effect(
        problem, solution.x, effect_named(effect), {name: float(np.clip(begin, -MAX_INITIAL_DELAY_S, MAX_INITIAL_DELAY_S))}
    )
    without, found = levenberg_marquardt(problem, solution.x, weights), levenberg_marquardt(longer, x, weights)
    slot, at = longer.layout.names.index(name), longer.layout.names.index(NAMES[problem.layout.axis].damping)
    error = np.sqrt(np.diag(covariance(found.normal)))
    late, bounds = float(found.x[slot]), longer.layout.parameters[slot]
    settled = found.converged and found.cost < without.cost and bounds.low < late < bounds.high
    if not settled or late * begin < 0.0 or abs(late) < CLEAR_STD_ERRORS * float(error[slot]):
        return None
    before = float(without.x[problem.layout.names.index(NAMES[problem.layout.axis].damping)])
    return Lateness(late, float(found.x[at]), float(error[at]), before)


def _timing(problem: Problem, solution: Solution) -> Iterator[Note]:
    value, error = score_test(problem, solution, "delay", "delay", STEP_AT_S)
    found = lateness(problem, solution, value) if np.isfinite(value) and abs(value) >= CLEAR_STD_ERRORS * error else None
    # a delay that changes the damping by less than its error is not reported, however significant it is
    if found is None or found.moves < max(TWO_SIDED_95 * found.damping_error, MIN_BIAS * abs(found.damping)):
        return
    name = NAMES[problem.layout.axis].damping
    known = abs(found.damping) > CLEAR_STD_ERRORS * found.damping_error
    bias = 100.0 * (found.without / found.damping - 1.0) if known else None
    moves = f"left out, it moves {problem.layout.shown(name)} from {found.damping:.3g} to {found.without:.3g} 1/s" + (
        f" ({bias:+.2g} %)" if known else ""
    )
    data = {
        "value": found.late, "limit": CLEAR_STD_ERRORS * error, "with": found.damping, "without": found.without,
        "bias_percent": bias,
    }  # fmt: skip
    if found.late > 0.0:
        is_measured = any(record.fin_is_measured for record in problem.records)
        fin, remedy = ("measured fin", "use") if is_measured else ("logged fin", "log the measured fin, or use")
        yield Note(
            "ignored_delay",
            f"the vehicle answers about {1e3 * found.late:.0f} ms after the {fin}: {moves}; "
            f"{remedy} `--effects delay` or `--effects servo_lag`",
            data,
        )
    else:
        yield Note(
            "negative_delay",
            f"the vehicle answers about {-1e3 * found.late:.0f} ms BEFORE the logged fin: no lag can be negative, it is a clock "
            f"that is off, a controller, or a hull that drifts (`sway_coupling`); {moves}; `sysid diagnose` tells them apart",
            data,
        )


def _instability(problem: Problem, solution: Solution) -> Iterator[Note]:
    """Yield the finding that the vehicle is unstable at rest and bounded by damping that grows with the rate."""
    value, error = score_test(problem, solution, "quadratic_damping", "quadratic", 0.05)
    if not value > CLEAR_STD_ERRORS * error:
        return
    found = slope_at_rest(problem, solution.x)
    if found is None or found.is_positive or found.gained <= MIN_DRAG_LIKELIHOOD_GAIN:
        return
    says = (
        f"with damping that goes with the power {found.power:.1f} of the rate the fit is far better (log likelihood "
        f"{found.gained:+.0f}) and {problem.layout.shown(NAMES[problem.layout.axis].damping)} = {found.value:.3g} "
        f"+/- {found.std_error:.2g} 1/s, the slope at rest of that curve fitted to turns,"
    )
    data = {"value": found.value, "std_error": found.std_error, "limit": 0.0, "gained": found.gained, "power": found.power}
    if found.is_negative:
        hides = "is negative: the vehicle turns by itself, the linear fit hides it; use `--effects quadratic_damping`"
        yield Note("hidden_instability", f"UNSTABLE: {says} {hides}", data)
    else:
        leaves = (
            "cannot be told from zero: whether the vehicle turns by itself is open; fly gentler turns, or hold each for longer"
        )
        yield Note("slope_at_rest", f"{says} {leaves}", data)
