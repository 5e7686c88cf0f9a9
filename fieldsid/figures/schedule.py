"""A schedule: gains, feed-forward and margins over speed with the requirements; steps, their fin, a straight leg."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from fieldsid.figures.motion import level
from fieldsid.figures.panel import Band, Panel, Picture, Series
from fieldsid.numerics.arrays import FloatArray
from fieldsid.schedule.flown.response import FLIGHT_S, FLOWN_TIMES, Steps
from fieldsid.schedule.record import Schedule
from fieldsid.schedule.search.objective import DRAWS_MARGIN_SHARE, ROUNDING
from fieldsid.schedule.verify import Verification, steps_of

SHOWN_SHARE = FLOWN_TIMES / FLIGHT_S
"""Share of a flight that is shown: a satisfactory step has settled by then."""
LEAST_SCALE_DEG = 1.0
"""Least range of the scale of a feed-forward or a straight leg, deg: the neutral position of a fin is not set more accurately."""
SPEED = "speed, m/s"


def figure(schedule: Schedule, verification: Verification) -> Picture:
    """Return gains, feed-forward, margins and a leg in the disturbance, if any, at the left; steps and fin at the right."""
    checks, flown = verification.scheduled, verification.flown
    speeds = np.array([c.speed for c in checks])
    margins = {
        "estimate": (speeds, np.array([c.phase_deg for c in checks])),
        "least over the set": (speeds, np.array([c.phase_least_deg for c in checks])),
    }
    left = [*gains(schedule), margin(schedule, margins)]
    if verification.disturbance > 0:
        left.append(leg(verification))
    kp = f"{verification.constant_row.gains.kp:.3g}"
    title = f"{schedule.axis.value}, {schedule.kind}; steps to the later side, thin: one constant gain, kp = {kp}"
    until = SHOWN_SHARE * max(f.pace.flight for f in flown)
    right = [steps(verification, i, size, until) for i, size in enumerate(steps_of(schedule))]
    return Picture(title, (12.0, 11.0), (left, (*right, fin(schedule, verification, until))), (1.0, 1.15))


def gains_figure(schedule: Schedule) -> Picture:
    """Return gains, feed-forward and the phase margin of the draws over speed, one above the other."""
    return Picture(f"{schedule.axis.value}, {schedule.kind}: gains per speed", (8.0, 8.0), (panels(schedule),))


def panels(schedule: Schedule) -> tuple[Panel, ...]:
    """Return gains, feed-forward and the phase margin of the draws over speed."""
    phase = np.array(schedule.speeds), np.array(schedule.column("phase_margin_deg"))
    return (*gains(schedule), margin(schedule, {"least over the draws": phase}))


def gains(schedule: Schedule) -> Iterator[Panel]:
    """Yield the gains against speed, and the feed-forward in degrees of fin, on a scale no finer than the accuracy of a fin.

    Rows that data do not support are hollow.
    """
    for label, name, kind in (("kp, rad/rad", "kp", "simulated"), ("ki, 1/s", "ki", "second"), ("kd, s", "kd", "third")):
        values = np.array(schedule.column(name))
        if np.any(values):
            yield Panel(label, _rows(schedule, values, kind, name), from_zero=True)
    values = np.degrees(np.array(schedule.column("feed_forward_rad")))
    low, high = min(0.0, float(values.min())), max(0.0, float(values.max()))
    spare = 0.15 * (high - low)
    limits = min(low - spare, -LEAST_SCALE_DEG), max(high + spare, LEAST_SCALE_DEG)
    yield Panel("feed-forward, deg", _rows(schedule, values, "fourth", "feed-forward"), limits=limits)


def _rows(schedule: Schedule, values: FloatArray, kind: str, name: str) -> tuple[Series, ...]:
    speeds, known = np.array(schedule.speeds), np.array(schedule.column("supported"), dtype=bool)
    marks = ((known, "points", ""), (~known, "rings", "not supported by data"))
    dots = (Series(speeds[rows], values[rows], kind, says, form) for rows, form, says in marks if rows.any())
    return (Series(speeds, values, kind, name), *dots)


def margin(schedule: Schedule, found: Mapping[str, tuple[FloatArray, FloatArray]]) -> Panel:
    """Return phase margins over speed, by their names, with that required at the estimate and that required over the draws."""
    lines = list(zip(found.items(), ("second", "simulated"), strict=False))
    series = [Series(x, y, kind, name) for (name, (x, y)), kind in lines]
    series += [Series(x, y, kind, form="points") for (_, (x, y)), kind in lines]
    asked = schedule.phase_margin_deg
    speeds = np.concatenate([x for x, _ in found.values()])
    required = level(speeds, asked, "asked"), level(speeds, DRAWS_MARGIN_SHARE * asked, "of 95 % of the draws", "fin")
    return Panel("phase margin, deg", (*series, *required), from_zero=True, x=SPEED)


def steps(verification: Verification, index: int, size: float, until: float) -> Panel:
    """Return a step (rad) at every speed for `until` s, from slow to fast, with the 5 % corridor; thin with one constant gain."""
    end, angle = np.array([0.0, until]), float(np.degrees(size))
    corridor = Band(end, np.full(2, 0.95 * angle), np.full(2, 1.05 * angle), "measured")
    flights = [(f.speed, f.constant[index], f.scheduled[index]) for f in verification.flown]
    series = _pairs(flights, until, "angle")
    return Panel(f"{angle:.0f}° step, deg", series, (corridor,), limits=(-0.1 * angle, 1.4 * angle))


def fin(schedule: Schedule, verification: Verification, until: float) -> Panel:
    """Return the fin in the standard step, thin in the large one, for `until` s, with its limits and how long it is at them."""
    limit, flights = (
        max(schedule.column("fin_limit_rad")),
        [(f.speed, f.scheduled[2], f.scheduled[1]) for f in verification.flown],
    )
    at_stop = max(float(np.mean(np.abs(s.fin[:, 0]) >= (1.0 - ROUNDING) * limit)) * float(s.time[-1]) for _, s, _ in flights)
    _, usual, large = np.degrees(steps_of(schedule))
    edges = (level(np.array([0.0, until]), float(np.degrees(sign * limit)), kind="fin") for sign in (-1.0, 1.0))
    title = f"fin in the {usual:.0f}° step, thin in the {large:.0f}° step: at its limit for up to {at_stop:.1f} s"
    return Panel("fin, deg", (*_pairs(flights, until, "fin"), *edges), x="time, s", title=title)


def _pairs(flights: Sequence[tuple[float, Steps, Steps]], until: float, what: str) -> list[Series]:
    """Return angle or fin of two flights at each speed, the first of them thin; the slowest and the fastest are named."""
    series, ends = [], (flights[0][0], flights[-1][0])
    for (speed, thin, own), colour in zip(flights, _colours([f[0] for f in flights]), strict=True):
        name = f"{speed:.2f} m/s" if speed in ends else ""
        for flight, is_thin in ((thin, True), (own, False)):
            keep = flight.time <= until
            values = np.degrees(getattr(flight, what)[keep, 0])
            series.append(Series(flight.time[keep], values, colour, "" if is_thin else name, thin=is_thin))
    return series


def leg(verification: Verification) -> Panel:
    """Return the angle of a straight leg at every speed, in the disturbance the models' runs had."""
    colours = _colours([f.speed for f in verification.flown])
    series = [
        Series(f.leg.time, np.degrees(f.leg.angle[:, 0]), colour, thin=True)
        for f, colour in zip(verification.flown, colours, strict=True)
    ]
    most = max(1.1 * max(float(np.abs(s.y).max()) for s in series), LEAST_SCALE_DEG)
    title = f"straight leg in a disturbance as the runs had, up to {verification.disturbance:.2g} rad/s² rms"
    return Panel("straight leg, deg", series, limits=(-most, most), x="time, s", title=title)


def _colours(speeds: Sequence[float]) -> list[str]:
    """Return a colour for each speed, dark to light from slow to fast."""
    span = float(np.ptp(speeds)) or 1.0
    shares = [(speed - min(speeds)) / span for speed in speeds]
    parts = [(0.05 + 0.85 * s, 0.25 + 0.25 * s, 0.60 - 0.5 * s) for s in shares]
    return ["#" + "".join(f"{round(255 * v):02x}" for v in rgb) for rgb in parts]
