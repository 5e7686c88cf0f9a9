"""A first mapping for a log nobody has mapped yet, from names, message types and what the numbers say, tried on the log."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from fieldsid.errors import FieldsidError
from fieldsid.logs.convert.servo_counts import FINS
from fieldsid.logs.mapping.draft import Draft, draft_of, label_of, with_units_by_span
from fieldsid.logs.mapping.fins.several import with_several_fins
from fieldsid.logs.mapping.numbers.row_rate import ASSUMED_HZ, rate_by_turning
from fieldsid.logs.mapping.numbers.true_heading import better_heading
from fieldsid.logs.mapping.outputs import outputs_of, rudder_among, which_output
from fieldsid.logs.mapping.trial import Log, Proposal, tried
from fieldsid.logs.reader import Inventory, Reader, ReadOptions
from fieldsid.logs.run import Note, Run
from fieldsid.logs.several.sifting import attempt

TRIES = 6


def propose(inventory: Inventory, reader: Reader, options: ReadOptions) -> Proposal:
    """Return a mapping that `load_mapping` takes as soon as it names a signal, tried on the log itself.

    A signal that the log does not give after all is left out, and the reason said: a mapping that is proposed can be imported.
    """
    log, draft = Log(inventory, reader, options), draft_of(inventory)
    if inventory.samples is None and not inventory.by_topic:
        return _without_clock(log, draft)
    return _tried(log, draft)


def _tried(log: Log, draft: Draft) -> Proposal:
    left_out: list[Note] = []
    signals = draft.body["signals"]
    for _ in range(TRIES):
        if not signals:
            break
        try:
            done = _with_rudder(log, _with_own_heading(log, draft), draft.defined)
        except FieldsidError as error:
            if error.signal not in signals or len(signals) < 2:
                with_units_by_span(draft, log.inventory)
                return Proposal(draft.body, problem=error).saying(*draft.notes, *left_out)
            left = signals.pop(error.signal)
            message = f"{error.signal} is not proposed from {label_of(left)}: {error.what}"
            left_out.append(Note("left_out", message, {"signal": error.signal}))
        else:
            return _with_several_fins(log, done, draft.defined).saying(*draft.notes, *left_out)
    return Proposal(draft.body).saying(*draft.notes, *left_out)


def _with_several_fins(log: Log, done: Proposal, defined: frozenset[str]) -> Proposal:
    """Return a proposal with the fins that move each plane, where a log has several alike."""
    if done.run is None:
        return done
    body, why = with_several_fins(log.inventory, log.reader, log.options, done.body, done.run)
    return tried(log, body, defined).saying(*done.notes, *why) if why else done


def _with_own_heading(log: Log, draft: Draft) -> Proposal:
    """Return the proposal as it was tried, with the heading that the numbers show to be the vehicle's, of several."""
    done = tried(log, draft.body, draft.defined)
    signals = draft.body["signals"]
    bodies = [draft.body | {"signals": signals | {"yaw_rad": dict(item)}} for item in draft.headings]
    others = [attempt(lambda body: tried(log, body, draft.defined), body) for body in bodies]
    several = [done, *(p for p in others if isinstance(p, Proposal))]
    runs = [p.run for p in several if p.run is not None]
    found = better_heading(runs, [label_of(p.body["signals"]["yaw_rad"]) for p in several]) if len(runs) > 1 else None
    return done if found is None else several[found[0]].saying(found[1])


def _with_rudder(log: Log, done: Proposal, defined: frozenset[str]) -> Proposal:
    """Return a proposal with the output that is the rudder by the motion, where no name says it; else with those there are."""
    signals = done.body["signals"]
    outputs = outputs_of(log.inventory) if log.inventory.by_topic and not set(FINS) & signals.keys() else []
    if not outputs or done.run is None:
        return done
    fin = rudder_among(done.run, outputs, log)
    if fin is None:
        return replace(done, notes=(*done.notes, which_output(outputs, log.inventory)))
    topic, path = outputs[int(fin.column)]
    signals["rudder_rad"] = {"topic": topic, "field": path, **fin.item}
    why = Note("evidence", f"rudder_rad is {topic} {path}: {fin.why}", {"signal": "rudder_rad", "outputs": len(outputs)})
    return tried(log, done.body, defined).saying(why)


def _without_clock(log: Log, draft: Draft) -> Proposal:
    """Return the proposal for a table without a time: with the rate of its rows where heading and yaw rate tell it."""
    with_units_by_span(draft, log.inventory)
    if log.inventory.no_clock is not None:
        return Proposal(draft.body, problem=log.inventory.no_clock[1]).saying(*draft.notes)
    counted = draft.body | {"time": {"rate": ASSUMED_HZ}}
    run = attempt(lambda body: _as_counted(log, body), counted) if draft.body["signals"] else None
    has_unit = "unit" in counted["signals"].get("yaw_rate_rad_s", {})
    found = rate_by_turning(run, has_unit=has_unit) if isinstance(run, Run) else None
    if found is None:
        return _tried(log, draft)
    rate, unit, why = found
    counted["signals"]["yaw_rate_rad_s"].setdefault("unit", unit)
    return _tried(log, replace(draft, body=counted | {"time": {"rate": rate}})).saying(why)


def _as_counted(log: Log, body: dict[str, Any]) -> Run:
    """Return the run of a log as a mapping's body says, unmended."""
    from fieldsid.logs.convert.assemble import assemble
    from fieldsid.logs.mapping.mapping_file import mapping_of

    mapping = mapping_of(body)
    return assemble(log.read(mapping), mapping, log.inventory.path, ReadOptions(salvage=True), max_gap_s=float("inf"))
