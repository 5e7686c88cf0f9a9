"""What a fit must say first: parameters on a bound, correlated, not identifiable, of impossible sign, unstable."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from fieldsid.fitting.checks.authority_checks import authority_check
from fieldsid.fitting.problem.estimator import Solution
from fieldsid.fitting.problem.problem import Problem
from fieldsid.logs.run import Note
from fieldsid.models.axis import NAMES
from fieldsid.models.model import Noise
from fieldsid.rounding import in_unit

MAX_CORRELATION = 0.95
CLEAR_STD_ERRORS = 2.0
"""Standard errors above which a value differs significantly from zero."""


def parameter_checks(problem: Problem, solution: Solution, floor: Noise) -> tuple[Note, ...]:
    """Return the remarks of a solution, the gravest first."""
    return (
        *_stability(problem, solution),
        *_bounds(problem, solution),
        *_stiffness(problem, solution),
        *_authorities(problem, solution, floor),
        *_correlations(problem, solution),
    )


def _values(problem: Problem, solution: Solution) -> dict[str, float]:
    return dict(zip(problem.layout.names, solution.x[: problem.layout.shared].tolist(), strict=True))


def _errors(problem: Problem, solution: Solution) -> dict[str, float]:
    return dict(zip(problem.layout.names, np.sqrt(np.maximum(np.diag(solution.covariance), 0.0)).tolist(), strict=True))


def _stability(problem: Problem, solution: Solution) -> Iterator[Note]:
    names, v, s = NAMES[problem.layout.axis], _values(problem, solution), _errors(problem, solution)
    damping = v[names.damping]
    if damping < 0.0:
        held = "quadratic" in v and v["quadratic"] > 0.0
        tail = "held by quadratic damping" if held else "nothing in the model holds it"
        unsure = f"the model turns by itself, and its error of {s[names.damping]:.2g} leaves open whether the vehicle does"
        turns = "the vehicle turns by itself" if damping < -CLEAR_STD_ERRORS * s[names.damping] else unsure
        yield Note(
            "unstable",
            f"UNSTABLE: {problem.layout.shown(names.damping)} = {damping:.3g} 1/s is negative, {turns}; {tail}",
            {"value": damping, "limit": 0.0} | ({} if "quadratic" in v else {"hint": "--effects quadratic_damping"}),
        )
    if names.stiffness is not None and v[names.stiffness] < -CLEAR_STD_ERRORS * s[names.stiffness]:
        yield Note(
            "negative_righting",
            f"{names.stiffness} = {v[names.stiffness]:.3g} 1/s^2 is negative: no righting moment at this speed",
            {"value": v[names.stiffness], "limit": 0.0},
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
