"""The contract of a maneuver: named, bounded parameters, a duration, and either a fin command or a rule on the motion.

Fin angles are relative to the trim fin, angles to the value at the start, times to the start of the excitation. NaN in a command
or from a rule means that the autopilot steers: between two pulses, and from the end of a rule on.
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
"""command(parameters, time (n,) s) -> fin (n,) rad, NaN where the autopilot steers."""
Rule = Callable[[FloatArray, float, FloatArray, FloatArray, FloatArray, FloatArray], None]
"""rule(values of the parameters in their order, time s, angle (m,), rate (m,), memory (m, k), fin (m,)): fills the fins of m
vehicles, NaN where the autopilot steers, and updates their memory; a function of `numerics.jit`."""


@dataclass(frozen=True, slots=True)
class Parameter:
    """One number of a maneuver: unit, closed bounds, default; `whole` marks counts, `tuned` numbers that a planner may change."""

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
    """One excitation. `duration(parameters)` is its length in s, for a rule the longest possible one.

    It has either a `command` or a `rule`, which starts with `memory(parameters)`. Every maneuver has a parameter `amplitude`, its
    largest fin angle.
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
        """Return values in the order of the parameters, for a rule."""
        return np.array([float(values[p.name]) for p in self.parameters])

    @property
    def defaults(self) -> dict[str, float]:
        """Return every parameter at its default."""
        return {p.name: p.default for p in self.parameters}

    def checked(self, given: Parameters) -> dict[str, float]:
        """Return all parameters, defaults replaced by `given`; raises UsageError for an unknown name or a value out of bounds."""
        known = {p.name: p for p in self.parameters}
        for name, value in given.items():
            if name not in known:
                raise UsageError(
                    f"maneuver `{self.name}` has no parameter {name!r}",
                    found=", ".join(f"{p.name} [{p.unit}]" if p.unit else p.name for p in self.parameters),
                    hint=near(name, list(known)),
                )
            self._check_bounds(known[name], float(value))
        return self.defaults | {k: float(v) for k, v in given.items()}

    def _check_bounds(self, parameter: Parameter, value: float) -> None:
        is_countable = not parameter.whole or value == np.round(value)
        if np.isfinite(value) and parameter.low <= value <= parameter.high and is_countable:
            return
        kind = "a whole number" if parameter.whole else "a number"
        raise UsageError(
            f"maneuver `{self.name}`: `{parameter.name}` must be {kind} in {parameter.low:g} .. {parameter.high:g}"
            + (f" {parameter.unit}" if parameter.unit else ""),
            found=f"{value:g}",
            hint=f"`{self.name}:{parameter.name}={parameter.default:g}` is the default",
        )


AMPLITUDE_HIGH = 0.7
"""Largest fin angle of a maneuver, rad: beyond about 40 degrees every fin stalls."""


def amplitude(default: float, says: str = "largest fin angle about trim") -> Parameter:
    """Return the parameter `amplitude`, which every maneuver has."""
    return Parameter("amplitude", "rad", 0.001, AMPLITUDE_HIGH, default, says)


def side(p: Parameters) -> float:
    """Return 1, or -1 for a maneuver that is mirrored."""
    return 1.0 - 2.0 * p["mirrored"]


def levels(time: FloatArray, widths: FloatArray, fins: FloatArray) -> FloatArray:
    """Return a staircase (n,): `fins[i]` rad for `widths[i]` s in turn, 0 before and NaN after."""
    edges = np.concatenate([[0.0], np.cumsum(widths)])
    index = np.searchsorted(edges - 1e-9, time, side="right") - 1
    table = np.concatenate([fins, [np.nan]])
    return np.where(index < 0, 0.0, table[np.clip(index, 0, fins.size)])
