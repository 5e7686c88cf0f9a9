"""Comparison of two states of a vehicle by their models: `sysid compare OLD NEW`."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

import numpy as np

from fieldsid.change.consequences import answers, fin_of, gain_changes, radius_changes
from fieldsid.change.estimates import common_speeds
from fieldsid.change.parameters import MATTERS, parameter_changes
from fieldsid.change.record import (
    CHANGED,
    TRIM_ANGLE,
    TRIM_MATTERS_RAD,
    UNCHANGED,
    Change,
    GainChange,
    ParameterChange,
)
from fieldsid.errors import FieldsidError, UsageError
from fieldsid.logs.run import Note
from fieldsid.models.axis import Axis
from fieldsid.plant.parameter_source import ParameterSource
from fieldsid.schedule.linear_plant import FinLimits

T = TypeVar("T")
FIN_IF_NOT_KNOWN = 0.26
"""Largest fin in rad where neither a vehicle nor a run states one: 15 deg, where the lift of a fin begins to stall."""


def compare_models(
    old: ParameterSource,
    new: ParameterSource,
    *,
    fin_limit: float | None = None,
    stated: FinLimits | None = None,
) -> Change:
    """Return what has changed between the models of one axis before and after.

    Tested are the parameters at the speeds at which both sides were flown, and the coefficients of effects that both have.
    `fin_limit` (rad) is the fin of the turn and the limit of the gains, by default the largest fin in the runs of the old models.
    `stated` are the lag, delay and rate of the fin. The gains are P gains. Raises UsageError for models of two axes, without a
    common speed, or without runs at a known speed.
    """
    _refuse(old, new)
    speeds = common_speeds(old, new)
    if not speeds:
        raise UsageError(
            "the two sides were not flown at the same speed",
            found=f"{_speeds_in_words(old)} m/s before, {_speeds_in_words(new)} m/s after",
            hint=f"identify a run near {old.speeds[-1]:.2g} m/s after the change",
        )
    limit = fin_limit or fin_of(old.models) or fin_of(new.models) or FIN_IF_NOT_KNOWN
    added, removed = _effects(new, old), _effects(old, new)
    parameters = parameter_changes(old, new, speeds)
    notes: list[Note] = []
    found_gains = _value_or_note(lambda: gain_changes(old, new, speeds, limit, stated or FinLimits()), "gains", notes)
    turns = _value_or_note(lambda: radius_changes(old, new, speeds, limit), "radius", notes) if old.axis is Axis.YAW else ()
    notes += _notes_on_parameters(parameters, (*added, *removed))
    return Change(
        axis=old.axis,
        speeds=tuple(speeds),
        parameters=parameters,
        added=added,
        removed=removed,
        gains=found_gains,
        radius=turns,
        rudder=limit,
        answers=answers(old, new, speeds[len(speeds) // 2], limit),
        verdict="form" if added or removed else _verdict(parameters, found_gains),
        notes=tuple(notes),
    )


def _refuse(old: ParameterSource, new: ParameterSource) -> None:
    if old.axis is not new.axis:
        raise UsageError("the models are not of one axis", found=f"{old.axis.value} and {new.axis.value}", hint="give two of one")
    if not (old.models and new.models):
        raise UsageError("a table has no errors that belong together", found="no model", hint="give model files")


def _effects(here: ParameterSource, there: ParameterSource) -> tuple[str, ...]:
    """Return the effects that models of one side have and no model of the other."""
    other = {e for m in there.models for e in m.effects}
    return tuple(dict.fromkeys(e for m in here.models for e in m.effects if e not in other))


def _speeds_in_words(source: ParameterSource) -> str:
    return ", ".join(f"{s:.2f}" for s in source.speeds)


def _value_or_note(make: Callable[[], tuple[T, ...]], what: str, notes: list[Note]) -> tuple[T, ...]:
    try:
        return make()
    except FieldsidError as error:  # where one side has no turn or no gain, the parameters are compared without it
        notes.append(Note(f"no_{what}", f"{what} not compared: {error.what}", {}))
        return ()


def _notes_on_parameters(parameters: tuple[ParameterChange, ...], one_sided: tuple[str, ...]) -> list[Note]:
    notes: list[Note] = []
    if one_sided:
        message = (
            f"{', '.join(one_sided)} is in the models of one side only: what it takes up there the other's parameters take up"
        )
        notes.append(Note("other_form", f"{message}; identify both with the same effects", {"effects": list(one_sided)}))
    for p in parameters:
        changes = [a.change for a in p.speeds if a.is_beyond_errors]
        both_ways = bool(changes) and min(changes) < 0 < max(changes)
        if p.state == CHANGED and changes and (both_ways or len(changes) < len(p.speeds)):
            where = ", ".join(f"{a.speed:.2f}" for a in p.speeds if a.is_beyond_errors)
            notes.append(Note("not_at_every_speed", f"{p.word}: the change is beyond its errors at {where} m/s only", {}))
    return notes


def _verdict(parameters: tuple[ParameterChange, ...], gains: tuple[GainChange, ...]) -> str:
    """Return the verdict on the gains: `needed` where one must change significantly and by more than MATTERS."""
    if not gains:
        return "none"
    if any(abs(g.change) > MATTERS and (g.interval95[0] > 0 or g.interval95[1] < 0) for g in gains):
        return "needed"
    settled = all(np.max(np.abs(g.interval95)) <= MATTERS for g in gains)
    trim = next(p for p in parameters if p.name == TRIM_ANGLE)
    if trim.state == CHANGED and abs(trim.change) > TRIM_MATTERS_RAD:
        return "needed"
    return "hold" if settled and trim.state in (CHANGED, UNCHANGED) else "unclear"
