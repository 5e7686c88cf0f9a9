"""The proposal of a mapping for a log without one, from names, message types and numbers, tested by reading the log."""

from __future__ import annotations

import math
from dataclasses import replace

from fieldsid.logs.convert.units import CLEARLY
from fieldsid.logs.doctor.angle_and_rate import TRUSTED, changes_of
from fieldsid.logs.mapping.canonical_names import words_of
from fieldsid.logs.mapping.draft import Draft, draft_of, place_of, with_units_by_span
from fieldsid.logs.mapping.fins.several import which_output, with_several_fins
from fieldsid.logs.mapping.numbers.true_heading import better_heading, lead_of
from fieldsid.logs.mapping.trial import Log, Proposal, tried
from fieldsid.logs.mapping.vocabulary import OVER_GROUND
from fieldsid.logs.reader import Inventory, Reader, ReadOptions
from fieldsid.logs.run import MEASURED_FIN, Note, Run
from fieldsid.logs.several.sifting import attempt
from fieldsid.numerics.shifted_correlation import slope_of


def propose(inventory: Inventory, reader: Reader, options: ReadOptions) -> Proposal:
    """Return a proposed mapping that was tested by reading the log; `load_mapping` accepts it where it names a signal.

    A signal that cannot be read is left out, with a note on the reason, so that a proposed mapping can be imported.
    """
    log, draft = Log(inventory, reader, options), draft_of(inventory)
    if inventory.samples is None and not inventory.by_topic:
        return _without_clock(log, draft)
    return _tested(log, draft)


def _tested(log: Log, draft: Draft) -> Proposal:
    left_out: list[Note] = []
    signals = draft.body["signals"]
    while signals:
        done = attempt(lambda draft: _with_fins(log, _with_vehicle_heading(log, draft), draft), draft)
        if isinstance(done, Proposal) and (still := _still_beside_command(done)):
            signals = {s: item for s, item in done.body["signals"].items() if s not in still}
            draft, left_out = replace(draft, body=done.body | {"signals": signals}), [*left_out, *still.values()]
            continue
        if isinstance(done, Proposal):
            return done.saying(*left_out, *_over_ground(done))
        if done.signal not in signals or len(signals) < 2:
            with_units_by_span(draft, log.inventory)
            return Proposal(draft.body, problem=done).saying(*draft.notes, *left_out)
        message = f"{done.signal} is not proposed from `{place_of(signals.pop(done.signal))}`: {done.what}"
        left_out.append(Note("left_out", message, {"signal": done.signal}))
    return Proposal(draft.body).saying(*draft.notes, *left_out)


def _still_beside_command(done: Proposal) -> dict[str, Note]:
    """Return the note on each measured fin that is constant while its command moves: a feedback that is not fitted, or stuck."""
    run, said = done.run, "is constant while the command moves"
    if run is None:
        return {}
    constant, lines = {n.data["signal"] for n in run.notes if n.code == "constant"}, done.body["signals"]
    return {
        fin: Note("left_out", f"{fin} is not proposed from `{place_of(lines[fin])}`: it {said}", {"signal": fin})
        for command, fin in MEASURED_FIN.items()
        if fin in constant and run.has(command) and command not in constant
    }


def _over_ground(done: Proposal) -> tuple[Note, ...]:
    """Return the note that the heading may be a course over ground: so its name says, and it does not lead the course."""
    place, course_lead = place_of(done.body["signals"].get("yaw_rad", {})), None if done.run is None else lead_of(done.run)
    if not OVER_GROUND & set(words_of(place)) or (course_lead is not None and course_lead.is_clear):
        return ()
    message = (
        f"yaw_rad is {place}, by its name of a receiver: where that is the course over ground, what is fitted is the course, "
        "which lies behind the heading in a turn; map a compass where the log has one"
    )
    return (Note("over_ground", message, {"signal": "yaw_rad"}),)


def _with_vehicle_heading(log: Log, draft: Draft) -> Proposal:
    """Return the tested proposal with, of several headings, the one that the numbers show to be the heading of the vehicle."""
    done = tried(log, draft.body, draft.defined)
    signals = draft.body["signals"]
    bodies = [draft.body | {"signals": signals | {"yaw_rad": dict(item)}} for item in draft.headings]
    others = [attempt(lambda body: tried(log, body, draft.defined), body) for body in bodies]
    several = [done, *(p for p in others if isinstance(p, Proposal))]
    runs = [p.run for p in several if p.run is not None]
    found = better_heading(runs, [f"`{place_of(p.body['signals']['yaw_rad'])}`" for p in several]) if len(runs) > 1 else None
    return done if found is None else several[found[0]].saying(found[1])


def _with_fins(log: Log, done: Proposal, draft: Draft) -> Proposal:
    """Return a proposal with the fins of each axis, where a log has several similar ones, and the other notes of the draft."""
    if done.run is None:
        return done
    body, why = with_several_fins(log, done.body, done.run)
    taken = {note.data["signal"] for note in why}
    kept = [note for note in (*draft.notes, *done.notes) if note.data.get("signal") not in taken]
    why += which_output(log.inventory, body["signals"])
    return (tried(log, body, draft.defined) if taken else replace(done, notes=())).saying(*kept, *why)


def _without_clock(log: Log, draft: Draft) -> Proposal:
    """Return the proposal for a table without a time, with a sampling rate from heading and yaw rate where they agree."""
    with_units_by_span(draft, log.inventory)
    if log.inventory.no_clock is not None:
        return Proposal(draft.body, problem=log.inventory.no_clock[1]).saying(*draft.notes)
    counted = draft.body | {"time": {"rate": ASSUMED_HZ}}
    run = attempt(log.run_of, counted) if draft.body["signals"] else None
    has_unit = "unit" in counted["signals"].get("yaw_rate_rad_s", {})
    found = rate_by_turning(run, has_unit=has_unit) if isinstance(run, Run) else None
    if found is None:
        return _tested(log, draft)
    rate, unit, why = found
    counted["signals"]["yaw_rate_rad_s"].setdefault("unit", unit)
    return _tested(log, replace(draft, body=counted | {"time": {"rate": rate}})).saying(why)


ASSUMED_HZ = 10.0
USUAL_HZ = (1.0, 2.0, 4.0, 5.0, 8.0, 10.0, 16.0, 20.0, 25.0, 30.0, 32.0, 40.0, 50.0, 60.0, 64.0, 100.0, 128.0, 200.0, 250.0)
NEAR = 0.02
"""Relative deviation up to which an estimated rate is replaced by a usual rate of loggers."""


def rate_by_turning(run: Run, *, has_unit: bool) -> tuple[float, str, Note] | None:
    """Return the sampling rate of a run that was read with `ASSUMED_HZ`, the unit of its yaw rate, and a note; None where open.

    `has_unit` states that the unit of the yaw rate is known; else it is the one that gives a possible sampling rate.
    """
    changes = changes_of(run, "yaw_rad", "yaw_rate_rad_s")
    slope, trust = slope_of(*changes[:2]) if changes is not None else (0.0, 0.0)
    if trust < TRUSTED or slope <= 0.0:
        return None
    units = {"rad/s": 1.0} if has_unit else {"rad/s": 1.0, "deg/s": 180.0 / math.pi}
    rates = {unit: ASSUMED_HZ / (slope * factor) for unit, factor in units.items()}
    likely = [unit for unit, rate in rates.items() if USUAL_HZ[0] / CLEARLY < rate < USUAL_HZ[-1] * CLEARLY]
    if len(likely) != 1:
        return None
    rate = rates[likely[0]]
    message = (
        f"no column is a time: heading and yaw rate (in {likely[0]}) agree at {rate:.3g} rows a second, correlation {trust:.2f}; "
        "set the rate that the logger has"
    )
    usual = min(USUAL_HZ, key=lambda known: abs(known - rate))
    return (
        usual if abs(usual / rate - 1.0) < NEAR else float(f"{rate:.3g}"),
        likely[0],
        Note("rate_guessed", message, {"value": rate, "signal": "yaw_rate_rad_s"}),
    )
