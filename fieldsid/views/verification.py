"""A verification: margins and steps of a schedule over the identified set, against those of one constant gain."""

from __future__ import annotations

from collections.abc import Iterator
from math import degrees, inf, isnan
from typing import TYPE_CHECKING

from fieldsid.display import Figures, Frames, View
from fieldsid.figures.sketch import sketch
from fieldsid.page import Block, Page, Whole
from fieldsid.records.keys import body_of
from fieldsid.rounding import number
from fieldsid.views._words import table

if TYPE_CHECKING:
    from fieldsid.schedule.check import Check, StepCheck
    from fieldsid.schedule.verify import Verification


def line(found: Verification) -> str:
    """Return the verdict with its numbers."""
    from fieldsid.schedule.verdict import verdict_of

    return ": ".join(verdict_of(found, found.schedule, ()))


def page(found: Verification) -> Page:
    """Return the verdict, and what each speed comes to."""
    title = f"Verification of the {found.schedule.axis.value} schedule, {found.schedule.kind}: {line(found)}"
    return Page(title, (), tuple(blocks_of(found)))


def blocks_of(found: Verification) -> Iterator[Block | str]:
    """Yield the margins and steps of each speed, and the effects of a bent fin, a disturbance and a step of depth."""
    from fieldsid.schedule.verdict import against_constant

    checks = found.scheduled
    small, usual, large = (degrees(step.size) for step in checks[0].steps)
    heads = (
        "m/s", "phase", "least", "dB", "delay", "over", "most", f"{small:.0f}", f"{usual:.0f}", "most", f"{large:.0f}", "const",
        "knot",
    )  # fmt: skip
    rows = tuple(_row(a, b) for a, b in zip(checks, found.constant, strict=True))
    yield Block("deg, dB, s of margin; overshoot %; s to settle by step in deg", rows, heads, left=0)
    if len(found.schedule.rows) > 1:  # the gains of one speed are constant
        yield Whole(against_constant(found))
    bent, unknown = max(abs(c.bent_error) for c in checks), max(abs(c.bent_error_unknown) for c in checks)
    yield f"a fin 3 deg off: steady error {degrees(bent):.2f} deg with the feed-forward, {degrees(unknown):.2f} deg without"
    if found.spread and not found.schedule.rows[0].gains.ki:  # an integral leaves no error of the trim
        off = degrees(max(c.steps[1].off for c in checks))
        yield f"the trim is known so far that a straight course is held to {off:.2f} deg by 95 % of the draws"
    if found.disturbance > 0:
        rms, fin = degrees(max(c.leg_rms for c in checks)), degrees(max(c.leg_fin_rms for c in checks))
        yield f"a straight leg in that disturbance: {rms:.2f} deg rms with {fin:.2f} deg rms of fin"
    slowest = min(checks, key=lambda c: c.speed_least / c.speed)
    if slowest.speed_least < 0.99 * slowest.speed:
        yield f"in the {large:.0f} deg step the speed falls from {slowest.speed:.2f} to {slowest.speed_least:.2f} m/s at most"
    if depth := [c for c in checks if not isnan(c.depth_settling)]:
        over, settle = max(100 * c.depth_overshoot for c in depth), max(c.depth_settling for c in depth)
        yield f"depth step of 2 m: overshoot up to {over:.0f} %, settled within {settle:.0f} s{_path(found)}"


def _path(found: Verification) -> str:
    """Return how far off a depth is held, as the runs tell, or that none tells where a pitch leads to."""
    if not found.path.measured:
        return "; no run has a depth that goes with its pitch and speed: the path is taken as the pitch"
    worst = max(found.scheduled, key=lambda c: abs(c.depth_error))
    pitch, side = degrees(found.path.level_pitch(worst.speed)), "deep" if worst.depth_error > 0.0 else "shallow"
    off = f"{abs(worst.depth_error):.2f} m too {side} at {number(worst.speed, 3)} m/s"
    return f"; a depth is held {off}, where level flight takes a pitch of {pitch:.1f} deg"


def _row(check: Check, constant: Check) -> tuple[str, ...]:
    small, usual, large = check.steps
    gain = "none" if check.gain_least_db == inf else f"{check.gain_least_db:.1f}"
    return (
        number(check.speed, 3),
        f"{check.phase_deg:.0f}",
        f"{check.phase_least_deg:.0f}",
        gain,
        f"{check.delay_least_s:.2f}",
        f"{100 * check.overshoot:.0f}",
        f"{100 * check.overshoot_most:.0f}",
        _settles(small.settling, small),
        _settles(usual.settling, usual),
        _settles(usual.settling_most, usual),
        _settles(large.settling, large),
        _settles(constant.settling, constant.steps[1]),
        "knot" if check.knot else "",
    )


def _settles(seconds: float, step: StepCheck) -> str:
    """Return the settling time in words, or that the step had not settled by the end; empty where it is not known."""
    if isnan(seconds):
        return "-"
    return f"{seconds:.1f}" if seconds != inf else f">{step.flown:.0f}"


def frames(found: Verification) -> Frames:
    """Return the checks of the schedule and those of one constant gain."""
    return {
        "scheduled": lambda: table((body_of(c) for c in found.scheduled), "speed_m_s"),
        "constant": lambda: table((body_of(c) for c in found.constant), "speed_m_s"),
    }


def figures(found: Verification) -> Figures:
    """Return gains and margins over speed, with the steps."""
    return {"steps": sketch("schedule", found.schedule, found)}


VIEW = View("verification", line, page, frames, lambda found: found.schedule.axis.value, figures)
