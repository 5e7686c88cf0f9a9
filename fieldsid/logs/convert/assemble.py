"""Convert the signals that a reader found to a Run: units, signs, frames, one clock, unwrapped headings, findings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from shlex import quote

import numpy as np

from fieldsid.errors import LogError, MappingError
from fieldsid.logs.channels import ATTITUDE, POSITION, ChannelMap, Source
from fieldsid.logs.convert.clock import Track, one_clock, summed
from fieldsid.logs.convert.conditioning import MAX_GAP_S, in_order, possible, refuse_impossible_steps, refuse_long_gaps
from fieldsid.logs.convert.faults.copied_fins import without_copied_fins
from fieldsid.logs.convert.faults.dropouts import SENSED, without_dropouts
from fieldsid.logs.convert.faults.heading_fills import without_fills, without_standing_start
from fieldsid.logs.convert.faults.repeats import measured_anew, note_on_repeats, rows_of, without_repeats
from fieldsid.logs.convert.frames import SWAPPED_BY_WORLD, about_level, angles_of_quaternion, north_and_east, to_ned_frd
from fieldsid.logs.convert.heading_unwrap import unwrapped_over
from fieldsid.logs.convert.servo_counts import counts_unit, turned_from_counts
from fieldsid.logs.convert.units import DEGREE, depth_of_pressure, factor_to, pick_unit, scaled
from fieldsid.logs.few_of import MOSTLY, NEARLY_ALL
from fieldsid.logs.reader import AS_IT_IS, RawLog, ReadOptions, Series
from fieldsid.logs.run import ANGLES, ANGLES_AND_RATES, COLUMNS, COMMANDS, FINS, PART, Note, Run, signal_of
from fieldsid.numerics.arrays import BoolArray, FloatArray

WHOLE = (-np.inf, np.inf)


def part_between(start: float | None, end: float | None) -> tuple[float, float]:
    """Return the part of a log between two times in s; None stands for the start or the end of the log."""
    return (WHOLE[0] if start is None else start, WHOLE[1] if end is None else end)


def assemble(
    raw: RawLog,
    mapping: ChannelMap,
    path: Path | None,
    options: ReadOptions = AS_IT_IS,
    *,
    part: tuple[float, float] = WHOLE,
    max_gap_s: float = MAX_GAP_S,
) -> Run:
    """Return the Run of a raw log between two times in s.

    Raises LogError or MappingError for a log or mapping that cannot be right, DataError where the part is empty. Gaps outside
    of the part are not checked.
    """
    if raw.finished:
        time = next(iter(raw.series.values())).time if raw.series else np.zeros(0)
        run = Run(raw.name, time, {s: v.values for s, v in raw.series.items()}, path, raw.notes)
        return run if part == WHOLE else run.between(*part)
    raw = _split_by_sensor(raw)
    notes = list(raw.notes)
    tracks = summed(_tracks_by_signal(raw, mapping, notes, options), mapping.gap_factor)
    if not tracks:
        raise MappingError(
            f"{mapping.place} maps no signal", found="an empty `signals`", hint=f"map one of those that {_inspect(path)} shows"
        )
    tracks = _without_faults(tracks, mapping, notes)
    time, signals, found = _on_one_clock(raw, tracks, mapping)
    notes += found
    if time.size < 2:
        counted = _counted(time, notes)
        raise LogError(f"`{path}` has too few samples", found=counted, hint=f"{_inspect(path)} shows what is in it")
    signals, copies = without_copied_fins({s: signals[s] for s in COLUMNS if s in signals})
    notes += copies
    run = Run(raw.name, time, signals, path, tuple({(n.code, n.message): n for n in notes}.values()))
    run = run if part == WHOLE else run.between(*part)
    refuse_long_gaps(run.time, run.signals, options, limit_s=max_gap_s)
    return run


def _tracks_by_signal(raw: RawLog, mapping: ChannelMap, notes: list[Note], options: ReadOptions) -> dict[str, Track]:
    """Return the signals of a raw log in SI, NED and FRD; append to `notes`. Raises MappingError where two sources give one."""
    tracks: dict[str, Track] = {}
    for signal, series in raw.series.items():
        for name, track in _tracks(signal, series, mapping, notes, options).items():
            if name in tracks:
                found = f"{tracks[name].label} and {track.label}"
                raise MappingError(f"two sources give `{name}`", found=found, hint=f"map `{name}` once", signal=name)
            tracks[name] = track
    return tracks


def _without_faults(tracks: dict[str, Track], mapping: ChannelMap, notes: list[Note]) -> dict[str, Track]:
    """Return tracks in which what is no measurement is missing, with continuous angles; append to `notes` what was found."""
    tracks, found = without_standing_start(tracks) if "yaw_rad" in tracks else (dict(tracks), [])
    notes += found
    for name in [n for n in tracks if n in SENSED]:
        values, repeats = without_repeats(name, tracks[name].values)
        values, dropouts = without_dropouts(name, values)
        tracks[name] = replace(tracks[name], values=values)
        notes += repeats + dropouts
    if "yaw_rad" in tracks:
        tracks["yaw_rad"], fills = without_fills(tracks["yaw_rad"])
        tracks["yaw_rad"], lines = unwrapped_over(tracks["yaw_rad"], tracks.get("yaw_rate_rad_s"), mapping.gap_factor)
        notes += fills + lines
    for name in {"roll_rad", "pitch_rad"} & tracks.keys():
        tracks[name] = replace(tracks[name], values=about_level(tracks[name].values))
    return tracks


def _counted(time: FloatArray, notes: Sequence[Note]) -> str:
    """Return in words how many samples have a time, and why others were left out."""
    left_out = "; ".join(n.message for n in notes if n.code == "time_order")
    counted = f"{time.size} sample{'s' * (time.size != 1)} with a time, at least 2 are needed"
    return f"{counted}; {left_out}" if left_out else counted


def _inspect(path: Path | None) -> str:
    return f"`sysid inspect {'LOG' if path is None else quote(str(path))}`"


def _split_by_sensor(raw: RawLog) -> RawLog:
    """Return a log whose table has a separate row for each sensor's reading with a clock for each signal; others unchanged.

    Most cells of such a table are blank. A table with one row for all sensors also has blanks, where a sensor is slower or fails,
    but there the numbers of the slower sensor are in rows in which the faster one has a number too. In a table of separate rows
    most are not, so that the times of the rows are the clock of no sensor. The cells may be filled with the last number instead.
    """
    seen = {signal: _rows_of(signal, series) for signal, series in raw.series.items()}
    filled = {signal: rows for signal, rows in seen.items() if rows.any()}
    if not raw.one_clock or not filled or all(rows.all() for rows in filled.values()):
        return raw
    base = max([s for s in (ATTITUDE, *ANGLES_AND_RATES) if s in filled] or filled, key=lambda s: int(filled[s].sum()))
    if all((rows & filled[base]).sum() >= MOSTLY * rows.sum() for rows in filled.values()):
        return raw
    series = {
        s: replace(raw.series[s], time=raw.series[s].time[rows], values=raw.series[s].values[rows]) for s, rows in filled.items()
    }
    numbers = {s: int(rows_of(raw.series[s].values).sum()) for s in filled}
    repeats = tuple(note_on_repeats(s, rows, raw.series[s].values) for s, rows in filled.items() if rows.sum() < numbers[s])
    return replace(raw, series=series, notes=(*raw.notes, *repeats), one_clock=False)


def _rows_of(signal: str, series: Series) -> BoolArray:
    """Return a mask (n,) of the rows in which a signal has a number, without those in which a measured one only repeats it.

    A fin of which NEARLY_ALL numbers are equal to the last is at rest, and not repeated.
    """
    numbers = rows_of(series.values)
    if signal_of(signal) in COMMANDS:
        return numbers
    own = measured_anew(series.values)
    return numbers if signal_of(signal) in FINS and own.sum() < (1.0 - NEARLY_ALL) * numbers.sum() else own


def _on_one_clock(
    raw: RawLog, tracks: Mapping[str, Track], mapping: ChannelMap
) -> tuple[FloatArray, dict[str, FloatArray], list[Note]]:
    if not raw.one_clock:
        return one_clock(tracks, clock=mapping.clock, gap_factor=mapping.gap_factor)
    time = next(iter(tracks.values())).time
    return time, {s: t.values for s, t in tracks.items()}, []


def _tracks(signal: str, series: Series, mapping: ChannelMap, notes: list[Note], options: ReadOptions) -> dict[str, Track]:
    """Return the signals of one source in SI, NED and FRD, with increasing times; append to `notes` what was found."""
    source = mapping.sources[signal]
    label = series.label.partition(".")[0] if source.topic else "the time column"
    rows, found = in_order(series.time, label, options)
    notes += found
    # Indexing with all rows would still copy them, once for each signal of a long log.
    is_complete = rows.size == series.time.size
    picked = series if is_complete else replace(series, time=series.time[rows], values=series.values[rows])
    refuse_impossible_steps(picked.time, label)
    with np.errstate(over="ignore", invalid="ignore"):
        convert = _position if signal == POSITION else _quaternion if picked.values.ndim == 2 else _scalar
        counted = counts_unit(signal, source.unit or series.unit)
        if counted is not None:
            angles, found = turned_from_counts(signal, picked.values, counted, source.centre, source.scale)
            picked, source = replace(picked, values=angles, unit=None), replace(source, unit=None, scale=None)
            notes += found
        values = {name: possible(name, v) for name, v in convert(signal, picked, source, mapping).items()}
    notes += [note for _, found in values.values() for note in found]
    return {name: Track(picked.time, v, series.label) for name, (v, _) in values.items()}


def _scalar(signal: str, series: Series, source: Source, mapping: ChannelMap) -> dict[str, FloatArray]:
    values = _in_si(signal, series, source, mapping)
    if source.sign < 0:
        values = -values
    frame = source.frame or mapping.frame
    _check_swap(signal, source, mapping)
    name, values = to_ned_frd(signal, values, frame, is_height=series.is_height)
    if PART in signal and source.scale is not None:
        values = scaled(values, source.scale)
    return {name: values + source.offset if source.offset else values}


def _in_si(signal: str, series: Series, source: Source, mapping: ChannelMap) -> FloatArray:
    unit = source.unit or series.unit
    if unit is None or (signal in ("thrust", "thrust_ratio") and not source.unit):
        return series.values
    if signal == "depth_m" and pick_unit(unit).dimension == "pressure":
        pascal = scaled(series.values, pick_unit(unit).factor)
        return depth_of_pressure(pascal, density=mapping.pressure.density, surface_pa=mapping.pressure.surface_pa)
    # The scale of a term of a sum converts its number, in whatever unit, to the unit of the sum.
    factor = pick_unit(unit).factor if PART in signal and source.scale is not None else factor_to(signal_of(signal), unit)
    return scaled(series.values, factor)


def _check_swap(signal: str, source: Source, mapping: ChannelMap) -> None:
    """Raise MappingError where only one of x and y is mapped in ENU: x is east there, and would silently become y."""
    partner = SWAPPED_BY_WORLD.get(signal)
    if partner is None or (source.frame or mapping.frame).world == "NED":
        return
    other = mapping.sources.get(partner)
    if other is None or (other.frame or mapping.frame).world == "NED":
        raise MappingError(
            f"`{signal}` is in ENU and becomes `{partner}`, which is not mapped beside it",
            found=source.label,
            hint=f"map both `x_m` and `y_m` in ENU, or write `frame: NED` at `{signal}`",
            signal=signal,
        )


def _quaternion(signal: str, series: Series, source: Source, mapping: ChannelMap) -> dict[str, FloatArray]:
    xyzw = series.values if source.order == "xyzw" else series.values[:, [1, 2, 3, 0]]
    angles = dict(zip(ANGLES, angles_of_quaternion(xyzw, source.frame or mapping.frame), strict=True))
    wanted = ANGLES if signal == ATTITUDE else (signal,)
    if signal != ATTITUDE and signal not in ANGLES:
        hint = f"name one number: `{source.path}.x`" if source.topic else "map one number"
        raise MappingError(f"`{signal}` cannot come from a quaternion", found=series.label, hint=hint, signal=signal)
    return {n: angles[n] + source.offset if source.offset and n == "yaw_rad" else angles[n] for n in wanted}


def _position(signal: str, series: Series, source: Source, mapping: ChannelMap) -> dict[str, FloatArray]:
    factor = 1.0 if source.unit is None else pick_unit(source.unit, ("angle",), "`position`").factor / DEGREE
    degrees = scaled(series.values, factor)
    return dict(zip(("x_m", "y_m"), north_and_east(degrees), strict=True))
