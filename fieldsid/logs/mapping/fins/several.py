"""Which fins move a plane, where a log has several alike: the sum of them that a mapping reads, with what speaks for it.

Fins of one vehicle are called alike but for a number or a side. What each does to the rate of the plane is told by the numbers,
see shares.py; of an X tail the shares are 1/4 each, of twin rudders 1/2. Of a vehicle's outputs, of which no name says what they
move, it is the one that the rate follows; where none does all are named with the line that is missing.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any

import numpy as np

from fieldsid.errors import FieldsidError
from fieldsid.logs.channels import AXES
from fieldsid.logs.convert.clock import Track, held
from fieldsid.logs.convert.servo_counts import COUNTS, SERVOS, Servo
from fieldsid.logs.convert.units import pick_unit
from fieldsid.logs.doctor.together import width_of
from fieldsid.logs.few_of import few_of
from fieldsid.logs.mapping.canonical_names import words_of
from fieldsid.logs.mapping.fins.shares import EXPLAINS, WINDOWS_S, FinShares, explains, fin_shares, moved_by
from fieldsid.logs.mapping.mapping_file import mapping_of
from fieldsid.logs.mapping.numbers.units_told import Reading, as_counts, fin_reading
from fieldsid.logs.mapping.trial import Log
from fieldsid.logs.mapping.vocabulary import COMMANDED, MEASURED, OF_ANOTHER, word_set
from fieldsid.logs.reader import Inventory, Series
from fieldsid.logs.run import FINS, Note, Run, origin_of
from fieldsid.numerics.arrays import FloatArray

OUTPUTS = word_set("servo servomotor actuator actuators rcou output outputs control controls")
"""Words of what a vehicle's servos are told or say, which do not tell which moves what."""
CALLED = OUTPUTS | word_set(
    "fin fins rudder rudders rud elevator elevators elev plane planes sternplane sternplanes surface surfaces flap flaps foil "
    "ctrl delta pwm u d input inputs act surf canard wing"
)
"""Words of what may be a fin among others."""
THRUSTERS = word_set("thrust thruster thrusters thr motor motors prop propeller esc jet engine rpm")
"""Words of what turns a vehicle by pushing more on one side."""
STARBOARD = word_set("starboard stbd right s r sb")
SIDES = STARBOARD | word_set(
    "port left p l upper lower top bottom up down t b a c d ul ur ll lr tl tr bl br pu pl su sl ne nw se sw i ii iii iv"
)
"""Words of where one of several fins is."""
MOST = 16
"""Fins and motors alike: more are no vehicle's."""
Family = Mapping[str, Mapping[str, Any]]
"""Fins alike: where a mapping finds each, by its name."""
SHORT_WORD = 2
"""Letters up to which a word is a side only behind another."""


def is_measured(family: Family) -> bool:
    """Whether fins are told as they were measured, by their names."""
    words = {word for name in family for word in words_of(name)}
    return bool(words & MEASURED) and not words & (COMMANDED | {"set"})


def are_outputs(family: Family) -> bool:
    """Whether the names are those of servos in a log of topics: what each of them moves is the vehicle's."""
    return all(OUTPUTS & set(words_of(name)) and "topic" in place for name, place in family.items())


def families(inventory: Inventory) -> list[Family]:
    """Return columns, or fields of topics, that are called alike but for a number or a side, as places in a mapping by name."""
    alike: dict[tuple[str, ...], dict[str, Mapping[str, Any]]] = {}
    for name, place in _numbers(inventory):
        kind = _kind(words_of(name))
        if kind is not None:
            alike.setdefault(kind, {})[name] = place
    return [f for f in alike.values() if 1 < len(f) <= MOST or (are_outputs(f) and any(c.isdigit() for c in "".join(f)))]


def _numbers(inventory: Inventory) -> Iterator[tuple[str, Mapping[str, Any]]]:
    """Yield the numbers of a log that its format does not define, by name, with their place."""
    for channel in inventory.channels if inventory.is_named else ():
        for info in channel.fields:
            if info.kind not in ("text", "numbers") and info.means is None:
                if inventory.by_topic:
                    yield f"{channel.name} {info.path}".strip(), {"topic": channel.name, "field": info.path}
                else:
                    yield channel.name, {"column": channel.name}


def _kind(words: list[str]) -> tuple[str, ...] | None:
    """Return what fins of one kind have alike in their names; None for a name that is no fin's, or of one that stands alone."""
    kind = tuple("#" if w.isdigit() or (w in SIDES and (i or len(w) > SHORT_WORD)) else w for i, w in enumerate(words))
    is_fin = bool((CALLED | THRUSTERS) & set(kind)) or set(words) <= SIDES
    return kind if is_fin and "#" in kind and not OF_ANOTHER & set(words) else None


def is_thruster(name: str) -> bool:
    """Whether what pushes is called so, and no servo's motor, or by nothing but its side."""
    words = set(words_of(name))
    return (bool(THRUSTERS & words) and not OUTPUTS & words) or words <= SIDES


def is_on_starboard(name: str) -> bool:
    """Whether a thruster is the one on the starboard side, by its name."""
    return is_thruster(name) and bool(STARBOARD & set(words_of(name)))


PLACE = ("column", "topic", "field")
THRUST_RAD = 0.4
"""What the largest difference of thrusters is taken for."""


@dataclass(frozen=True, slots=True)
class _Fin:
    """One of several fins: its name, how a mapping reads it, the rad that its number is worth, its angle (n,), and its share."""

    name: str
    item: Mapping[str, Any]
    worth: float
    values: FloatArray
    share: float = 0.0
    fitted: float = 0.0


def with_several_fins(log: Log, body: Mapping[str, Any], run: Run) -> tuple[dict[str, Any], list[Note]]:
    """Return a mapping's body with the fins that move each plane, of several alike, and what speaks for them; else as it is."""
    signals, notes = dict(body["signals"]), []
    known, done = families(log.inventory), set[str]()
    for motion, of_plane in AXES:
        for family in known:
            signal = of_plane[is_measured(family)]
            if signal in done or not any(map(run.has, motion)) or not _is_asked(signal, of_plane, signals, family):
                continue
            fins = _read(log, {**body, "signals": signals}, family, run)
            used, found = _told(fins, run, *motion) if fins else ([], None)
            if found is not None and found.explains >= EXPLAINS and not _is_known(signals.get(signal), used):
                signals[signal] = _item(used)
                done.add(signal)
                if _is_of(signals.get("thrust", {}), family):  # one of several thrusters: their mean is the thrust
                    signals["thrust"] = {"sum": [{**fin.item, "scale": _rounded(1.0 / len(fins))} for fin in fins]}
                notes.append(_evidence(signal, motion[1], used, found, family))
    return {**body, "signals": signals}, notes


def which_output(inventory: Inventory, signals: Mapping[str, Any]) -> list[Note]:
    """Return the note that names a vehicle's outputs, and the line that is missing, where a mapping has no fin."""
    outputs = [place for family in families(inventory) if are_outputs(family) for place in family.values()]
    if not outputs or set(FINS) & signals.keys():
        return []
    named = [f"{place['topic']} {place['field']}" for place in outputs]
    spans = {(c.name, f.path): f.span for c in inventory.channels for f in c.fields}
    topic, field = outputs[0]["topic"], outputs[0]["field"]
    span = spans[topic, field] or (0.0, 0.0)
    servo = next((kind for kind in SERVOS[1:] if kind.least <= span[0] and span[1] <= kind.largest), None)
    how = {"unit": '"1"'} if 0.0 < max(map(abs, span)) <= 1.0 else {} if servo is None else as_counts(servo).item
    line = ", ".join(
        [
            *(f"{key}: {json.dumps(v)}" for key, v in {"topic": topic, "field": field}.items()),
            *(f"{key}: {v}" for key, v in how.items()),
        ]
    )
    message = (
        f"which servo moves which fin is not in the log; one line is missing, as `rudder_rad: {{{line}}}`, of: {few_of(named)}"
    )
    return [Note("which_output", message, {"signal": "rudder_rad", "others": named})]


def _is_asked(signal: str, of_plane: tuple[str, str], signals: Mapping[str, Any], family: Family) -> bool:
    """Whether a plane has no fin yet, one of several alike, or a sum of them beside which these were measured."""
    if signal in signals:
        return _is_of(signals[signal], family)
    return all("sum" in signals[s] for s in of_plane if s in signals)


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
    shift = origin_of(raw.notes) - origin_of(run.notes)
    seen = {
        name: _held(series, run.time - shift)
        for name, series in zip(family, raw.series.values(), strict=True)
        if series.values.ndim == 1
    }
    moving = [n for n, v in seen.items() if np.isfinite(v).mean() > 0.5 and float(np.nanmax(v) - np.nanmin(v)) > 0.0]
    if not moving:
        return []
    how = _how(moving, next(iter(raw.series.values())).unit, np.concatenate([seen[name] for name in moving]))
    return [_Fin(name, {**family[name], **how.item}, how.worth, (seen[name] - how.centre) * how.worth) for name in moving]


def _held(series: Series, time: FloatArray) -> FloatArray:
    good = np.isfinite(series.time) & np.isfinite(series.values)
    return held(Track(series.time[good], series.values[good]), time)


def _how(names: list[str], unit: str | None, values: FloatArray) -> Reading:
    """Return how the numbers (n,) of fins alike are read.

    By the unit in their names, as counts of a servo, or in degrees where they are too large; those of thrusters as they are.
    """
    if unit is not None:
        return Reading({}, pick_unit(unit).factor)
    fin = fin_reading(values)
    if all(map(is_thruster, names)) and (fin is None or fin.item["unit"] != COUNTS):
        return Reading({})
    centre = float(round(np.nanmedian(values)))
    return fin or as_counts(Servo("counts", centre, float(np.nanmax(np.abs(values - centre))), 0.0, 0.0))


def _is_known(item: Mapping[str, Any] | None, used: list[_Fin]) -> bool:
    """Whether one fin that a plane has already is all that moves it: the others do nothing, or have its numbers."""
    if item is None or not all(np.array_equal(fin.values, used[0].values, equal_nan=True) for fin in used):
        return False
    return any(all(item.get(key) == fin.item[key] for key in PLACE if key in fin.item) for fin in used)


def _told(fins: list[_Fin], run: Run, angle: str, rate: str) -> tuple[list[_Fin], FinShares | None]:
    """Return the fins that do something to a rate, with their shares, over the window in which they explain most.

    The starboard one of two thrusters counts as positive, of fins the first.
    """
    turning, turned = (run[s] if run.has(s) else None for s in (rate, angle))
    found = []
    for width in (max(2, width_of(run.time, window)) for window in WINDOWS_S):
        told = moved_by([fin.values for fin in fins], run.time, turning, turned, width, rights=angle == "pitch_rad")
        found += [] if told is None else [fin_shares(*told, width)]
    best = max(found, key=lambda shares: shares.explains, default=None)
    if best is None:
        return [], None
    used = [replace(fin, share=float(share), fitted=float(fitted))
            for fin, share, fitted in zip(fins, best.shares, best.fitted, strict=True) if share != 0.0]  # fmt: skip
    sign = math.copysign(1.0, next((fin.share for fin in used if is_on_starboard(fin.name)), used[0].share))
    return [replace(fin, share=sign * fin.share, fitted=sign * fin.fitted) for fin in used], best


def _item(used: list[_Fin]) -> dict[str, Any]:
    """Return how a mapping reads the fins that do something: one of them alone, or their sum."""
    taken = _taken_for(used)
    if len(used) == 1 and taken == 1.0:
        return dict(used[0].item)
    # the scale of counts is the rad of one, of all others what the angle in their unit is worth
    scales = [fin.share * taken * (fin.worth if fin.item.get("unit") == COUNTS else 1.0) for fin in used]
    return {"sum": [{**fin.item, "scale": _rounded(scale)} for fin, scale in zip(used, scales, strict=True)]}


def _taken_for(used: list[_Fin]) -> float:
    """Return the rad that the numbers of thrusters are taken for, by the largest difference; one of fins, which are angles."""
    if any("unit" in fin.item or not is_thruster(fin.name) for fin in used):
        return 1.0
    largest = float(np.nanmax(np.abs(np.sum([fin.share * (fin.values - np.nanmedian(fin.values)) for fin in used], axis=0))))
    return float(f"{THRUST_RAD / largest:.0e}") if largest > 0.0 else 1.0


def _rounded(value: float) -> float:
    return float(f"{value:.4g}")


def _evidence(signal: str, rate: str, used: list[_Fin], found: FinShares, family: Family) -> Note:
    told = " ".join(f"{'-' if fin.share < 0.0 else '+'} {_fraction(abs(fin.share))}{fin.name}" for fin in used)
    fitted = f", the best one alone {100 * found.best_alone:.0f} %; fitted {', '.join(f'{fin.fitted:.2g}' for fin in used)}"
    each, more = ("together they explain", fitted) if len(used) > 1 else ("it explains", "")
    message = f"{signal} is {told.removeprefix('+ ')}: {each} {explains(found.explains, rate)}{more}"
    if found.patterns < len(used):
        ways = "together only" if found.patterns == 1 else f"in {found.patterns} patterns only"
        message += f"; they moved {ways}: how much of it each of them does is not told by this log, and taken by how far it went"
    if _taken_for(used) != 1.0:
        message += f"; no angles: the largest difference is taken for about {THRUST_RAD:g} rad, and the authority is per that"
    outputs = {"outputs": len(family)} if are_outputs(family) and len(used) == 1 else {}
    return Note("evidence", message, {"signal": signal, "fins": {fin.name: fin.share for fin in used}, **outputs})


def _fraction(share: float) -> str:
    simple = Fraction(share).limit_denominator(12)
    return "" if share == 1.0 else f"{simple} " if abs(float(simple) - share) < 1e-6 else f"{share:.2f} "
