"""The fast path of a fit without effects under white noise: normal equations computed in the linear kernel."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fieldsid.dynamics.assemble import pieces_for
from fieldsid.dynamics.linear_kernel import DIVERGED_RATE_RAD_S, LINEAR_PARAMETERS, accumulate_normal_equations
from fieldsid.fitting.problem.problem import Problem
from fieldsid.models.axis import NAMES
from fieldsid.models.model import Noise
from fieldsid.models.speed_law import over_reference
from fieldsid.noise.whiten import is_white
from fieldsid.numerics.arrays import FloatArray


@dataclass(frozen=True, slots=True)
class _Run:
    """One run's arrays: fin (2, n-1), measured (2, n), weight (2, n), and its longest step in s."""

    index: int
    steps: FloatArray
    longest: float
    fin: FloatArray
    measured: FloatArray
    weight: FloatArray


@dataclass(frozen=True, slots=True)
class LinearWhite:
    """A base problem under white noise, over its free parameters."""

    problem: Problem
    runs: tuple[_Run, ...]
    free: tuple[int, ...]

    def linear(self, x: FloatArray) -> tuple[float, FloatArray, FloatArray]:
        """Return whitened cost, normal matrix (F, F) and gradient (F,) at x."""
        count = len(self.free)
        total, normal, gradient = 0.0, np.zeros((count, count)), np.zeros(count)
        for run in self.runs:
            square, numbers = self._square(x, run)
            if not float(square[7, :2].sum()) < DIVERGED_RATE_RAD_S**2 * run.steps.size:
                return float("inf"), normal, gradient
            chain = self._chain(x, run, numbers)
            normal += chain.T @ square[1:7, 1:7] @ chain
            gradient += square[1:7, 0] @ chain
            total += float(square[0, 0])
        return total, normal, gradient

    def squares(self, x: FloatArray) -> FloatArray:
        """Return the unweighted sums of squares of angle and rate, (2,)."""
        return np.asarray(sum((self._square(x, run)[0][7, :2] for run in self.runs), start=np.zeros(2)))

    def _square(self, x: FloatArray, run: _Run) -> tuple[FloatArray, FloatArray]:
        base = self.problem.base_of(x, run.index)
        own = [float(x[i]) for i in self.problem.layout.nuisances_of(run.index)[:2]]
        numbers = np.array([base.damping, base.stiffness, base.authority, base.trim, *own])
        square = np.zeros((8, 7))
        pieces = pieces_for(run.longest, abs(base.damping), abs(base.stiffness) ** 0.5)
        accumulate_normal_equations(run.steps, run.fin, run.measured, run.weight, numbers, pieces, square)
        upper = square[:7]
        square[:7] = upper + np.tril(upper, -1).T
        return square, numbers

    def _chain(self, x: FloatArray, run: _Run, numbers: FloatArray) -> FloatArray:
        """Return the derivatives (6, F) of a run's six numbers by the free parameters."""
        layout, names = self.problem.layout, NAMES[self.problem.layout.axis]
        out = np.zeros((len(LINEAR_PARAMETERS), len(self.free)))
        share, ratio = self.problem.scales[run.index]
        exponent = x[layout.names.index("damping_exponent")] if "damping_exponent" in layout.names else 1.0
        authority = self.problem.authority_of(run.index)
        by_name = {
            names.damping: (0, share**exponent),
            "damping_exponent": (0, numbers[0] * np.log(share)),
            names.stiffness: (1, 1.0),
            authority: (2, ratio**2),
            names.trim: (3, 1.0),
            "angle0": (4, 1.0),
            "rate0": (5, 1.0),
        }
        for column, slot in enumerate(self.free):
            s = layout.parameters[slot]
            known = by_name.get(s.name) if s.run in (-1, run.index) else None
            if known is not None:
                out[known[0], column] = known[1]
        if layout.groups.trim_of_fin and x[layout.names.index(names.authority)] != 0.0:
            self._trim_of_fin(x, numbers, authority, out)
        return out

    def _trim_of_fin(self, x: FloatArray, numbers: FloatArray, authority: str, out: FloatArray) -> None:
        """Set the derivatives of a run's trim moment, C b / b_reference, by its three parameters."""
        names, layout = NAMES[self.problem.layout.axis], self.problem.layout
        trim, at_reference = (float(x[layout.names.index(n)]) for n in (names.trim, names.authority))
        over = over_reference(float(numbers[2]), at_reference)
        for column, slot in enumerate(self.free):
            name = layout.parameters[slot].name
            if name == names.trim:
                out[3, column] = over
            elif authority != names.authority and name == authority:
                out[3, column] = trim / at_reference * out[2, column]
            elif authority != names.authority and name == names.authority:
                out[3, column] = -trim / at_reference * over


def linear_white(problem: Problem, noise: Noise, free: Sequence[int]) -> LinearWhite | None:
    """Return the fast path of a problem, None where it has effects or the noise is coloured."""
    if problem.layout.effects or not is_white(noise):
        return None
    runs = []
    for index, r in enumerate(problem.records):
        path = r.commanded
        weight = r.ok / np.array([[noise.angle], [noise.rate]])
        runs.append(_Run(index, r.steps, r.longest, np.stack([path.start, path.end]), r.both, weight))
    return LinearWhite(problem, tuple(runs), tuple(free))
