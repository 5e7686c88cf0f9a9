"""The contract of an estimator: a name, a sentence, and a function from a problem to a solution."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np

from fieldsid.display import Brief
from fieldsid.fitting.problem.problem import Problem
from fieldsid.logs.run import Note
from fieldsid.models.effect import is_on_bound
from fieldsid.models.model import Noise
from fieldsid.numerics.arrays import FloatArray


@dataclass(frozen=True, slots=True, repr=False)
class History(Brief):
    """Parameters over time of a recursive estimator: time (m,) s, values and std_errors (m, p), settle time of each."""

    time: FloatArray
    names: tuple[str, ...]
    values: FloatArray
    std_errors: FloatArray
    settled_s: Mapping[str, float]


@dataclass(frozen=True, slots=True)
class Solution:
    """The result of an estimator: vector (N,) of the layout, covariance (S, S) of the shared parameters, noise, notes.

    A shared parameter that was not estimated has zero variance. `nuisances_fitted` is false where the initial states of the runs
    are still at their start values. `weights` is the noise under which x minimises the weighted squares. It is None where that is
    the white noise of the residuals at x, or where x minimises no such sum.
    """

    x: FloatArray
    covariance: FloatArray
    noise: Noise
    method: str
    notes: tuple[Note, ...] = ()
    nuisances_fitted: bool = True
    history: History | None = None
    weights: Noise | None = None


@dataclass(frozen=True, slots=True)
class Options:
    """The options of an estimator: filter bandwidth lambda (rad/s), forgetting factor of the recursive method."""

    bandwidth: float = 4.0
    forgetting: float = 1.0


@dataclass(frozen=True, slots=True)
class Estimator:
    """One method; `takes_effects` says whether it can estimate effects, `joint` whether it takes several runs at once.

    `after` does the same as `solve` but starts from a given output-error solution, for a method that starts from one.
    """

    name: str
    says: str
    source: str
    solve: Callable[[Problem, Options], Solution]
    takes_effects: bool = True
    joint: bool = True
    after: Callable[[Problem, Solution], Solution] | None = None
    info: Mapping[str, str] = field(default_factory=dict)

    def refined(self, problem: Problem, output_error: Solution, options: Options) -> Solution:
        """Return the solution of this method, from the given output-error solution where it starts from one."""
        return self.solve(problem, options) if self.after is None else self.after(problem, output_error)


def shared_covariance(problem: Problem, x: FloatArray, full: FloatArray, free: tuple[int, ...]) -> FloatArray:
    """Return the block (S, S) of a covariance (F, F) over free parameters that belongs to the shared parameters of x (N,).

    A parameter on a bound, of which the runs say less than its bounds do, counts as held there: its variance is zero.
    """
    count, parameters = problem.layout.shared, problem.layout.parameters
    out = np.zeros((count, count))
    keep = [i for i, slot in enumerate(free) if slot < count]
    where = [free[i] for i in keep]
    out[np.ix_(where, where)] = full[np.ix_(keep, keep)]
    # a model even in a parameter has no derivative at zero, and its inverse information says a variance of 1e70 there
    for slot in where:
        parameter = parameters[slot]
        low, high = parameter.low, parameter.high
        if is_on_bound(float(x[slot]), low, high) and out[slot, slot] > (high - low) ** 2:
            out[slot], out[:, slot] = 0.0, 0.0
    return out
