"""Which fins move a plane, where a log has several alike: the sum of them that a mapping reads, with what speaks for it.

Fins of one vehicle are called alike but for a number or a side. What each does to the rate of the plane is told by the numbers,
see shares.py; of an X tail the shares are 1/4 each, of twin rudders 1/2.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np

from fieldsid.errors import FieldsidError
from fieldsid.logs.convert.clock import Track, held
from fieldsid.logs.convert.servo_counts import COUNTS, FULL_RAD, servo_of
from fieldsid.logs.convert.units import pick_unit
from fieldsid.logs.mapping.fins.families import Family, families, is_measured, is_on_starboard, is_thruster
from fieldsid.logs.mapping.fins.shares import FinShares, fin_shares, window_mean
from fieldsid.logs.mapping.mapping_file import mapping_of
from fieldsid.logs.mapping.numbers.recognise import EXPLAINS, WINDOWS_S
from fieldsid.logs.reader import Inventory, Reader, ReadOptions, Series
from fieldsid.logs.run import Note, Run
from fieldsid.numerics.arrays import FloatArray

PLACE = ("column", "topic", "field")
LARGEST_RAD, LARGEST_DEG, THRUST_RAD = 1.6, 180.0, 0.4
"""A larger angle is in degrees, and a larger one yet in counts; what the largest difference of thrusters is taken for."""


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


def with_several_fins(
    inventory: Inventory, reader: Reader, options: ReadOptions, body: Mapping[str, Any], run: Run
) -> tuple[dict[str, Any], list[Note]]:
    """Return a mapping's body with the fins that move each plane, of several alike, and what speaks for them; else as it is."""
    signals, notes = dict(body["signals"]), []
    done: set[str] = set()
    for plane in PLANES:
        for family in families(inventory):
            signal = plane.measured if is_measured(family) else plane.fin
            if signal in done or not _is_asked(signal, plane, {**body, "signals": signals}, family, run):
                continue
            fins = _read(inventory, reader, options, {**body, "signals": signals}, family, run)
            found = _told(fins, run, plane) if len(fins) > 1 else None
            if found is not None and found.explains >= EXPLAINS and not _is_known(signals.get(signal), fins, found):
                signals[signal] = _item(fins, found)
                done.add(signal)
                _as_thrust(signals, fins, family)
                notes.append(_evidence(signal, plane, fins, found))
    return ({**body, "signals": signals}, notes) if notes else (dict(body), [])


def _is_asked(signal: str, plane: _Plane, body: Mapping[str, Any], family: Family, run: Run) -> bool:
    """Whether a plane that moves has no fin yet, one of several alike, or a sum of them beside which these were measured."""
    signals = body["signals"]
    if not (run.has(plane.rate) or run.has(plane.angle)):
        return False
    if signal in signals:
        return any(all(signals[signal].get(key) == value for key, value in place.items()) for place in family.values())
    others = [signals[s] for s in (plane.fin, plane.measured) if s in signals]
    return all("sum" in item for item in others)


def _read(
    inventory: Inventory, reader: Reader, options: ReadOptions, body: Mapping[str, Any], family: Family, run: Run
) -> list[_Fin]:
    """Return the fins of a family on the clock of the run, those that move; none where they cannot be read."""
    signals = {"rudder_rad": {"sum": [{**place, "scale": 1.0} for place in family.values()]}}
    lenient = ReadOptions(options.msg_path, salvage=True, joined=options.joined)
    try:
        raw = reader.read(inventory.path, mapping_of({**body, "signals": signals}), lenient)
    except FieldsidError:  # what cannot be read is no fin
        return []
    shift = _origin_s(raw.notes) - _origin_s(run.notes)
    seen = {name: _held(series, run.time - shift) for name, series in zip(family, raw.series.values(), strict=True)}
    moving = [n for n, v in seen.items() if np.isfinite(v).mean() > 0.5 and float(np.nanmax(v) - np.nanmin(v)) > 0.0]
    if not moving:
        return []
    how, worth, centre = _how(moving, next(iter(raw.series.values())).unit, np.concatenate([seen[name] for name in moving]))
    return [_Fin(name, {**family[name], **how}, worth, (seen[name] - centre) * worth) for name in moving]


def _held(series: Series, time: FloatArray) -> FloatArray:
    good = np.isfinite(series.time) & np.isfinite(series.values)
    return held(Track(series.time[good], series.values[good]), time)


def _origin_s(notes: tuple[Note, ...]) -> float:
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
    if item is None:
        return False
    used = [fin for fin, share in zip(fins, found.shares, strict=True) if share != 0.0]
    if all(np.array_equal(fin.values, used[0].values, equal_nan=True) for fin in used):
        return any(all(item.get(key) == fin.item[key] for key in PLACE if key in fin.item) for fin in used)
    return False


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


def _item(fins: list[_Fin], found: FinShares) -> dict[str, Any]:
    """Return how a mapping reads the fins that do something: one of them alone, or their sum."""
    used = [(fin, float(share)) for fin, share in zip(fins, found.shares, strict=True) if share != 0.0]
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
    thrust = signals.get("thrust", {})
    if any(all(thrust.get(key) == value for key, value in place.items()) for place in family.values()):
        share = _rounded(1.0 / len(fins))
        signals["thrust"] = {"sum": [{**fin.item, "scale": share} for fin in fins]}


def _evidence(signal: str, plane: _Plane, fins: list[_Fin], found: FinShares) -> Note:
    used = [(fin.name, share, was) for fin, share, was in zip(fins, found.shares, found.fitted, strict=True) if share != 0.0]
    counted = [(fin, float(share)) for fin, share in zip(fins, found.shares, strict=True) if share != 0.0]
    turned = _sign(counted)
    rate = plane.rate.removesuffix("_rad_s").replace("_", " ")
    told = " ".join(f"{'-' if turned * share < 0.0 else '+'} {_fraction(abs(share))} {name}" for name, share, _ in used)
    was = ", ".join(f"{turned * value:.2g}" for _, _, value in used)
    message = (
        f"{signal} is {told.removeprefix('+ ')}: together they explain {100 * found.explains:.0f} % of what the {rate}'s change "
        f"has beside the rate's own, the best one alone {100 * found.best_alone:.0f} %; fitted {was}"
    )
    if found.patterns < len(used):
        ways = "together only" if found.patterns == 1 else f"in {found.patterns} patterns only"
        message += f"; they moved {ways}: how much of it each of them does is not told by this log, and taken by how far it went"
    if _taken_for(counted) != 1.0:
        message += f"; no angles: the largest difference is taken for about {THRUST_RAD:g} rad, and the authority is per that"
    return Note("evidence", message, {"signal": signal, "fins": {name: turned * float(share) for name, share, _ in used}})


def _fraction(share: float) -> str:
    simple = Fraction(share).limit_denominator(12)
    return str(simple) if abs(float(simple) - share) < 1e-6 else f"{share:.2f}"
