"""Several fins for one plane: what rudder and elevator are of them, and what each of them is told.

rudder = to_rudder . fins and elevator = to_elevator . fins. The fins of a command are those of least length that make it, the
pseudo-inverse of the two rows (Fossen 2011, section 12.3); where one of them would go beyond its limit all are less by as much,
so that the command is smaller and no other one.
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
"""Share of one row beside the other below which the two are one: rudder and elevator cannot be told apart."""
ROUNDING = 1e-9


@dataclass(frozen=True, slots=True)
class PlaneFins:
    """The fins of one plane: name, what each is told for a command of one rad, its limit, and the unit of both."""

    names: Annotated[tuple[str, ...], Key("What each is called.")]
    shares: Annotated[tuple[float, ...], Key("What each is told for a command of one rad, in its unit.")]
    limits: Annotated[tuple[float, ...], Key("How far each goes, in its unit.")]
    unit: Annotated[str, Key("Their unit.")] = "rad"

    @property
    def reach(self) -> float:
        """The largest command in rad that all fins follow."""
        return min(limit / abs(share) for share, limit in zip(self.shares, self.limits, strict=True) if share != 0.0)

    def follows(self, command: float) -> bool:
        """Whether no fin goes beyond its limit for a command in rad."""
        return command <= self.reach * (1.0 + ROUNDING)

    def told(self, command: npt.ArrayLike) -> FloatArray:
        """Return what each fin is told (m, n) for commands (n,) in rad, none beyond its limit."""
        return _within(np.outer(self.shares, np.atleast_1d(command)), self.limits)

    def says(self, plane: str) -> list[str]:
        """Return how each fin goes with a plane's command, in words."""
        told = zip(self.names, self.shares, self.limits, strict=True)
        return [f"{name} = {share:.4g} {plane}, within +/-{limit:.4g} {self.unit}" for name, share, limit in told]


def plane_fins_of(body: Mapping[str, Any]) -> PlaneFins:
    """Return the fins that a record tells; raises KeyError, TypeError or ValueError where it is none."""
    shares, limits = (tuple(float(v) for v in body[key]) for key in ("shares", "limits"))
    names = tuple(str(n) for n in body["names"])
    if not len(names) == len(shares) == len(limits) or not np.isfinite([*shares, *limits]).all() or min(limits) <= 0.0:
        raise ValueError(f"fins {', '.join(names)}: a share and a limit above zero belong to each")
    return PlaneFins(names, shares, limits, str(body["unit"]))


@dataclass(frozen=True, slots=True)
class Fins:
    """The fins of a vehicle: names, the rows (m,) that rudder and elevator are of them, empty where none, and limits (m,)."""

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

    def told(self, rudder: npt.ArrayLike = 0.0, elevator: npt.ArrayLike = 0.0) -> FloatArray:
        """Return what each fin is told (m, n) for rudder and elevator (n,) in rad together, none beyond its limit."""
        both = np.broadcast_arrays(np.atleast_1d(rudder), np.atleast_1d(elevator))
        rows = [command for command, row in zip(both, (self.to_rudder, self.to_elevator), strict=True) if row]
        return _within(self._inverse @ np.stack(rows), self.limits)

    def made(self, told: npt.ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Return the rudder and elevator (n,) in rad that fins (m, n) make; zeros where the vehicle has none."""
        fins = np.atleast_2d(np.asarray(told, dtype=np.float64))
        rudder, elevator = (
            np.asarray(row) @ fins if row else np.zeros(fins.shape[1]) for row in (self.to_rudder, self.to_elevator)
        )
        return rudder, elevator

    @property
    def _inverse(self) -> FloatArray:
        return np.asarray(np.linalg.pinv(np.array([row for row in (self.to_rudder, self.to_elevator) if row])))

    def wrong(self) -> str | None:
        """Return what keeps these from being fins, in words; None where they are."""
        rows = {name: row for name, row in (("to_rudder", self.to_rudder), ("to_elevator", self.to_elevator)) if row}
        if len(set(self.names)) < len(self.names):
            return f"two of the names {', '.join(self.names)} are the same"
        if not rows:
            return "one of `to_rudder` and `to_elevator` is needed"
        for name, row in (*rows.items(), ("limits", self.limits)):
            if len(row) != len(self.names):
                return f"`{name}` has {len(row)} numbers for {len(self.names)} fins"
        flat = next((name for name, row in rows.items() if not any(row)), None)
        if flat is not None:
            return f"`{flat}` is zero for every fin"
        return "`to_rudder` and `to_elevator` are the same fins in the same way" if _are_parallel(*rows.values()) else None


def _are_parallel(*rows: Sequence[float]) -> bool:
    lengths = np.linalg.svd(np.array(rows), compute_uv=False)
    return bool(lengths[-1] < PARALLEL * lengths[0])


def _within(told: FloatArray, limits: Sequence[float]) -> FloatArray:
    """Return fins (m, n) made less at each instant (n) by what keeps all of them within their limits (m,)."""
    beyond = np.max(np.abs(told) / np.asarray(limits)[:, None], axis=0)
    return np.asarray(told / np.maximum(beyond, 1.0)) + 0.0
