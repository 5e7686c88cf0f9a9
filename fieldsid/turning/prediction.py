"""The records of a turning prediction: its rows and measured circles, and the words for a radius."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import isnan, nan
from typing import Annotated, Any, Literal, get_args

from fieldsid.display import Displayed, Plotted
from fieldsid.logs.run import Note
from fieldsid.records.keys import INLINE, Interval, Key, Number, Side
from fieldsid.rounding import number
from fieldsid.turning.measured.measured_turn import MeasuredTurn
from fieldsid.turning.steady.speed_loss import SurgeModel

MAX_KNOWN_WIDTH = 0.35
"""Largest width of the 95 % band over the radius of an identified turn: beyond it only the band is reported as known."""
BRACKETED = "radius in brackets: these runs tell the band, not the number"


def is_band_only(radius: float, band: tuple[float, float]) -> bool:
    """Return whether a band (m, m) is too wide for the radius (m) in it to be known."""
    return band[1] - band[0] > MAX_KNOWN_WIDTH * radius


def radius_cell(radius: float, band: tuple[float, float]) -> str:
    """Return a radius (m) for a table, in brackets where its band is too wide (`is_band_only`)."""
    return f"({number(radius, 3)})" if is_band_only(radius, band) else number(radius, 3)


def turn_words(radius: float, band: tuple[float, float], where: str) -> str:
    """Return `4.90 m to port, 95 % 4.39 .. 5.48 m` for `where` "to port", or `between 4.39 and 9.48 m (95 %) to port`."""
    low, high = number(band[0], 3), number(band[1], 3)
    if is_band_only(radius, band):
        return f"between {low} and {high} m (95 %) {where}"
    return f"{number(radius, 3)} m {where}, 95 % {low} .. {high} m"


SIDES: Mapping[str, float] = {"port": -1.0, "starboard": 1.0}
EQUAL_TURN_SHARE = 0.05
"""Relative difference of speed and rudder up to which two turns count as the same."""
BY_METHOD: Mapping[str, str] = {
    "maneuvering": "one vehicle fitted to all runs",
    "simulated": "each speed's own model flown",
    "u_turn": "u-turn formula",
    "steady": "formula of the settled circle",
    "measured": "measured",
}
"""The methods in words."""
MAX_LISTED = 4
"""Largest number of speeds or models that are listed one by one."""
HOW = "one and a half circles, x_m and y_m logged"


@dataclass(frozen=True, slots=True, repr=False)
class TurnRow(Displayed):
    """The turn at one entry speed to one side; lengths m, times s, rates rad/s, NaN where the method does not give it.

    `radius` is the median of the predicted distribution, `of_model` the radius of the identified yaw model.
    """

    speed: Annotated[float, Key("Entry speed.", "speed_m_s")]
    side: Annotated[str, Key("The side.", of=Side)]
    radius: Annotated[Number, Key("The radius, by `method`: the median of what is believed, or the formula's.", "radius_m")]
    interval95: Annotated[Interval, Key("Its 95 % band, parameters and model form together.")]
    steady_radius: Annotated[Number, Key("Radius of the settled circle.", "steady_radius_m")]
    u_turn_radius: Annotated[Number, Key("Path of a half turn over pi.", "u_turn_radius_m")]
    u_turn_time: Annotated[Number, Key("Time of a half turn.", "u_turn_time_s")]
    yaw_rate_max: Annotated[Number, Key("Largest yaw rate, its size.", "yaw_rate_max_rad_s")]
    method: Annotated[
        str, Key("Where the radius comes from.", of=Literal["u_turn", "steady", "simulated", "maneuvering", "measured"])
    ]
    trust: Annotated[str, Key("What it rests on.", of=Literal["measured", "identified", "extrapolated"])]
    because: Annotated[tuple[str, ...], Key("What was not reached.")]
    settle_with: Annotated[str, Key("The maneuver that would settle it.")]
    turn_speed: Annotated[Number, Key("Speed along the path in the settled turn.", "turn_speed_m_s")]
    u_turn_time95: Annotated[Interval, Key("Its 95 % band.", "u_turn_time95_s")]
    advance: Annotated[Number, Key("Distance along the approach at 90 deg; null for the formulas.", "advance_m")] = nan
    transfer: Annotated[Number, Key("Distance across it at 90 deg.", "transfer_m")] = nan
    tactical_diameter: Annotated[Number, Key("Distance across it at 180 deg.", "tactical_diameter_m")] = nan
    predicted: Annotated[Number, Key("The prediction, where `radius_m` was measured.", "predicted_m")] = nan
    predicted95: Annotated[Interval, Key("Its band.")] = (nan, nan)
    of_model: Annotated[Number, Key("Radius of the identified yaw model by itself.", "model_radius_m")] = nan

    @property
    def extrapolated(self) -> Annotated[bool, Key()]:
        """Whether the turn lies beyond what the data reached."""
        return bool(self.because)

    @property
    def band_only(self) -> Annotated[bool, Key()]:
        """Whether `interval95` is wider than 35 % of `radius_m`: what is known is the band, and no number in it."""
        return is_band_only(self.radius, self.interval95)


@dataclass(frozen=True, slots=True, repr=False)
class MeasuredRow(Displayed):
    """A measured circle with the model's prediction for the fin and the speed it was flown with."""

    turn: Annotated[MeasuredTurn, INLINE]
    predicted: Annotated[Number, Key("The prediction.", "predicted_m")]
    predicted95: Annotated[Interval, Key("Its band.")]

    def has_entry(self, speed: float, side: str) -> bool:
        """Whether the circle is to this side, with this entry speed (m/s) to within EQUAL_TURN_SHARE."""
        return self.turn.side == side and abs(self.turn.entry_speed - speed) <= EQUAL_TURN_SHARE * speed

    def has_rudder(self, rudder: float) -> bool:
        """Whether the circle was flown with this rudder (rad) to within EQUAL_TURN_SHARE."""
        return abs(abs(self.turn.fin) - rudder) <= EQUAL_TURN_SHARE * rudder

    @property
    def difference_percent(self) -> Annotated[Number, Key()]:
        """Predicted over measured, less one."""
        return 100.0 * (self.predicted / self.turn.circle.radius - 1.0)

    @property
    def inside_band(self) -> Annotated[bool, Key()]:
        """Whether the measured radius is inside the prediction's band."""
        return self.predicted95[0] <= self.turn.circle.radius <= self.predicted95[1]


@dataclass(frozen=True, slots=True)
class Tightest:
    """Where the radius is smallest over speed."""

    speed: Annotated[float, Key("The speed.", "speed_m_s")]
    radius: Annotated[float, Key("The radius.", "radius_m")]


@dataclass(frozen=True, slots=True, repr=False)
class TurnPrediction(Plotted):
    """All rows, the measured circles, the surge model behind them, and remarks."""

    rows: Annotated[tuple[TurnRow, ...], Key("One for each speed and side.")]
    measured: Annotated[tuple[MeasuredRow, ...], Key("Measured circles.")]
    rudder_max: Annotated[float, Key("Rudder held in the turn.", "rudder_max_rad")]
    surge: Annotated[SurgeModel | None, Key("The loss of speed, where runs tell it.")]
    notes: Annotated[tuple[Note, ...], Key("What to know before it is trusted.", "warnings")]

    @property
    def settling(self) -> Annotated[tuple[str, ...], Key()]:
        """What would settle the rows that are extrapolated: circles that were given, asked for otherwise, and a flight."""
        rows = [r for r in self.rows if r.extrapolated]
        if not rows:
            return ()
        flights = [f"to {side} at {_speeds([r.speed for r in rows if r.side == side])}" for side in SIDES if _to(rows, side)]
        return (*self._other_circles(rows), f"turning_circle {', '.join(flights)} with {self.rudder_max:.3g} rad: {HOW}")

    def _other_circles(self, rows: Sequence[TurnRow]) -> Iterator[str]:
        """Yield why measured circles belong to none of the rows, and what would make them."""
        fins: dict[str, list[str]] = {}
        for m in self.measured:
            if not m.has_rudder(self.rudder_max) and any(m.has_entry(r.speed, r.side) for r in rows):
                fins.setdefault(f"{abs(m.turn.fin):.3g}", []).append(m.turn.run)
            elif m.has_rudder(self.rudder_max) and isnan(m.turn.entry_speed) and _to(rows, m.turn.side):
                yield f"{m.turn.run} begins in the turn, so that its speed before it is not known: log the approach too"
        for fin, names in fins.items():
            counted = f"{', '.join(names)} count{'s' * (len(names) == 1)} as measured"
            yield f"with `--fin-max {fin}`, the rudder of {'that turn' if len(names) == 1 else 'those turns'}, {counted}"

    def best(self, side: str) -> TurnRow | None:
        """Return the local minimum of the radius over speed, the one at the highest speed of several; None without one."""
        rows = [r for r in self.rows if r.side == side]
        inner = [
            b for a, b, c in zip(rows[:-2], rows[1:-1], rows[2:], strict=True) if b.radius <= a.radius and b.radius < c.radius
        ]
        return inner[-1] if inner else None

    @property
    def minimum(self) -> Annotated[Mapping[Side, Tightest | None], Key()]:
        """By side, the smallest radius where it has a minimum inside the speeds."""
        best = {side: self.best(side) for side in get_args(Side)}
        return {side: None if b is None else Tightest(b.speed, b.radius) for side, b in best.items()}


def found_by(methods: Iterable[str]) -> str:
    """Return the methods of turns in words, without `measured` unless all are."""
    kinds = sorted(set(methods))
    return ", ".join(BY_METHOD[m] for m in kinds if m != "measured" or len(kinds) == 1)


def settling_flight(because: tuple[str, ...], side: str, speed: float, rudder: float) -> str:
    """Return the flight that would remove the reasons `because` against a row, in words."""
    if not because:
        return "nothing more: the data reached this turn"
    return f"turning_circle to {side} at {speed:.2f} m/s with {rudder:.3g} rad: {HOW}"


def predicted_row(speed: float, side: str, rudder: float, because: tuple[str, ...], **found: Any) -> TurnRow:
    """Return the row of a predicted turn at a speed (m/s) with a rudder (rad).

    `because` are the reasons why it counts as extrapolated, `found` its other fields.
    """
    return TurnRow(
        speed=speed,
        side=side,
        trust="extrapolated" if because else "identified",
        because=because,
        settle_with=settling_flight(because, side, speed, rudder),
        predicted=found["radius"],
        predicted95=found["interval95"],
        **found,
    )


def _to(rows: Sequence[TurnRow], side: str) -> bool:
    return any(r.side == side for r in rows)


def _speeds(speeds: Sequence[float]) -> str:
    """Return speeds in m/s as words, many of them as the range they span."""
    if len(speeds) > MAX_LISTED:
        return f"{min(speeds):.2f} to {max(speeds):.2f} m/s"
    return f"{', '.join(f'{s:.2f}' for s in speeds)} m/s"
