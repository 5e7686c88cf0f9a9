"""One row of a turning prediction, the whole of it, and their plain records."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from fieldsid.logs.run import Note
from fieldsid.turning.measured import MeasuredTurn
from fieldsid.turning.surge import SurgeModel

SIDES: Mapping[str, float] = {"port": -1.0, "starboard": 1.0}


@dataclass(frozen=True, slots=True)
class TurnRow:
    """The turn at one entry speed to one side; lengths m, times s, rates rad/s, NaN where the method does not give it."""

    speed: float
    side: str
    radius: float
    interval95: tuple[float, float]
    steady_radius: float
    u_turn_radius: float
    u_turn_time: float
    yaw_rate_max: float
    method: str
    trust: str
    because: tuple[str, ...]
    settle_with: str
    turn_speed: float
    u_turn_time95: tuple[float, float]
    advance: float = float("nan")
    transfer: float = float("nan")
    tactical_diameter: float = float("nan")
    predicted: float = float("nan")
    predicted95: tuple[float, float] = (float("nan"), float("nan"))

    @property
    def extrapolated(self) -> bool:
        """Whether the turn lies beyond what the data reached."""
        return bool(self.because)

    def record(self) -> dict[str, Any]:
        """Return the row as `--json` prints it."""
        return {
            "speed_m_s": self.speed,
            "side": self.side,
            "radius_m": self.radius,
            "interval95": list(self.interval95),
            "steady_radius_m": self.steady_radius,
            "u_turn_radius_m": self.u_turn_radius,
            "u_turn_time_s": self.u_turn_time,
            "u_turn_time95_s": list(self.u_turn_time95),
            "yaw_rate_max_rad_s": self.yaw_rate_max,
            "turn_speed_m_s": self.turn_speed,
            "advance_m": self.advance,
            "transfer_m": self.transfer,
            "tactical_diameter_m": self.tactical_diameter,
            "predicted_m": self.predicted,
            "predicted95": list(self.predicted95),
            "method": self.method,
            "extrapolated": self.extrapolated,
            "trust": self.trust,
            "because": list(self.because),
            "settle_with": self.settle_with,
        }


@dataclass(frozen=True, slots=True)
class MeasuredRow:
    """A measured circle beside what the model predicts for the fin and the speed it was flown with."""

    turn: MeasuredTurn
    predicted: float
    predicted95: tuple[float, float]

    def record(self) -> dict[str, Any]:
        """Return the row as `--json` prints it."""
        circle = self.turn.circle
        return {
            "run": self.turn.run,
            "side": self.turn.side,
            "radius_m": circle.radius,
            "interval95": list(circle.interval95),
            "std_error_m": circle.radius_std_error,
            "predicted_m": self.predicted,
            "predicted95": list(self.predicted95),
            "difference_percent": 100.0 * (self.predicted / circle.radius - 1.0),
            "inside_band": self.predicted95[0] <= circle.radius <= self.predicted95[1],
            "fin_rad": self.turn.fin,
            "entry_speed_m_s": self.turn.entry_speed,
            "path_speed_m_s": self.turn.path_speed,
            "centre_m": list(circle.centre),
            "current_m_s": list(circle.current),
            "turned_rad": circle.turned,
            "settled_from_s": self.turn.start_s,
            "settled_to_s": self.turn.end_s,
        }


@dataclass(frozen=True, slots=True)
class TurnPrediction:
    """All rows, the measured circles, the surge model behind them, and remarks."""

    rows: tuple[TurnRow, ...]
    measured: tuple[MeasuredRow, ...]
    rudder_max: float
    surge: SurgeModel | None
    notes: tuple[Note, ...]

    def best(self, side: str) -> TurnRow | None:
        """Return the local minimum of the radius over speed that is farthest up, None where it only rises or falls."""
        rows = [r for r in self.rows if r.side == side]
        inner = [
            b for a, b, c in zip(rows[:-2], rows[1:-1], rows[2:], strict=True) if b.radius <= a.radius and b.radius < c.radius
        ]
        return inner[-1] if inner else None

    def record(self) -> dict[str, Any]:
        """Return the plain record that `--json` prints."""
        best = {side: self.best(side) for side in SIDES}
        surge = self.surge
        return {
            "rudder_max_rad": self.rudder_max,
            "rows": [r.record() for r in self.rows],
            "measured": [m.record() for m in self.measured],
            "minimum": {s: None if b is None else {"speed_m_s": b.speed, "radius_m": b.radius} for s, b in best.items()},
            "surge": None
            if surge is None
            else {
                "drag_per_m": surge.drag,
                "turn_loss_m": surge.turn_loss,
                "fin_loss_per_m": surge.fin_loss,
                "drift_per_rate_m": surge.drift_per_rate,
                "surge_measured": surge.surge_measured,
                "sway_measured": surge.sway_measured,
                "rms_m_s": surge.surge_rms,
            },
            "warnings": [{"code": n.code, "message": n.message} for n in self.notes],
        }
