"""One row of a turning prediction, the whole of it, and their plain records."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import isnan
from typing import Any

from fieldsid.display import Displayed, Plotted
from fieldsid.logs.run import Note
from fieldsid.turning.known_radius import is_band_only
from fieldsid.turning.measured.measured_turn import MeasuredTurn
from fieldsid.turning.steady.speed_loss import SurgeModel

SIDES: Mapping[str, float] = {"port": -1.0, "starboard": 1.0}
EQUAL_TURN_SHARE = 0.05
"""Share by which speed and rudder of two turns may differ and still be one."""
BY_METHOD: Mapping[str, str] = {
    "maneuvering": "one vehicle fitted to all runs",
    "simulated": "each speed's own model flown",
    "u_turn": "u-turn formula",
    "steady": "formula of the settled circle",
    "measured": "measured",
}
"""How the turns of a method are found, in words."""
MAX_SPEEDS_LISTED = 4
"""Speeds that are listed one by one."""
HOW = "one and a half circles, x_m and y_m logged"


@dataclass(frozen=True, slots=True, repr=False)
class TurnRow(Displayed):
    """The turn at one entry speed to one side; lengths m, times s, rates rad/s, NaN where the method does not give it.

    `radius` is the median of what is believed, `of_model` that of the identified yaw model alone.
    """

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
    of_model: float = float("nan")

    @property
    def extrapolated(self) -> bool:
        """Whether the turn lies beyond what the data reached."""
        return bool(self.because)

    @property
    def band_only(self) -> bool:
        """Whether the data tell the band of the radius, and no number in it."""
        return is_band_only(self.radius, self.interval95)

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
            "model_radius_m": self.of_model,
            "band_only": self.band_only,
            "method": self.method,
            "extrapolated": self.extrapolated,
            "trust": self.trust,
            "because": list(self.because),
            "settle_with": self.settle_with,
        }


@dataclass(frozen=True, slots=True, repr=False)
class MeasuredRow(Displayed):
    """A measured circle with the model's prediction for the fin and the speed it was flown with."""

    turn: MeasuredTurn
    predicted: float
    predicted95: tuple[float, float]

    def entered(self, speed: float, side: str) -> bool:
        """Whether the circle was turned to a side from about a speed in m/s."""
        return self.turn.side == side and abs(self.turn.entry_speed - speed) <= EQUAL_TURN_SHARE * speed

    def held(self, rudder: float) -> bool:
        """Whether it was turned with about a rudder in rad."""
        return abs(abs(self.turn.fin) - rudder) <= EQUAL_TURN_SHARE * rudder

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


@dataclass(frozen=True, slots=True, repr=False)
class TurnPrediction(Plotted):
    """All rows, the measured circles, the surge model behind them, and remarks."""

    rows: tuple[TurnRow, ...]
    measured: tuple[MeasuredRow, ...]
    rudder_max: float
    surge: SurgeModel | None
    notes: tuple[Note, ...]

    @property
    def settling(self) -> tuple[str, ...]:
        """What would settle the rows that are extrapolated: circles that were given, asked for otherwise, and a flight."""
        rows = [r for r in self.rows if r.extrapolated]
        if not rows:
            return ()
        flights = [f"to {side} at {_speeds([r.speed for r in rows if r.side == side])}" for side in SIDES if _to(rows, side)]
        return (*self._asked_otherwise(rows), f"turning_circle {', '.join(flights)} with {self.rudder_max:.3g} rad: {HOW}")

    def _asked_otherwise(self, rows: Sequence[TurnRow]) -> Iterator[str]:
        """Yield why circles that were given are none of the turns asked for."""
        fins: dict[str, list[str]] = {}
        for m in self.measured:
            if not m.held(self.rudder_max) and any(m.entered(r.speed, r.side) for r in rows):
                fins.setdefault(f"{abs(m.turn.fin):.3g}", []).append(m.turn.run)
            elif m.held(self.rudder_max) and isnan(m.turn.entry_speed) and _to(rows, m.turn.side):
                yield f"{m.turn.run} begins in the turn, so that its speed before it is not known: log the approach too"
        for fin, names in fins.items():
            counted = f"{', '.join(names)} count{'s' * (len(names) == 1)} as measured"
            yield f"with `--fin-max {fin}`, the rudder of {'that turn' if len(names) == 1 else 'those turns'}, {counted}"

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
            "settling": list(self.settling),
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


def found_by(methods: Iterable[str]) -> str:
    """Return how turns were found, in words; circles that were measured are told apart, unless all were."""
    kinds = sorted(set(methods))
    return ", ".join(BY_METHOD[m] for m in kinds if m != "measured" or len(kinds) == 1)


def settling_flight(because: tuple[str, ...], side: str, speed: float, rudder: float) -> str:
    """Return the flight that settles what a row lacks."""
    if not because:
        return "nothing more: the data reached this turn"
    return f"turning_circle to {side} at {speed:.2f} m/s with {rudder:.3g} rad: {HOW}"


def _to(rows: Sequence[TurnRow], side: str) -> bool:
    return any(r.side == side for r in rows)


def _speeds(speeds: Sequence[float]) -> str:
    """Return speeds in m/s as words, many of them as the range they span."""
    if len(speeds) > MAX_SPEEDS_LISTED:
        return f"{min(speeds):.2f} to {max(speeds):.2f} m/s"
    return f"{', '.join(f'{s:.2f}' for s in speeds)} m/s"
