"""From what a reader found to a Run: units, signs, frames, one clock, unwrapped headings, findings."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from fieldsid.errors import LogError, MappingError
from fieldsid.logs.channels import ANGLES, ATTITUDE, ChannelMap, Source
from fieldsid.logs.clock import Track, one_clock
from fieldsid.logs.conditioning import MAX_GAP_S, in_order, refuse_long_gaps
from fieldsid.logs.frames import SWAPPED_BY_WORLD, angles_of_quaternion, to_ned_frd
from fieldsid.logs.reader import RawLog, Series
from fieldsid.logs.run import SIGNALS, FloatArray, Note, Run
from fieldsid.logs.units import depth_of_pressure, factor_to, pick_unit, scaled
from fieldsid.logs.wrapping import unwrapped_over


def assemble(raw: RawLog, mapping: ChannelMap, path: Path | None, *, salvage: bool = False, max_gap_s: float = MAX_GAP_S) -> Run:
    """Return the Run of a raw log; raises LogError or MappingError for what cannot be meant, DataError never."""
    if raw.finished:
        time = next(iter(raw.series.values())).time if raw.series else np.zeros(0)
        return Run(raw.name, time, {s: v.values for s, v in raw.series.items()}, path, raw.notes)
    notes = list(raw.notes)
    tracks: dict[str, Track] = {}
    for signal, series in raw.series.items():
        for name, track in _tracks(signal, series, mapping, notes, salvage=salvage, log=str(path)).items():
            if name in tracks:
                raise MappingError(
                    f"two sources give `{name}`", found=f"{tracks[name].label} and {track.label}", hint=f"map `{name}` once"
                )
            tracks[name] = track
    if not tracks:
        raise MappingError(f"{mapping.place} maps no signal", found="an empty `signals`", hint="see `sysid inspect LOG`")
    if "yaw_rad" in tracks:
        tracks["yaw_rad"], found = unwrapped_over(tracks["yaw_rad"], tracks.get("yaw_rate_rad_s"), mapping.gap_factor)
        notes += found
    time, signals, clock_notes = _on_one_clock(raw, tracks, mapping)
    if time.size < 2:
        raise LogError(f"`{path}` has too few samples", found=f"{time.size} samples", hint="copy the log from the vehicle again")
    signals = {s: signals[s] for s in SIGNALS if s in signals}
    refuse_long_gaps(time, signals, limit_s=max_gap_s, log=str(path))
    return Run(raw.name, time, signals, path, _distinct([*notes, *clock_notes]))


def _on_one_clock(
    raw: RawLog, tracks: Mapping[str, Track], mapping: ChannelMap
) -> tuple[FloatArray, dict[str, FloatArray], list[Note]]:
    if not raw.one_clock:
        return one_clock(tracks, clock=mapping.clock, gap_factor=mapping.gap_factor)
    time = next(iter(tracks.values())).time
    return time, {s: t.values for s, t in tracks.items()}, []


def _tracks(signal: str, series: Series, mapping: ChannelMap, notes: list[Note], *, salvage: bool, log: str) -> dict[str, Track]:
    """Return one source's signals in SI and our frames, their time in order."""
    source = mapping.sources[signal]
    label = series.label.partition(".")[0] if source.topic else "the time column"
    rows, found = in_order(series.time, label, salvage=salvage, log=log)
    notes += found
    picked = Series(series.time[rows], series.values[rows], series.label, series.unit, series.is_height)
    values = _quaternion(signal, picked, source, mapping) if picked.values.ndim == 2 else _scalar(signal, picked, source, mapping)
    return {name: Track(picked.time, v, series.label) for name, v in values.items()}


def _scalar(signal: str, series: Series, source: Source, mapping: ChannelMap) -> dict[str, FloatArray]:
    values = _in_si(signal, series, source, mapping)
    if source.sign < 0:
        values = -values
    frame = source.frame or mapping.frame
    _check_swap(signal, source, mapping)
    name, values = to_ned_frd(signal, values, frame, is_height=series.is_height)
    return {name: values + source.offset if source.offset else values}


def _in_si(signal: str, series: Series, source: Source, mapping: ChannelMap) -> FloatArray:
    unit = source.unit or series.unit
    if unit is None or (signal in ("thrust", "thrust_ratio") and not source.unit):
        return series.values
    if signal == "depth_m" and pick_unit(unit).dimension == "pressure":
        pascal = scaled(series.values, pick_unit(unit).factor)
        return depth_of_pressure(pascal, density=mapping.pressure.density, surface_pa=mapping.pressure.surface_pa)
    return scaled(series.values, factor_to(signal, unit))


def _check_swap(signal: str, source: Source, mapping: ChannelMap) -> None:
    """In ENU, x is east: mapping it alone would give y without saying so."""
    partner = SWAPPED_BY_WORLD.get(signal)
    if partner is None or (source.frame or mapping.frame).world == "NED":
        return
    other = mapping.sources.get(partner)
    if other is None or (other.frame or mapping.frame).world == "NED":
        raise MappingError(
            f"`{signal}` is in ENU and becomes `{partner}`, which is not mapped beside it",
            found=source.label,
            hint=f"map both `x_m` and `y_m` in ENU, or write `frame: NED` at `{signal}`",
        )


def _quaternion(signal: str, series: Series, source: Source, mapping: ChannelMap) -> dict[str, FloatArray]:
    xyzw = series.values if source.order == "xyzw" else series.values[:, [1, 2, 3, 0]]
    angles = dict(zip(ANGLES, angles_of_quaternion(xyzw, source.frame or mapping.frame), strict=True))
    wanted = ANGLES if signal == ATTITUDE else (signal,)
    if signal != ATTITUDE and signal not in ANGLES:
        raise MappingError(f"`{signal}` cannot come from a quaternion", found=series.label, hint="map one number")
    return {n: angles[n] + source.offset if source.offset and n == "yaw_rad" else angles[n] for n in wanted}


def _distinct(notes: list[Note]) -> tuple[Note, ...]:
    return tuple({(n.code, n.message): n for n in notes}.values())
