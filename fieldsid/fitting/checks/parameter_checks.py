"""Checks of the parameters of a fit: on a bound, correlated, not identifiable, of impossible sign, unstable."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from fieldsid.fitting.checks.authority_checks import authority_check
from fieldsid.fitting.checks.damping_law import CLEAR_STD_ERRORS, slope_at_rest
from fieldsid.fitting.problem.estimator import Solution
from fieldsid.fitting.problem.problem import Problem
from fieldsid.logs.run import Note
from fieldsid.models.axis import NAMES
from fieldsid.models.model import Noise
from fieldsid.rounding import in_unit

MAX_CORRELATION = 0.95
CLEAR_GAIN = 10.0
"""Log likelihood by which a damping law must be worse than another to be disregarded."""


def parameter_checks(problem: Problem, solution: Solution, floor: Noise) -> tuple[Note, ...]:
    """Return the notes on the parameters of a solution, the most serious first."""
    return (
        *_stability(problem, solution),
        *_bounds(problem, solution),
        *_stiffness(problem, solution),
        *_trim(problem, solution),
        *_authorities(problem, solution, floor),
        *_correlations(problem, solution),
    )


def _values(problem: Problem, solution: Solution) -> dict[str, float]:
    return dict(zip(problem.layout.names, solution.x[: problem.layout.shared].tolist(), strict=True))


def _errors(problem: Problem, solution: Solution) -> dict[str, float]:
    return dict(zip(problem.layout.names, np.sqrt(np.maximum(np.diag(solution.covariance), 0.0)).tolist(), strict=True))


def _stability(problem: Problem, solution: Solution) -> Iterator[Note]:
    names, v, s = NAMES[problem.layout.axis], _values(problem, solution), _errors(problem, solution)
    if v[names.damping] < 0.0:
        yield _slope(problem, solution, v, s[names.damping])
    if names.stiffness is not None and v[names.stiffness] < -CLEAR_STD_ERRORS * s[names.stiffness]:
        yield Note(
            "negative_righting",
            f"{names.stiffness} = {v[names.stiffness]:.3g} 1/s^2 is negative: no righting moment at this speed",
            {"value": v[names.stiffness], "limit": 0.0},
        )


def _slope(problem: Problem, solution: Solution, values: Mapping[str, float], error: float) -> Note:
    """Return the note on a negative damping; the vehicle is unstable only where no damping law that fits as well denies it."""
    name = NAMES[problem.layout.axis].damping
    damping, shown = values[name], problem.layout.shown(name)
    data = {"value": damping, "limit": 0.0} | ({} if "quadratic" in values else {"hint": "--effects quadratic_damping"})
    if damping >= -CLEAR_STD_ERRORS * error:
        leaves = f"the model turns by itself, and its error of {error:.2g} leaves open whether the vehicle does"
        return Note("unstable", f"{shown} = {damping:.3g} 1/s is negative: {leaves}", data)
    limited = "rate_power" not in values and any(e.limits_rate for e in problem.layout.effects)
    free = slope_at_rest(problem, solution.x) if limited else None
    if free is not None and not free.is_negative and free.gained > -CLEAR_GAIN:
        says = (
            f"{shown} = {damping:.3g} 1/s, the slope at rest of a curve fitted to turns, is negative by this law of damping only:"
            f" with the power {free.power:.1f} of the rate (log likelihood {free.gained:+.0f}) it is {free.value:.2g} +/- "
            f"{free.std_error:.2g}, and the vehicle need not turn by itself; `sysid extend MODEL --add quadratic_damping` "
            "takes that power"
        )
        return Note("slope_at_rest", says, data | {"free": free.value, "std_error": free.std_error, "power": free.power})
    holding = [e.name.replace("_", " ") for e in problem.layout.effects if e.bounds_rate(values)]
    tail = f"held by {' and '.join(holding)}" if holding else "nothing in the model holds it"
    curve = ", the slope at rest of a curve fitted to turns," if limited or "rate_power" in values else ""
    return Note(
        "unstable", f"UNSTABLE: {shown} = {damping:.3g} 1/s{curve} is negative, the vehicle turns by itself; {tail}", data
    )


def _bounds(problem: Problem, solution: Solution) -> Iterator[Note]:
    means = {c.name: f" ({c.says})" for e in problem.layout.effects for c in e.shared if c.says}
    values = _values(problem, solution)
    for slot in problem.layout.on_bound(solution.x):
        said = f"{problem.layout.shown(slot.name)} = {values[slot.name]:.4g} {in_unit(slot.unit)}".rstrip()
        yield Note(
            "on_bound",
            f"{said}{means.get(slot.name, '')} is on its bound [{slot.low:g}, {slot.high:g}]: no error bar is right there",
            {"value": values[slot.name], "low": slot.low, "high": slot.high},
        )


def _stiffness(problem: Problem, solution: Solution) -> Iterator[Note]:
    names, v, s = NAMES[problem.layout.axis], _values(problem, solution), _errors(problem, solution)
    if names.stiffness is not None and abs(v[names.stiffness]) < CLEAR_STD_ERRORS * s[names.stiffness]:
        yield Note(
            "stiffness_not_identifiable",
            f"{names.stiffness} = {v[names.stiffness]:.2g} +/- {s[names.stiffness]:.2g} 1/s^2 "
            "cannot be told from zero in this maneuver",
            {"value": v[names.stiffness], "std_error": s[names.stiffness], "hint": "hold the fin longer, or fly slower"},
        )


def _trim(problem: Problem, solution: Solution) -> Iterator[Note]:
    """Yield the note that a trim beside a righting moment is unknown in runs of which none has an angle."""
    names, v = NAMES[problem.layout.axis], _values(problem, solution)
    if names.stiffness is not None and not any(r.angle_ok.any() for r in problem.records):
        yield Note(
            "trim_not_identifiable",
            f"{names.trim} = {v[names.trim]:.2g} rad/s^2 is that about an angle of our choice: a rate alone shows "
            f"{names.trim} - {names.stiffness} {problem.layout.axis.value} at the start, and no angle was logged",
            {"value": v[names.trim], "hint": f"map {names.angle}"},
        )


def _authorities(problem: Problem, solution: Solution, floor: Noise) -> Iterator[Note]:
    """Yield the note on every speed group's authority that is not significant."""
    for name in dict.fromkeys(problem.authority_of(run) for run in range(len(problem.records))):
        note = authority_check(problem, solution, floor, problem.layout.names.index(name))
        if note is not None:
            yield note


def _correlations(problem: Problem, solution: Solution) -> Iterator[Note]:
    names, shown = problem.layout.names, [problem.layout.shown(n) for n in problem.layout.names]
    sigma = np.sqrt(np.maximum(np.diag(solution.covariance), 0.0))
    for i in range(len(names)):
        for j in range(i):
            if sigma[i] == 0.0 or sigma[j] == 0.0:
                continue
            rho = float(solution.covariance[i, j] / (sigma[i] * sigma[j]))
            if abs(rho) > MAX_CORRELATION:
                yield Note(
                    "correlated",
                    f"{shown[j]} and {shown[i]} cannot be told apart (correlation {rho:+.3f}, limit {MAX_CORRELATION})",
                    {"parameters": [names[j], names[i]], "correlation": rho, "limit": MAX_CORRELATION},
                )
