"""What a fit must say first: parameters on a bound, correlated, not identifiable, of impossible sign, unstable."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from fieldsid.fitting.method import Solution
from fieldsid.fitting.problem import Problem
from fieldsid.logs.run import Note
from fieldsid.models.axis import NAMES, Axis
from fieldsid.models.model import Noise

HIGHEST_CORRELATION = 0.95
WEAKEST_AUTHORITY = 3.0


def remarks(problem: Problem, solution: Solution, _floor: Noise) -> tuple[Note, ...]:
    """Return the remarks of a solution, the gravest first."""
    return (
        *_stability(problem, solution),
        *_bounds(problem, solution),
        *_identifiability(problem, solution),
        *_correlations(problem, solution),
    )


def _values(problem: Problem, solution: Solution) -> dict[str, float]:
    return dict(zip(problem.layout.names, solution.x[: problem.layout.shared].tolist(), strict=True))


def _errors(problem: Problem, solution: Solution) -> dict[str, float]:
    return dict(zip(problem.layout.names, np.sqrt(np.maximum(np.diag(solution.covariance), 0.0)).tolist(), strict=True))


def _stability(problem: Problem, solution: Solution) -> Iterator[Note]:
    names, v = NAMES[problem.layout.axis], _values(problem, solution)
    damping = v[names.damping]
    if damping < 0.0:
        held = "quadratic" in v and v["quadratic"] > 0.0
        tail = "held by quadratic damping" if held else "nothing in the model holds it"
        yield Note(
            "unstable",
            f"UNSTABLE: {names.damping} = {damping:.3g} 1/s is negative, the vehicle turns by itself; {tail}",
            {"value": damping, "limit": 0.0, "hint": "--effects quadratic_damping"},
        )
    if names.stiffness is not None and v[names.stiffness] < 0.0 and problem.layout.axis is Axis.PITCH:
        yield Note(
            "negative_righting",
            f"{names.stiffness} = {v[names.stiffness]:.3g} 1/s^2 is negative: no righting moment at this speed",
            {"value": v[names.stiffness], "limit": 0.0},
        )


def _bounds(problem: Problem, solution: Solution) -> Iterator[Note]:
    for i in range(problem.layout.shared):
        slot = problem.layout.slots[i]
        span = slot.high - slot.low
        if min(solution.x[i] - slot.low, slot.high - solution.x[i]) <= 1e-6 * span:
            yield Note(
                "on_bound",
                f"{slot.name} = {solution.x[i]:.4g} {slot.unit} is on its bound [{slot.low:g}, {slot.high:g}]: "
                "no error bar is right there",
                {"value": float(solution.x[i]), "low": slot.low, "high": slot.high},
            )


def _identifiability(problem: Problem, solution: Solution) -> Iterator[Note]:
    names, v, s = NAMES[problem.layout.axis], _values(problem, solution), _errors(problem, solution)
    if names.stiffness is not None and abs(v[names.stiffness]) < 2.0 * s[names.stiffness]:
        yield Note(
            "stiffness_not_identifiable",
            f"{names.stiffness} = {v[names.stiffness]:.2g} +/- {s[names.stiffness]:.2g} 1/s^2 "
            "cannot be told from zero in this maneuver",
            {"value": v[names.stiffness], "std_error": s[names.stiffness], "hint": "hold the fin longer, or fly slower"},
        )
    b = v[names.authority]
    if s[names.authority] > 0.0 and abs(b) < WEAKEST_AUTHORITY * s[names.authority]:
        yield Note(
            "not_excited",
            f"{names.authority} = {b:.2g} +/- {s[names.authority]:.2g} 1/s^2 cannot be told from zero: "
            "the fin hardly moved the vehicle",
            {
                "value": b,
                "std_error": s[names.authority],
                "limit": WEAKEST_AUTHORITY,
                "hint": "fly longer pulses, or `sysid diagnose`",
            },
        )


def _correlations(problem: Problem, solution: Solution) -> Iterator[Note]:
    names = problem.layout.names
    sigma = np.sqrt(np.maximum(np.diag(solution.covariance), 0.0))
    for i in range(len(names)):
        for j in range(i):
            if sigma[i] == 0.0 or sigma[j] == 0.0:
                continue
            rho = float(solution.covariance[i, j] / (sigma[i] * sigma[j]))
            if abs(rho) > HIGHEST_CORRELATION:
                yield Note(
                    "correlated",
                    f"{names[j]} and {names[i]} cannot be told apart (correlation {rho:+.3f}, limit {HIGHEST_CORRELATION})",
                    {"parameters": [names[j], names[i]], "correlation": rho, "limit": HIGHEST_CORRELATION},
                )
