"""Control allocation: the rudder and elevator angles that several fins make, and the fin angles for a rudder and an elevator.

rudder = to_rudder . fins and elevator = to_elevator . fins. The fins for a command are the least-squares allocation, the
pseudo-inverse of the two rows (Fossen 2011, section 12.3). Where one fin would exceed its limit all fins are scaled down by the
same factor, so that rudder and elevator keep their ratio.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
import numpy.typing as npt

from fieldsid.numerics.arrays import FloatArray
from fieldsid.records.keys import Key

PARALLEL = 1e-6
"""Ratio of the rows' singular values below which the rows are parallel: rudder and elevator would be the same fin motion."""
ROUNDING = 1e-9


@dataclass(frozen=True, slots=True)
class PlaneFins:
    """The fins of one plane: their names, the angle of each for a command of one rad, its limit, and the unit of both."""

    names: Annotated[tuple[str, ...], Key("What each is called.")]
    shares: Annotated[tuple[float, ...], Key("What each is told for a command of one rad, in its unit.")]
    limits: Annotated[tuple[float, ...], Key("How far each goes, in its unit.")]
    unit: Annotated[str, Key("Their unit.")] = "rad"

    @property
    def reach(self) -> float:
        """The largest command in rad that exceeds no fin's limit."""
        return min(limit / abs(share) for share, limit in zip(self.shares, self.limits, strict=True) if share != 0.0)

    def follows(self, command: float) -> bool:
        """Whether a command in rad exceeds no fin's limit."""
        return command <= self.reach * (1.0 + ROUNDING)

    def fin_commands(self, command: npt.ArrayLike) -> FloatArray:
        """Return the commands of the fins (m, n) for commands of the plane (n,) in rad, none beyond its limit."""
        return _scaled_to_limits(np.outer(self.shares, np.atleast_1d(command)), self.limits)

    def says(self, plane: str) -> list[str]:
        """Return the equation and the limit of each fin in words; `plane` names the command."""
        rows = zip(self.names, self.shares, self.limits, strict=True)
        return [f"{name} = {share:.4g} {plane}, within +/-{limit:.4g} {self.unit}" for name, share, limit in rows]


def plane_fins_of(body: Mapping[str, Any]) -> PlaneFins:
    """Return the fins of a record's body; raises KeyError, TypeError or ValueError where it does not describe fins."""
    shares, limits = (tuple(float(v) for v in body[key]) for key in ("shares", "limits"))
    names = tuple(str(n) for n in body["names"])
    if not len(names) == len(shares) == len(limits) or not np.isfinite([*shares, *limits]).all() or min(limits) <= 0.0:
        raise ValueError(f"fins {', '.join(names)}: a share and a limit above zero belong to each")
    return PlaneFins(names, shares, limits, str(body["unit"]))


@dataclass(frozen=True, slots=True)
class Fins:
    """The fins of a vehicle: names, the rows (m,) that give rudder and elevator from them (empty if none), and limits (m,)."""

    names: tuple[str, ...]
    to_rudder: tuple[float, ...]
    to_elevator: tuple[float, ...]
    limits: tuple[float, ...]
    unit: str = "rad"

    def of(self, axis: str) -> PlaneFins | None:
        """Return the fins of an axis (`yaw` or `pitch`), None where they do not move it."""
        rows = {"yaw": self.to_rudder, "pitch": self.to_elevator}
        if not rows[axis]:
            return None
        place = [name for name, row in rows.items() if row].index(axis)
        shares = np.round(self._inverse[:, place], 12) + 0.0
        return PlaneFins(self.names, tuple(shares.tolist()), self.limits, self.unit)

    def fin_commands(self, rudder: npt.ArrayLike = 0.0, elevator: npt.ArrayLike = 0.0) -> FloatArray:
        """Return the commands of the fins (m, n) for rudder and elevator (n,) in rad at once, none beyond its limit."""
        both = np.broadcast_arrays(np.atleast_1d(rudder), np.atleast_1d(elevator))
        rows = [command for command, row in zip(both, (self.to_rudder, self.to_elevator), strict=True) if row]
        return _scaled_to_limits(self._inverse @ np.stack(rows), self.limits)

    def rudder_and_elevator(self, fin_commands: npt.ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Return the rudder and elevator (n,) in rad of fin commands (m, n); zeros for a plane without fins."""
        fins = np.atleast_2d(np.asarray(fin_commands, dtype=np.float64))
        rudder, elevator = (
            np.asarray(row) @ fins if row else np.zeros(fins.shape[1]) for row in (self.to_rudder, self.to_elevator)
        )
        return rudder, elevator

    @property
    def _inverse(self) -> FloatArray:
        return np.asarray(np.linalg.pinv(np.array([row for row in (self.to_rudder, self.to_elevator) if row])))

    def inconsistency(self) -> str | None:
        """Return what is inconsistent in this description of fins, in words; None where nothing is."""
        rows = {name: row for name, row in (("to_rudder", self.to_rudder), ("to_elevator", self.to_elevator)) if row}
        if len(set(self.names)) < len(self.names):
            return f"two of the names {', '.join(self.names)} are the same"
        if not rows:
            return "one of `to_rudder` and `to_elevator` is needed"
        for name, row in (*rows.items(), ("limits", self.limits)):
            if len(row) != len(self.names):
                return f"`{name}` has {len(row)} numbers for {len(self.names)} fins"
        zero_row = next((name for name, row in rows.items() if not any(row)), None)
        if zero_row is not None:
            return f"`{zero_row}` is zero for every fin"
        return "`to_rudder` and `to_elevator` are the same fins in the same way" if _are_parallel(*rows.values()) else None


def _are_parallel(*rows: Sequence[float]) -> bool:
    singular_values = np.linalg.svd(np.array(rows), compute_uv=False)
    return bool(singular_values[-1] < PARALLEL * singular_values[0])


def _scaled_to_limits(fin_commands: FloatArray, limits: Sequence[float]) -> FloatArray:
    """Return fin commands (m, n), at each instant divided by one factor that keeps all of them within their limits (m,)."""
    excess = np.max(np.abs(fin_commands) / np.asarray(limits)[:, None], axis=0)
    return np.asarray(fin_commands / np.maximum(excess, 1.0)) + 0.0
