"""The contract of a maneuver: named, bounded parameters, a duration, and either a fin command or a rule that sees the motion.

Fin angles are about the trim fin, angles about the value at the start, times from the start of the excitation. NaN in a
command, or from a rule, means that the autopilot has the fin: between two pulses, and for good once a rule has finished.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from fieldsid.errors import UsageError
from fieldsid.numerics.arrays import FloatArray
from fieldsid.registry import near

Parameters = Mapping[str, float]
Command = Callable[[Parameters, FloatArray], FloatArray]
"""command(parameters, time (n,) s) -> fin (n,) rad, NaN where the autopilot has it."""
Rule = Callable[[FloatArray, float, FloatArray, FloatArray, FloatArray, FloatArray], None]
"""rule(values of the parameters in their order, time s, angle (m,), rate (m,), memory (m, k), fin (m,)): fills the fins of m
vehicles, NaN where the autopilot has one, and changes their memory; a function of `numerics.jit`."""


@dataclass(frozen=True, slots=True)
class Parameter:
    """One number of a maneuver: unit, closed bounds, default; `whole` marks counts, `tuned` what a planner may move."""

    name: str
    unit: str
    low: float
    high: float
    default: float
    says: str = ""
    whole: bool = False
    tuned: bool = True


@dataclass(frozen=True, slots=True)
class Maneuver:
    """One excitation. `duration(parameters)` is its length in s, for a rule the longest time it may take.

    Exactly one of `command` and `rule` is given; a rule starts from `memory(parameters)`. Every maneuver has a
    parameter `amplitude`, the largest fin angle it asks for.
    """

    name: str
    says: str
    parameters: tuple[Parameter, ...]
    duration: Callable[[Parameters], float]
    source: str
    command: Command | None = None
    rule: Rule | None = None
    memory: Callable[[Parameters], tuple[float, ...]] = lambda _: ()

    def vector(self, values: Parameters) -> FloatArray:
        """Return values in the order of the parameters, as a rule takes them."""
        return np.array([float(values[p.name]) for p in self.parameters])

    @property
    def defaults(self) -> dict[str, float]:
        """Return every parameter at its default."""
        return {p.name: p.default for p in self.parameters}

    def checked(self, given: Parameters) -> dict[str, float]:
        """Return the defaults with `given` on top; raises UsageError for an unknown name or a value out of bounds."""
        known = {p.name: p for p in self.parameters}
        for name, value in given.items():
            if name not in known:
                raise UsageError(
                    f"maneuver `{self.name}` has no parameter {name!r}",
                    found=", ".join(f"{p.name} [{p.unit}]" if p.unit else p.name for p in self.parameters),
                    hint=near(name, list(known)),
                )
            self._in_bounds(known[name], float(value))
        return self.defaults | {k: float(v) for k, v in given.items()}

    def _in_bounds(self, parameter: Parameter, value: float) -> None:
        whole = not parameter.whole or value == np.round(value)
        if np.isfinite(value) and parameter.low <= value <= parameter.high and whole:
            return
        kind = "a whole number" if parameter.whole else "a number"
        raise UsageError(
            f"maneuver `{self.name}`: `{parameter.name}` must be {kind} in {parameter.low:g} .. {parameter.high:g}"
            + (f" {parameter.unit}" if parameter.unit else ""),
            found=f"{value:g}",
            hint=f"`{self.name}:{parameter.name}={parameter.default:g}` is the default",
        )


AMPLITUDE_HIGH = 0.7
"""Largest fin angle a maneuver may ask for, rad: beyond about 40 degrees no fin lifts."""


def amplitude(default: float, says: str = "largest fin angle about trim") -> Parameter:
    """Return the parameter every maneuver has."""
    return Parameter("amplitude", "rad", 0.001, AMPLITUDE_HIGH, default, says)


def side(p: Parameters) -> float:
    """Return 1, or -1 for a maneuver that is mirrored."""
    return 1.0 - 2.0 * p["mirrored"]


def levels(time: FloatArray, widths: FloatArray, fins: FloatArray) -> FloatArray:
    """Return a staircase: `fins[i]` rad for `widths[i]` s one after the other, 0 before and NaN after, (n,)."""
    edges = np.concatenate([[0.0], np.cumsum(widths)])
    index = np.searchsorted(edges - 1e-9, time, side="right") - 1
    table = np.concatenate([fins, [np.nan]])
    return np.where(index < 0, 0.0, table[np.clip(index, 0, fins.size)])
