"""Which fins move a plane, where a log has several alike: the sum of them that a mapping reads, with what speaks for it.

Fins of one vehicle are called alike but for a number or a side. What each does to the rate of the plane is told by the numbers,
see shares.py; of an X tail the shares are 1/4 each, of twin rudders 1/2. Of a vehicle's outputs, of which no name says what they
move, it is the one that the rate follows; where none does all are named with the line that is missing.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np

from fieldsid.errors import FieldsidError
from fieldsid.logs.convert.clock import Track, held
from fieldsid.logs.convert.servo_counts import COUNTS, FINS, FULL_RAD, SERVOS, servo_of
from fieldsid.logs.convert.units import pick_unit
from fieldsid.logs.mapping.fins.families import Family, are_outputs, families, is_measured, is_on_starboard, is_thruster
from fieldsid.logs.mapping.fins.shares import FinShares, fin_shares, window_mean
from fieldsid.logs.mapping.mapping_file import mapping_of
from fieldsid.logs.mapping.numbers.recognise import EXPLAINS, WINDOWS_S
from fieldsid.logs.mapping.trial import Log
from fieldsid.logs.reader import Inventory, Series
from fieldsid.logs.run import Note, Run
from fieldsid.numerics.arrays import FloatArray

PLACE = ("column", "topic", "field")
LARGEST_RAD, LARGEST_DEG, THRUST_RAD = 1.6, 180.0, 0.4
"""A larger angle is in degrees, and a larger one yet in counts; what the largest difference of thrusters is taken for."""
SHOWN = 8
"""Outputs that a message names."""


@dataclass(frozen=True, slots=True)
class _Plane:
    """The fin of a plane, what was measured of it, the rate and angle that it moves, and whether the angle rights itself."""

    fin: str
    measured: str
    rate: str
    angle: str
    rights: bool


PLANES = (
    _Plane("rudder_rad", "rudder_measured_rad", "yaw_rate_rad_s", "yaw_rad", rights=False),
    _Plane("elevator_rad", "elevator_measured_rad", "pitch_rate_rad_s", "pitch_rad", rights=True),
)


@dataclass(frozen=True, slots=True)
class _Fin:
    """One of several fins: its name, how a mapping reads it, the rad that its number is worth, and its angle (n,)."""

    name: str
    item: Mapping[str, Any]
    worth: float
    values: FloatArray


def with_several_fins(log: Log, body: Mapping[str, Any], run: Run) -> tuple[dict[str, Any], list[Note]]:
    """Return a mapping's body with the fins that move each plane, of several alike, and what speaks for them; else as it is."""
    signals, notes = dict(body["signals"]), []
    known, done = families(log.inventory), set[str]()
    for plane in PLANES:
        for family in known:
            signal, asked = plane.measured if is_measured(family) else plane.fin, {**body, "signals": signals}
            if signal in done or not _is_asked(signal, plane, signals, family, run):
                continue
            fins = _read(log, asked, family, run)
            found = _told(fins, run, plane) if fins else None
            if found is not None and found.explains >= EXPLAINS and not _is_known(signals.get(signal), fins, found):
                signals[signal] = _item(fins, found)
                done.add(signal)
                _as_thrust(signals, fins, family)
                notes.append(_evidence(signal, plane, fins, found, family))
    return {**body, "signals": signals}, notes


def which_output(inventory: Inventory, signals: Mapping[str, Any]) -> list[Note]:
    """Return the note that names a vehicle's outputs, and the line that is missing, where a mapping has no fin."""
    outputs = [place for family in families(inventory) if are_outputs(family) for place in family.values()]
    if not outputs or set(FINS) & signals.keys():
        return []
    named = [f"{place['topic']} {place['field']}" for place in outputs]
    spans = {(c.name, f.path): f.span for c in inventory.channels for f in c.fields}
    topic, field = outputs[0]["topic"], outputs[0]["field"]
    unit, shown = _unit_by_span(spans[topic, field]), ", ".join(named[:SHOWN]) + ", ..." * (len(named) > SHOWN)
    message = (
        f"which servo moves which fin is not in the log; one line is missing, as `rudder_rad: {{topic: {json.dumps(topic)}, "
        f"field: {json.dumps(field)}{unit}}}`, of: {shown}"
    )
    return [Note("which_output", message, {"signal": "rudder_rad", "others": named})]


def _unit_by_span(span: tuple[float, float] | None) -> str:
    """Return the unit of an output by its least and largest, as a mapping has it: pulses, or shares of its range."""
    if span is None or span == (0.0, 0.0):
        return ""
    servo = next((s for s in SERVOS[1:] if s.least <= span[0] and span[1] <= s.largest), None)
    shares = ', unit: "1"' if max(map(abs, span)) <= 1.0 else ""
    return shares if servo is None else f", unit: {COUNTS}, centre: {servo.centre:g}"


def _is_asked(signal: str, plane: _Plane, signals: Mapping[str, Any], family: Family, run: Run) -> bool:
    """Whether a plane that moves has no fin yet, one of several alike, or a sum of them beside which these were measured."""
    if not (run.has(plane.rate) or run.has(plane.angle)):
        return False
    if signal in signals:
        return _is_of(signals[signal], family)
    return all("sum" in signals[s] for s in (plane.fin, plane.measured) if s in signals)


def _is_of(item: Mapping[str, Any], family: Family) -> bool:
    """Whether what a line of a mapping reads is one of a family."""
    return any(all(item.get(key) == value for key, value in place.items()) for place in family.values())


def _read(log: Log, body: Mapping[str, Any], family: Family, run: Run) -> list[_Fin]:
    """Return the fins of a family on the clock of the run, those that move; none where they cannot be read."""
    signals = {"rudder_rad": {"sum": [{**place, "scale": 1.0} for place in family.values()]}}
    try:
        raw = log.read(mapping_of({**body, "signals": signals}))
    except FieldsidError:  # what cannot be read is no fin
        return []
    shift = _origin_s(raw.notes) - _origin_s(run.notes)
    seen = {
        name: _held(series, run.time - shift)
        for name, series in zip(family, raw.series.values(), strict=True)
        if series.values.ndim == 1
    }
    moving = [n for n, v in seen.items() if np.isfinite(v).mean() > 0.5 and float(np.nanmax(v) - np.nanmin(v)) > 0.0]
    if not moving:
        return []
    how, worth, centre = _how(moving, next(iter(raw.series.values())).unit, np.concatenate([seen[name] for name in moving]))
    return [_Fin(name, {**family[name], **how}, worth, (seen[name] - centre) * worth) for name in moving]


def _held(series: Series, time: FloatArray) -> FloatArray:
    good = np.isfinite(series.time) & np.isfinite(series.values)
    return held(Track(series.time[good], series.values[good]), time)


def _origin_s(notes: tuple[Note, ...]) -> float:
    """Return the log's own time at time 0, in s: two readings of other fields start at other messages."""
    return next((n.data["origin_ns"] / 1e9 for n in notes if n.code == "time_origin"), 0.0)


def _how(names: list[str], unit: str | None, values: FloatArray) -> tuple[dict[str, Any], float, float]:
    """Return how the numbers (n,) of fins alike are read, the rad that one is worth, and what they are at zero.

    By the unit in their names, as counts of a servo, or in degrees where they are too large; those of thrusters as they are.
    """
    if unit is not None:
        return {}, pick_unit(unit).factor, 0.0
    servo, largest = servo_of(values), float(np.nanmax(np.abs(values)))
    if servo is not None:
        return {"unit": COUNTS, "centre": servo.centre}, FULL_RAD / servo.travel, servo.centre
    if all(map(is_thruster, names)):
        return {}, 1.0, 0.0
    if largest > LARGEST_DEG:
        centre = float(round(np.nanmedian(values)))
        return {"unit": COUNTS, "centre": centre}, FULL_RAD / float(np.nanmax(np.abs(values - centre))), centre
    return ({"unit": "deg"}, math.radians(1.0), 0.0) if largest > LARGEST_RAD else ({"unit": "rad"}, 1.0, 0.0)


def _is_known(item: Mapping[str, Any] | None, fins: list[_Fin], found: FinShares) -> bool:
    """Whether one fin that a plane has already is all that moves it: the others do nothing, or have its numbers."""
    used = [fin for fin, _ in _used(fins, found)]
    if item is None or not all(np.array_equal(fin.values, used[0].values, equal_nan=True) for fin in used):
        return False
    return any(all(item.get(key) == fin.item[key] for key in PLACE if key in fin.item) for fin in used)


def _told(fins: list[_Fin], run: Run, plane: _Plane) -> FinShares | None:
    """Return what fins do to the rate of their plane, over the window in which they explain most; None where nothing is told."""
    step = float(np.median(np.diff(run.time)))
    every = [_over([fin.values for fin in fins], run, plane, max(2, round(window / step))) for window in WINDOWS_S[:2]]
    return max((f for f in every if f is not None), key=lambda f: f.explains, default=None)


def _over(fins: list[FloatArray], run: Run, plane: _Plane, width: int) -> FinShares | None:
    """Return the shares of fins (n,) over windows of some samples; where the angle alone was logged, all by their means."""
    time, righting = run.time, run[plane.angle] if plane.rights and run.has(plane.angle) else None
    if run.has(plane.rate):
        return fin_shares(fins, time, run[plane.rate], righting, width)
    turned = (run[plane.angle][width:] - run[plane.angle][:-width]) / (time[width:] - time[:-width])
    means = [window_mean(time, fin, width) for fin in fins]
    return fin_shares(means, time[:-width], turned, None if righting is None else window_mean(time, righting, width), width)


def _used(fins: list[_Fin], found: FinShares) -> list[tuple[_Fin, float]]:
    """Return the fins that do something, with their shares."""
    return [(fin, float(share)) for fin, share in zip(fins, found.shares, strict=True) if share != 0.0]


def _item(fins: list[_Fin], found: FinShares) -> dict[str, Any]:
    """Return how a mapping reads the fins that do something: one of them alone, or their sum."""
    used = _used(fins, found)
    turned, taken = _sign(used), _taken_for(used)
    if len(used) == 1 and taken == 1.0:
        return dict(used[0][0].item)
    # the scale of counts is the rad of one, of all others what the angle in their unit is worth
    scales = [turned * share * taken * (fin.worth if fin.item.get("unit") == COUNTS else 1.0) for fin, share in used]
    return {"sum": [{**fin.item, "scale": _rounded(scale)} for (fin, _), scale in zip(used, scales, strict=True)]}


def _sign(used: list[tuple[_Fin, float]]) -> float:
    """Return the sign with which the starboard one of two thrusters counts as positive, of fins the first."""
    pushing = [share for fin, share in used if is_on_starboard(fin.name)]
    return math.copysign(1.0, pushing[0] if pushing else used[0][1])


def _taken_for(used: list[tuple[_Fin, float]]) -> float:
    """Return the rad that the numbers of thrusters are taken for, by the largest difference; one of fins, which are angles."""
    if any("unit" in fin.item or not is_thruster(fin.name) for fin, _ in used):
        return 1.0
    largest = float(np.nanmax(np.abs(np.sum([share * (fin.values - np.nanmedian(fin.values)) for fin, share in used], axis=0))))
    return float(f"{THRUST_RAD / largest:.0e}") if largest > 0.0 else 1.0


def _rounded(value: float) -> float:
    return float(f"{value:.4g}")


def _as_thrust(signals: dict[str, Any], fins: list[_Fin], family: Family) -> None:
    """Take the mean of several thrusters for the thrust, where one of them was."""
    if _is_of(signals.get("thrust", {}), family):
        signals["thrust"] = {"sum": [{**fin.item, "scale": _rounded(1.0 / len(fins))} for fin in fins]}


def _evidence(signal: str, plane: _Plane, fins: list[_Fin], found: FinShares, family: Family) -> Note:
    used = _used(fins, found)
    shares = {fin.name: _sign(used) * share for fin, share in used}
    told = " ".join(f"{'-' if share < 0.0 else '+'} {_fraction(abs(share))}{name}" for name, share in shares.items())
    rate = plane.rate.removesuffix("_rad_s").replace("_", " ")
    was = [_sign(used) * was for was, share in zip(found.fitted, found.shares, strict=True) if share != 0.0]
    fitted = f", the best one alone {100 * found.best_alone:.0f} %; fitted {', '.join(f'{value:.2g}' for value in was)}"
    each, more = ("together they explain", fitted) if len(used) > 1 else ("it explains", "")
    message = (
        f"{signal} is {told.removeprefix('+ ')}: {each} {100 * found.explains:.0f} % of what the {rate}'s change has beside the "
        f"rate's own{more}"
    )
    if found.patterns < len(used):
        ways = "together only" if found.patterns == 1 else f"in {found.patterns} patterns only"
        message += f"; they moved {ways}: how much of it each of them does is not told by this log, and taken by how far it went"
    if _taken_for(used) != 1.0:
        message += f"; no angles: the largest difference is taken for about {THRUST_RAD:g} rad, and the authority is per that"
    outputs = {"outputs": len(family)} if are_outputs(family) and len(used) == 1 else {}
    return Note("evidence", message, {"signal": signal, "fins": shares, **outputs})


def _fraction(share: float) -> str:
    simple = Fraction(share).limit_denominator(12)
    return "" if share == 1.0 else f"{simple} " if abs(float(simple) - share) < 1e-6 else f"{share:.2f} "
