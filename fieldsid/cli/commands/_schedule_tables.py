"""What `sysid schedule` prints below its verdict: the rows of gains, and how they were flown."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from fieldsid.cli.console import print_file, table
from fieldsid.cli.voice import shown_in

if TYPE_CHECKING:
    from rich.console import Console

    from fieldsid.plant.parameter_source import ParameterSource
    from fieldsid.schedule.check import Check, StepCheck
    from fieldsid.schedule.record import Schedule
    from fieldsid.schedule.verify import Verification

SLOWED_SHARE = 0.995
"""Below it a row's share is not printed as 1.00."""


def render_design(to: Console, schedule: Schedule, source: ParameterSource, body: Mapping[str, Any]) -> None:
    """Print the gains of each speed, and what they were designed with."""
    from math import degrees, isfinite

    from fieldsid.rounding import number
    from fieldsid.schedule.verdict import fin_of, lost
    from fieldsid.schedule.verify import steps_of

    (times, angle), extra = shown_in("rad"), ("kz",) if schedule.depth else ()
    rows = [
        (
            number(r.speed, 3),
            number(r.gains.kp),
            number(r.gains.ki, 3),
            number(r.gains.kd, 3),
            number(times * r.feed_forward, 3),
            number(times * r.fin_limit, 3),
            *((number(r.depth_gain, 3),) if schedule.depth else ()),
            f"{100 * r.fin_use:.0f}%",
            f"{r.phase_margin_deg:.0f}",
            f"{r.settling:.1f}" if isfinite(r.settling) else "never",
            f"{100 * r.draws_held:.0f}%",
            "yes" if r.supported else "no",
        )
        for r in schedule.rows
    ]
    columns = ("m/s", "kp", "ki", "kd", "forward", "fin", *extra, "asks", "phase", "settle s", "held", "data")
    to.print(table(f"{schedule.axis.value}, {schedule.kind}: gains per speed, forward and fin in {angle}", columns, rows, left=0))
    to.print(f"signs: {schedule.provenance['sign_convention']}")
    counted = (fin_of(schedule.actuator), str(schedule.provenance["speed_lost"]), *lost(source))
    to.print(f"counted with: {'; '.join(counted)}")
    for binds in dict.fromkeys(r.binds for r in schedule.rows):
        to.print(f"bound by {binds}: {', '.join(number(r.speed, 3) for r in schedule.rows if r.binds == binds)} m/s")
    drawn = f"{schedule.provenance['draws']} draws of {schedule.provenance['draws_of']}"
    to.print(
        f"asks: of the fin by a {degrees(steps_of(schedule)[1]):.0f} deg step; phase, settle: the worst of 95 % of {drawn}; "
        "held: those that come to rest from that step"
    )
    if rejected := schedule.provenance["draws_rejected"]:
        to.print(f"up to {100 * rejected:.0f} % of the draws were rejected as outside what is physical, and drawn anew")
    slowed = [r for r in schedule.rows if r.slowed < SLOWED_SHARE]
    if slowed:
        to.print(
            f"{len(slowed)} of {len(schedule.rows)} rows were slowed for lag, delay, margin or the draws (1 is the formula's)"
        )
    if body["file"]:
        to.print(f"schedule: {body['file']}", soft_wrap=True)


def render_verify(to: Console, checked: Verification, body: Mapping[str, Any]) -> None:
    """Print the margins and steps of each speed, and what a bent fin, a disturbance and a step of depth do."""
    from math import degrees

    small, usual, large = (degrees(step.size) for step in checked.scheduled[0].steps)
    columns = (
        "m/s", "phase", "least", "dB", "delay", "over", "most", f"{small:.0f}", f"{usual:.0f}", "most", f"{large:.0f}", "const",
        "knot",
    )  # fmt: skip
    rows = [_verify_row(a, b) for a, b in zip(checked.scheduled, checked.constant, strict=True)]
    to.print(table("deg, dB, s of margin; overshoot %; s to settle by step in deg", columns, rows, left=0))
    to.print(body["against_constant"], soft_wrap=True)
    bent = max(abs(c.bent_error) for c in checked.scheduled)
    unknown = max(abs(c.bent_error_unknown) for c in checked.scheduled)
    to.print(f"a fin 3 deg off: steady error {degrees(bent):.2f} deg with the feed-forward, {degrees(unknown):.2f} deg without")
    if checked.spread:
        off = max(c.steps[1].off for c in checked.scheduled)
        to.print(f"the trim is known so far that a straight course is held to {degrees(off):.2f} deg by 95 % of the draws")
    if checked.disturbance > 0:
        rms, fin = max(c.leg_rms for c in checked.scheduled), max(c.leg_fin_rms for c in checked.scheduled)
        to.print(f"a straight leg in that disturbance: {degrees(rms):.2f} deg rms with {degrees(fin):.2f} deg rms of fin")
    slowest = min(checked.scheduled, key=lambda c: c.speed_least / c.speed)
    if slowest.speed_least < 0.99 * slowest.speed:
        to.print(f"in the {large:.0f} deg step the speed falls from {slowest.speed:.2f} to {slowest.speed_least:.2f} m/s at most")
    depth = [c for c in checked.scheduled if c.depth_settling == c.depth_settling]
    if depth:
        over, settle = max(100 * c.depth_overshoot for c in depth), max(c.depth_settling for c in depth)
        to.print(f"depth step of 2 m: overshoot up to {over:.0f} %, settled within {settle:.0f} s")
    for gate in body["gates"] if not body["passed"] else ():
        if gate["passed"]:
            to.print(f"passed: {gate['gate']} {gate['found']:.3g}, wanted {gate['wanted']:.3g}")
    if body["figure"]:
        to.print(f"figure: {body['figure']}", soft_wrap=True)


def _verify_row(check: Check, constant: Check) -> tuple[str, ...]:
    from fieldsid.rounding import number

    small, usual, large = check.steps
    gain = "none" if check.gain_least_db == float("inf") else f"{check.gain_least_db:.1f}"
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
    """Return how long a step takes to settle; that it was flown so long in vain; nothing where it is not said."""
    from math import isnan

    if isnan(seconds):
        return "-"
    return f"{seconds:.1f}" if seconds != float("inf") else f">{step.flown:.0f}"


def render_export(to: Console, body: Mapping[str, Any]) -> None:
    """Print the file written, or the text where there is none."""
    if body["file"]:
        print_file(to, body["difference"])
        to.print(f"exported: {body['file']}" + (f"; as it was: {body['backup']}" if body["backup"] else ""), soft_wrap=True)
    else:
        print_file(to, body["text"])
