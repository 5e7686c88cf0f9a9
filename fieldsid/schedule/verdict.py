"""The result of a verification in words: gates, the verdict with its number, and the data and assumptions behind it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from math import degrees, inf, isfinite
from typing import Annotated

from fieldsid.models.axis import Axis
from fieldsid.plant.parameter_source import ParameterSource
from fieldsid.records.keys import Key, Number
from fieldsid.rounding import number, number_against
from fieldsid.schedule.check import READ_OFF, Check, StepCheck
from fieldsid.schedule.controller import HELD_SHARE
from fieldsid.schedule.flown.response import steady_error, swing
from fieldsid.schedule.record import Schedule
from fieldsid.schedule.verify import AT_REST_SHARE, DEPTH_STEP_M, Verification, steps_of
from fieldsid.turning.prediction import MAX_LISTED

UNSTABLE = "the hull alone is unstable: it may take up to twice as long to settle"
"""The worst of the hulls of `tests/truth/gain_table.py` settled in 19.3 s where 9.7 s were predicted."""


@dataclass(frozen=True, slots=True)
class Gate:
    """A required limit of one number: its name with unit, the limit, the number found and its speed (m/s)."""

    name: Annotated[str, Key("Its name.", "gate")]
    wanted: Annotated[float, Key("The limit.")]
    found: Annotated[Number, Key("What was found.")]
    speed: Annotated[Number, Key("The speed it was found at.", "speed_m_s")]
    at_least: bool

    @property
    def passed(self) -> Annotated[bool, Key()]:
        """Whether the number is on the right side of its limit."""
        return self.found >= self.wanted if self.at_least else self.found <= self.wanted

    @property
    def says(self) -> str:
        """The gate in words."""
        side = "least" if self.at_least else "most"
        found = number_against(self.found, self.wanted)
        return f"{self.name} {found} at {number(self.speed, 3)} m/s, wanted at {side} {self.wanted:.3g}"


def gates_of(checked: Verification, wanted: Mapping[str, float | None]) -> tuple[Gate, ...]:
    """Return the gates among the names of `Verification.worst` that have a limit."""
    gates = []
    for name, limit in wanted.items():
        if limit is not None:
            weakest, (sign, read) = checked.weakest(name), READ_OFF[name]
            gates.append(Gate(name, limit, read(weakest), weakest.speed, sign > 0))
    return tuple(gates)


def verdict_of(checked: Verification, schedule: Schedule, gates: tuple[Gate, ...]) -> tuple[str, str]:
    """Return the verdict and its numbers in words: `passed` or FAILED with gates, `holds` or `does not hold` without."""
    faults = _faults(checked, schedule)
    failed = [g.says for g in gates if not g.passed]
    if failed:
        return "FAILED", "; ".join([*failed, *faults])
    if gates:
        return "passed", "; but ".join(["; ".join(g.says for g in gates), *faults])
    if faults:
        return "does not hold", "; ".join(faults)
    weakest = checked.weakest("phase_margin_deg")
    margin = f"least phase margin {number(weakest.phase_least_deg, 3)} deg at {number(weakest.speed, 3)} m/s"
    return "holds", f"{margin}; {_settles(checked, degrees(steps_of(schedule)[1]))}"


def _settles(checked: Verification, step: float) -> str:
    """Return the longest settling time of a step (deg) over the speeds in words, of the estimate and of the draws."""
    slowest = max(c.settling for c in checked.scheduled)
    latest = max(slowest, *(c.settling_most for c in checked.scheduled))  # a draw is measured to where it comes to rest
    most, longest = f"{100 * HELD_SHARE:.0f} % of the draws", f"{_longest(checked):.0f} s"
    by_draws = f"within {latest:.1f} s by {most}" if isfinite(latest) else f"by fewer than {most} within {longest}"
    return f"a {step:.0f} deg step settles within {slowest:.1f} s at every speed" + (f", {by_draws}" if checked.spread else "")


def _faults(checked: Verification, schedule: Schedule) -> list[str]:
    """Return why the loop does not hold, in words, independent of the gates."""
    weakest, found = checked.weakest("phase_margin_deg"), []
    if weakest.phase_least_deg <= 0.0:
        of = f" by {weakest.unstable} of the draws" if checked.spread else ""
        found.append(f"unstable at {number(weakest.speed, 3)} m/s{of}, phase margin {number(weakest.phase_least_deg, 3)} deg")
    elif (hunting := next((c for c in checked.scheduled if c.hunts), None)) and (after := hunting.hunts):
        words = "diverges" if not isfinite(after.swing) else f"still swings by {degrees(after.swing * after.size):.1f} deg"
        drawn = " by some draws of the models' errors, not by the estimate" if checked.spread and isfinite(after.settling) else ""
        found.append(f"at {number(hunting.speed, 3)} m/s the loop {words} after a {degrees(after.size):.0f} deg step{drawn}")
    worst = min(schedule.rows, key=lambda r: r.draws_held)
    if worst.draws_held < HELD_SHARE and not found and checked.spread:
        found.append(f"at {number(worst.speed, 3)} m/s it holds {100 * worst.draws_held:.0f} % of the draws it was designed on")
    found.extend(_unsettled(checked))
    deepest = max((c for c in checked.scheduled if schedule.depth), key=lambda c: c.depth_settling, default=None)
    if deepest is not None and not isfinite(deepest.depth_settling):
        where = f"at {number(deepest.speed, 3)} m/s a {DEPTH_STEP_M:.0f} m depth step"
        found.append(f"{where} is not within 5 % after {deepest.depth_flown:.0f} s")
    return found


def _unsettled(checked: Verification) -> Iterator[str]:
    """Yield a sentence on the smallest step after which the estimate does not settle: at the speed of the largest error."""
    for i in range(3):
        unsettled = [
            (abs(float(steady_error(flown.scheduled[i].angle, check.steps[i].size)[0])), check, flown.scheduled[i])
            for check, flown in zip(checked.scheduled, checked.flown, strict=True)
            if check.steps[i].settling == inf
        ]
        if unsettled:
            off, check, flight = max(unsettled, key=lambda at: at[0])
            step = check.steps[i]
            rests = float(swing(flight.angle, step.size)[0]) <= AT_REST_SHARE
            where = f": it is still {number(degrees(off), 2)} deg off" if rests else ""
            size = f"{degrees(step.size):.0f} deg step"
            yield f"at {number(check.speed, 3)} m/s a {size} is not within 5 % after {step.flown:.0f} s{where}"
            return


def against_constant(checked: Verification) -> str:
    """Return in words how the schedule compares with the best constant gain, by the objective of the design.

    The times are those of the table: settling of the standard step by the estimate.
    """
    row = checked.constant_row.gains
    named = ", ".join(f"{n} {number(v, 3)}" for n, v in (("kp", row.kp), ("ki", row.ki), ("kd", row.kd)) if v or n == "kp")
    failing = next((c for c in checked.constant if not c.outcome.serves), None)
    pairs = list(zip(checked.scheduled, checked.constant, strict=True))
    if checked.worse:
        where = ", ".join(number(speed, 3) for speed in checked.worse)
        own, one = next(pair for pair in pairs if pair[0].speed == checked.worse[0])
        return f"one constant gain, {named}, is better at {where} m/s: {_at(own, one)}"
    if failing is not None and all(c.outcome.serves for c in checked.scheduled):
        return f"no one gain for all speeds keeps what was asked: the best, {named}, does not at {number(failing.speed, 3)} m/s"
    own, one = max(pairs, key=lambda pair: pair[1].outcome.fin / pair[0].outcome.fin)
    ours, theirs = (max((c.steps[1] for c in part), key=lambda s: s.settling) for part in (checked.scheduled, checked.constant))
    slowest = f"the slowest {degrees(ours.size):.0f} deg step settles {_when(ours)} with the schedule, {_when(theirs)} with it"
    fins = f"{100.0 * one.outcome.fin:.0f} % of the fin with it, {100.0 * own.outcome.fin:.0f} % with the schedule"
    return f"against the best constant gain, {named}: {slowest}; at {number(own.speed, 3)} m/s it asks for {fins}"


def _at(own: Check, one: Check) -> str:
    """Return settling time and fin use of the standard step at one speed, with schedule and constant gain, in words."""
    ours, theirs = (f"{_when(c.steps[1])} for {100.0 * c.outcome.fin:.0f} % of the fin" for c in (own, one))
    short = " and less than was asked" if one.outcome.serves and not own.outcome.serves else ""
    size = f"{degrees(own.steps[1].size):.0f} deg step"
    return f"at {number(own.speed, 3)} m/s a {size} settles {ours}{short} with the schedule, {theirs} with it"


def _when(step: StepCheck) -> str:
    """Return the settling time of a step by the estimate, in words."""
    return f"in {step.settling:.1f} s" if isfinite(step.settling) else f"not in {step.flown:.0f} s"


def _longest(checked: Verification) -> float:
    """Return the least simulated time (s) of the standard steps that 95 % of the draws do not settle from."""
    return min((c.steps[1].flown for c in checked.scheduled if not isfinite(c.settling_most)), default=0.0)


def rests_on(checked: Verification, schedule: Schedule, source: ParameterSource) -> str:
    """Return what a verification is based on, in words: models, their errors, speeds, fin, disturbance."""
    names = source.names or tuple(p.name for p in source.paths)
    named = ", ".join(names[:MAX_LISTED]) + (f" and {len(names) - MAX_LISTED} more" if len(names) > MAX_LISTED else "")
    effects = sorted({e for m in source.models for e in m.effects})
    errors = f"{checked.draws} draws of {checked.draws_of}" if checked.spread else "no errors stated, the estimate alone"
    speeds = [c.speed for c in checked.scheduled]
    beyond = sum(not c.supported for c in checked.scheduled)
    disturbance = (
        f"disturbance {number(checked.disturbance, 2)} rad/s^2 as in the runs" if checked.disturbance > 0 else "no disturbance"
    )
    limit = number(min(r.fin_limit for r in schedule.rows), 3)
    return "; ".join(
        (
            f"rests on {named} with {', '.join(effects) or 'no effects'}",
            errors,
            (f"{len(speeds)} speeds, {number(min(speeds), 3)} .. " if len(speeds) > 1 else "")
            + f"{number(max(speeds), 3)} m/s"
            + (f", {beyond} of them beyond the data" if beyond else ""),
            f"fin {limit} rad, {fin_of(checked.actuator)}",
            checked.speed_lost,
            disturbance,
            *([UNSTABLE] if checked.unstable else []),
            *_extrapolated(checked),
            *_beyond_fin(checked),
            *left_out_of(source),
        )
    )


def _extrapolated(checked: Verification) -> list[str]:
    """Return a sentence on the steps that turn more tightly than the runs, whose forces were not measured; empty without such."""
    if checked.extrapolated is None:
        return []
    size, covered = checked.extrapolated
    step = f"a {degrees(size):.0f} deg step turns tighter than any run, which held {100 * covered:.0f} % of its curvature"
    if not checked.unsaid:
        return [f"{step}: how it settles is extrapolated until a turn that tight is flown"]
    large = f"a {degrees(steps_of(checked.schedule)[2]):.0f} deg step"
    why = "the hull alone is unstable, and what its fin does against such a turn was not measured"
    return [f"{step}: {why}; how {large} settles is not said (`-`) until a turn that tight is flown"]


def _beyond_fin(checked: Verification) -> list[str]:
    """Return a sentence on the speeds at which the fin cannot hold the large step of pitch; empty without such."""
    if checked.schedule.axis is not Axis.PITCH or not checked.unsaid:
        return []
    speeds = [c.speed for c in checked.scheduled if not c.steps[2].said]
    where = " .. ".join(number(speed, 3) for speed in dict.fromkeys((min(speeds), max(speeds))))
    return [f"a {degrees(steps_of(checked.schedule)[2]):.0f} deg step takes more than the fin at {where} m/s: not said (`-`)"]


def fin_of(actuator: Mapping[str, float | None]) -> str:
    """Return lag, delay and rate limit in words."""
    lag, delay, rate = (actuator[name] for name in ("lag_s", "delay_s", "fin_rate_rad_s"))
    late = actuator.get("latency_s") or 0.0
    fastest = "no rate limit" if rate is None or not isfinite(rate) else f"at most {number(rate, 3)} rad/s"
    own = f", autopilot's latency {number(late, 3)} s" if late else ""
    return f"lag {number(lag, 3)} s, delay {number(delay, 3)} s{own}, {fastest}"


def left_out_of(source: ParameterSource) -> tuple[str, ...]:
    """Return in words the models that a source leaves out, or that a table cannot have effects."""
    if not source.models:
        return ("a table carries no effects",)
    return (f"left out, its fin's sign not known: {', '.join(source.left_out)}",) if source.left_out else ()
