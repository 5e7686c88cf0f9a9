"""The fins that turn the vehicle in an axis, where a log has several similar ones, as a sum in a mapping with the evidence.

The names of the fins of one vehicle differ in a number or a side only. The share of each in the angular acceleration of the axis
is estimated by least squares, see shares.py; it is 1/4 for each fin of an X tail, 1/2 for twin rudders. Where the names are those
of servo outputs, the fin is the output that the rate follows; where there is none, a note lists all outputs and the missing line.
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
from fieldsid.logs.convert.clock import Track, zero_order_hold
from fieldsid.logs.convert.servo_counts import COUNTS, SERVOS, Servo
from fieldsid.logs.convert.units import pick_unit
from fieldsid.logs.doctor.fin_findings import WIDEST
from fieldsid.logs.doctor.together import width_of
from fieldsid.logs.few_of import few_of
from fieldsid.logs.mapping.canonical_names import words_of
from fieldsid.logs.mapping.fins.shares import EXPLAINS, WINDOWS_S, FinShares, explains, fin_shares, moved_by
from fieldsid.logs.mapping.mapping_file import mapping_of
from fieldsid.logs.mapping.numbers.unit_inference import Reading, as_counts, fin_reading
from fieldsid.logs.mapping.trial import Log
from fieldsid.logs.mapping.vocabulary import COMMANDED, MEASURED, OF_ANOTHER, word_set
from fieldsid.logs.reader import MOST_DEVICES, Inventory, Series
from fieldsid.logs.run import FINS, Note, Run, origin_of
from fieldsid.numerics.arrays import FloatArray

OUTPUTS = word_set("servo servomotor actuator actuators rcou output outputs control controls")
"""Words of commands to servos and measurements of them, which do not state the fin that a servo moves."""
CALLED = OUTPUTS | word_set(
    "fin fins rudder rudders rud elevator elevators elev plane planes sternplane sternplanes surface surfaces flap flaps foil "
    "ctrl delta pwm u d input inputs act surf canard wing"
)
"""Words in the names of one of several fins."""
THRUSTERS = word_set("thrust thruster thrusters thr motor motors prop propeller esc jet engine rpm")
"""Words of thrusters, which turn a vehicle by a difference of thrust."""
STARBOARD = word_set("starboard stbd right s r sb")
SIDES = STARBOARD | word_set(
    "port left p l upper lower top bottom up down t b a c d ul ur ll lr tl tr bl br pu pl su sl ne nw se sw i ii iii iv"
)
"""Words of the position of one of several fins."""
Family = Mapping[str, Mapping[str, Any]]
"""Similar fins: the source of each in a mapping, by its name."""


def is_measured(family: Family) -> bool:
    """Return whether the names say that the fin angles were measured and not commanded."""
    words = {word for name in family for word in words_of(name)}
    return bool(words & MEASURED) and not words & (COMMANDED | {"set"})


def are_outputs(family: Family) -> bool:
    """Return whether the names are those of servo outputs in a log of topics, which do not state the fin that each moves."""
    return all(OUTPUTS & set(words_of(name)) and "topic" in place for name, place in family.items())


def families(inventory: Inventory) -> list[Family]:
    """Return the groups of columns, or fields of topics, whose names differ in a number or a side only, as sources by name."""
    by_kind: dict[tuple[str, ...], dict[str, Mapping[str, Any]]] = {}
    for name, place in _numbers(inventory):
        kind = _kind(words_of(name))
        if kind is not None:
            by_kind.setdefault(kind, {})[name] = place
    return [
        f for f in by_kind.values() if 1 < len(f) <= MOST_DEVICES or (are_outputs(f) and any(c.isdigit() for c in "".join(f)))
    ]


def _numbers(inventory: Inventory) -> Iterator[tuple[str, Mapping[str, Any]]]:
    """Yield the name and the source of each number of a log that its format does not define."""
    for channel in inventory.channels if inventory.is_named else ():
        for info in channel.fields:
            if info.kind not in ("text", "numbers") and info.means is None:
                if inventory.by_topic:
                    yield f"{channel.name} {info.path}".strip(), {"topic": channel.name, "field": info.path}
                else:
                    yield channel.name, {"column": channel.name}


def _kind(words: list[str]) -> tuple[str, ...] | None:
    """Return the words of a name with numbers and sides replaced by `#`; None where it is not that of one of several fins."""
    kind = tuple("#" if w.isdigit() or (w in SIDES and (i or len(w) > 2)) else w for i, w in enumerate(words))
    is_fin = bool((CALLED | THRUSTERS) & set(kind)) or set(words) <= SIDES
    return kind if is_fin and "#" in kind and not OF_ANOTHER & set(words) else None


def is_thruster(name: str) -> bool:
    """Return whether a name is that of a thruster and not of a servo motor, or consists of a side only."""
    words = set(words_of(name))
    return (bool(THRUSTERS & words) and not OUTPUTS & words) or words <= SIDES


def is_on_starboard(name: str) -> bool:
    """Return whether a name is that of a thruster on the starboard side."""
    return is_thruster(name) and bool(STARBOARD & set(words_of(name)))


PLACE = ("column", "topic", "field")
THRUST_RAD = 0.5 * WIDEST
"""Fin angle in rad that is assumed for the largest difference of thrusters, that of a fin about to stall."""


@dataclass(frozen=True, slots=True)
class _Fin:
    """One of several fins: name, line in a mapping, angle in rad of one unit of its number, angle (n,) in rad, and share."""

    name: str
    item: Mapping[str, Any]
    worth: float
    values: FloatArray
    share: float = 0.0
    fitted: float = 0.0


def with_several_fins(log: Log, body: Mapping[str, Any], run: Run) -> tuple[dict[str, Any], list[Note]]:
    """Return the body of a mapping with the fins that turn each axis, of several similar ones, and notes with the evidence."""
    signals, notes = dict(body["signals"]), []
    known, done = families(log.inventory), set[str]()
    for motion, of_plane in AXES:
        for family in known:
            signal = of_plane[is_measured(family)]
            if signal in done or not any(map(run.has, motion)) or not _may_be_used(signal, of_plane, signals, family):
                continue
            fins = _read(log, {**body, "signals": signals}, family, run)
            used, found = _effective_fins(fins, run, *motion) if fins else ([], None)
            if found is not None and found.explains >= EXPLAINS and not _is_known(signals.get(signal), used):
                signals[signal] = _item(used)
                done.add(signal)
                if _is_member(signals.get("thrust", {}), family):  # one of several thrusters: their mean is the thrust
                    signals["thrust"] = {"sum": [{**fin.item, "scale": _rounded(1.0 / len(fins))} for fin in fins]}
                notes.append(_evidence(signal, motion[1], used, found, family))
    return {**body, "signals": signals}, notes


def which_output(inventory: Inventory, signals: Mapping[str, Any]) -> list[Note]:
    """Return the note that lists the servo outputs, and the missing line, where a mapping has no fin."""
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


def _may_be_used(signal: str, of_plane: tuple[str, str], signals: Mapping[str, Any], family: Family) -> bool:
    """Return whether a family may be the signal: the axis has no fin, one of this family, or only sums of other fins."""
    if signal in signals:
        return _is_member(signals[signal], family)
    return all("sum" in signals[s] for s in of_plane if s in signals)


def _is_member(item: Mapping[str, Any], family: Family) -> bool:
    """Return whether a line of a mapping reads one of a family."""
    return any(all(item.get(key) == value for key, value in place.items()) for place in family.values())


def _read(log: Log, body: Mapping[str, Any], family: Family, run: Run) -> list[_Fin]:
    """Return the moving fins of a family on the clock of the run; none where they cannot be read."""
    signals = {"rudder_rad": {"sum": [{**place, "scale": 1.0} for place in family.values()]}}
    try:
        raw = log.read(mapping_of({**body, "signals": signals}))
    except FieldsidError:  # a column that cannot be read is not a fin
        return []
    shift = origin_of(raw.notes) - origin_of(run.notes)
    seen = {
        name: _on_clock(series, run.time - shift)
        for name, series in zip(family, raw.series.values(), strict=True)
        if series.values.ndim == 1
    }
    moving = [n for n, v in seen.items() if np.isfinite(v).mean() > 0.5 and float(np.nanmax(v) - np.nanmin(v)) > 0.0]
    if not moving:
        return []
    how = _conversion(moving, next(iter(raw.series.values())).unit, np.concatenate([seen[name] for name in moving]))
    return [_Fin(name, {**family[name], **how.item}, how.worth, (seen[name] - how.centre) * how.worth) for name in moving]


def _on_clock(series: Series, time: FloatArray) -> FloatArray:
    good = np.isfinite(series.time) & np.isfinite(series.values)
    return zero_order_hold(Track(series.time[good], series.values[good]), time)


def _conversion(names: list[str], unit: str | None, values: FloatArray) -> Reading:
    """Return the conversion of the numbers (n,) of similar fins.

    They are read in the unit in their names, as counts of a servo, or in degrees where they are too large; thrusts are not
    converted.
    """
    if unit is not None:
        return Reading({}, pick_unit(unit).factor)
    fin = fin_reading(values)
    if all(map(is_thruster, names)) and (fin is None or fin.item.get("unit") != COUNTS):
        return Reading({})
    centre = float(round(np.nanmedian(values)))
    return fin or as_counts(Servo("counts", centre, float(np.nanmax(np.abs(values - centre))), 0.0, 0.0))


def _is_known(item: Mapping[str, Any] | None, used: list[_Fin]) -> bool:
    """Return whether the mapping already has one of the fins, and all fins used have the same numbers as it."""
    if item is None or not all(np.array_equal(fin.values, used[0].values, equal_nan=True) for fin in used):
        return False
    return any(all(item.get(key) == fin.item[key] for key in PLACE if key in fin.item) for fin in used)


def _effective_fins(fins: list[_Fin], run: Run, angle: str, rate: str) -> tuple[list[_Fin], FinShares | None]:
    """Return the fins with an effect on a rate, with their shares, over the window in which they explain most.

    The sign is such that a starboard thruster, or else the first fin, counts as positive.
    """
    turning, turned = (run[s] if run.has(s) else None for s in (rate, angle))
    found = []
    for width in (max(2, width_of(run.time, window)) for window in WINDOWS_S):
        terms = moved_by([fin.values for fin in fins], run.time, turning, turned, width, rights=angle == "pitch_rad")
        found += [] if terms is None else [fin_shares(*terms, width)]
    best = max(found, key=lambda shares: shares.explains, default=None)
    if best is None:
        return [], None
    used = [replace(fin, share=float(share), fitted=float(fitted))
            for fin, share, fitted in zip(fins, best.shares, best.fitted, strict=True) if share != 0.0]  # fmt: skip
    sign = math.copysign(1.0, next((fin.share for fin in used if is_on_starboard(fin.name)), used[0].share))
    return [replace(fin, share=sign * fin.share, fitted=sign * fin.fitted) for fin in used], best


def _item(used: list[_Fin]) -> dict[str, Any]:
    """Return the line of a mapping for the fins with an effect: one of them alone, or their sum."""
    angle_factor = _angle_factor(used)
    if len(used) == 1 and angle_factor == 1.0:
        return dict(used[0].item)
    # for counts the scale is the angle in rad of one count, else the share in the sum
    scales = [fin.share * angle_factor * (fin.worth if fin.item.get("unit") == COUNTS else 1.0) for fin in used]
    return {"sum": [{**fin.item, "scale": _rounded(scale)} for fin, scale in zip(used, scales, strict=True)]}


def _angle_factor(used: list[_Fin]) -> float:
    """Return the factor from thrust to an equivalent fin angle in rad, from the largest difference; 1 for fins."""
    if any("unit" in fin.item or not is_thruster(fin.name) for fin in used):
        return 1.0
    largest = float(np.nanmax(np.abs(np.sum([fin.share * (fin.values - np.nanmedian(fin.values)) for fin in used], axis=0))))
    return float(f"{THRUST_RAD / largest:.0e}") if largest > 0.0 else 1.0


def _rounded(value: float) -> float:
    return float(f"{value:.4g}")


def _evidence(signal: str, rate: str, used: list[_Fin], found: FinShares, family: Family) -> Note:
    terms = " ".join(f"{'-' if fin.share < 0.0 else '+'} {_fraction(abs(fin.share))}{fin.name}" for fin in used)
    fitted = f", the best one alone {100 * found.best_alone:.0f} %; fitted {', '.join(f'{fin.fitted:.2g}' for fin in used)}"
    each, more = ("together they explain", fitted) if len(used) > 1 else ("it explains", "")
    message = f"{signal} is {terms.removeprefix('+ ')}: {each} {explains(found.explains, rate)}{more}"
    if found.patterns < len(used):
        ways = "together only" if found.patterns == 1 else f"in {found.patterns} patterns only"
        message += f"; they moved {ways}: how much of it each of them does is not told by this log, and taken by how far it went"
    if _angle_factor(used) != 1.0:
        message += f"; no angles: the largest difference is taken for about {THRUST_RAD:g} rad, and the authority is per that"
    outputs = {"outputs": len(family)} if are_outputs(family) and len(used) == 1 else {}
    return Note("evidence", message, {"signal": signal, "fins": {fin.name: fin.share for fin in used}, **outputs})


def _fraction(share: float) -> str:
    simple = Fraction(share).limit_denominator(12)
    return "" if share == 1.0 else f"{simple} " if abs(float(simple) - share) < 1e-6 else f"{share:.2f} "
