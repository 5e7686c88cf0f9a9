"""Which physical effect is missing: the function behind `sysid diagnose`."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np

from fieldsid.comparison.conditions import conditions
from fieldsid.comparison.localize import Place, places
from fieldsid.diagnosis.advise import next_maneuver
from fieldsid.diagnosis.beside import Beside
from fieldsid.diagnosis.floor import shown_floor
from fieldsid.diagnosis.freely import freely
from fieldsid.diagnosis.hypothesis import Hypothesis
from fieldsid.diagnosis.records import Candidate, Diagnosis
from fieldsid.diagnosis.refitted import refitted_model
from fieldsid.diagnosis.remainder import remainder_of
from fieldsid.diagnosis.search import Search, search
from fieldsid.diagnosis.split import held_back
from fieldsid.diagnosis.usable import usable
from fieldsid.diagnosis.verdict import MOSTLY, Verdict, added, explained, probabilities, verdict_of
from fieldsid.diagnosis.weather import in_its_weather
from fieldsid.diagnosis.words import evidence, headline
from fieldsid.effects import all_effects
from fieldsid.errors import DataError, ModelError
from fieldsid.fitting.fit import check
from fieldsid.fitting.predict import as_flown, predict
from fieldsid.logs.run import Note, Run
from fieldsid.models.axis import Axis
from fieldsid.models.model import Model, Noise
from fieldsid.models.record import Record, left_out, record_of

SHOWN = 8


def diagnose(
    training: Sequence[Run],
    axis: Axis,
    validation: Sequence[Run] = (),
    *,
    known: Sequence[str] = (),
    report: Callable[[str], None] = lambda _text: None,
) -> Diagnosis:
    """Return which catalogued effect the base model lacks on some runs, judged on runs it was not fitted to.

    known names effects the model has already: they are part of the base. report is told what is being tried.
    Raises DataError when a run cannot be fitted on the axis, EffectError for a user's effect that fails.
    """
    both = Beside((), ()).each(lambda run: record_of(run, axis), (*training, *validation))
    records, unseen = both[: len(training)], tuple(both[len(training) :])
    check([*records, *unseen], axis)
    learned, unseen, notes = (tuple(records), unseen, ()) if unseen else held_back(records)
    notes = (*notes, *left_out([*training, *validation], axis))
    catalogue, skipped = usable(all_effects(axis).values(), [*learned, *unseen])
    missing = [n for n in known if n in skipped]
    if missing:
        raise DataError(f"`{missing[0]}` is in the model but cannot be simulated on these runs", found=skipped[missing[0]])
    work = search(learned, unseen, axis, catalogue, known=known, report=report)
    found = work.best()
    judged = in_its_weather(found.judged, work.beside)
    left = remainder_of(judged)
    verdict = verdict_of(work, found, left, judged)
    if verdict.word == "unexplained" and work.is_noiseless:
        # from the first base: one begun anew under the other noise is that of a search that has led nowhere
        first = search(learned, unseen, axis, catalogue, known=known, report=report)
        other = freely(first)
        if other is not None and explained(first, other) > MOSTLY:
            work, found, judged, verdict = first, other, other.judged, Verdict("effect", added(first, other))
            left = remainder_of(judged)
    floor = shown_floor(work.floor, judged.noise)
    return _said(work, found, verdict, headline(work, verdict, found, left, floor, judged.noise), floor, skipped, notes)


def _said(
    work: Search,
    found: Hypothesis,
    verdict: Verdict,
    says: str,
    floor: Noise,
    skipped: Mapping[str, str],
    notes: tuple[Note, ...],
) -> Diagnosis:
    base = work.base()
    named = found if verdict.word in ("effect", "undecided") else base
    candidates = _candidates(work, found, floor)

    def refitted() -> tuple[Model, tuple[Note, ...]]:
        model = refitted_model(named)
        return model, as_flown(model, work.validation)

    parts: tuple[Callable[[], Any], ...] = (
        refitted, partial(refitted_model, base), partial(where_of, base, work.validation or work.records),
    )  # fmt: skip
    (model, flown), base_model, (where, diverged) = work.beside.each(lambda part: part(), parts)
    return Diagnosis(
        axis=work.axis,
        verdict=verdict.word,
        effects=added(work, named),
        says=says,
        base=base.errors,
        final=named.errors,
        noise_floor=floor,
        candidates=candidates,
        model=model,
        base_model=base_model,
        where=where,
        next_maneuver=next_maneuver(work, verdict, found, skipped),
        skipped=skipped,
        notes=(*notes, *diverged, *flown),
    )


def _candidates(work: Search, found: Hypothesis, floor: Noise) -> tuple[Candidate, ...]:
    """Return the leading hypotheses, the one found first, then by evidence."""
    base = work.base()
    others = [h for h in work.ranked() if h is not found and h is not base]
    others.sort(key=lambda h: not work.admissible(h))
    shown = [*([found] if found is not base else []), *others]
    fair = [h for h in (*shown, base) if h is found or h is base or work.admissible(h)]
    p = dict(zip(map(id, fair), probabilities(fair), strict=True))
    errors = work.beside.each(lambda h: h.errors, shown[:SHOWN])
    return tuple(
        Candidate(
            effects=added(work, h),
            probability=p.get(id(h), 0.0),
            parameters=dict(h.model.values),
            errors=pair,
            explained=explained(work, h),
            score=h.score - base.score,
            evidence=evidence(work, h, floor),
            confusable_with=confusable(work, h, shown),
        )
        for h, pair in zip(shown, errors, strict=False)
    )


def confusable(work: Search, h: Hypothesis, others: Sequence[Hypothesis]) -> tuple[str, ...]:
    """Return the other hypotheses of the same size that take away nearly as much of the error on these data."""
    mine = explained(work, h)
    return tuple(
        "+".join(n for n in o.names if n not in work.known)
        for o in others
        if o is not h and len(o.names) == len(h.names) and mine > 0.0 and explained(work, o) > 0.8 * mine
    )[:4]


def where_of(h: Hypothesis, records: Sequence[Record]) -> tuple[tuple[Place, ...], tuple[Note, ...]]:
    """Return where a hypothesis's free run fails, over the run it fails most on, and the runs it cannot be simulated on."""
    shown, notes = [], []
    for record in records:
        try:
            shown.append(predict(h.model, record))
        except ModelError as error:
            notes.append(Note("grows_without_bound", f"{error.what}: {error.found}", {"run": record.name}))
    if not shown:
        return (), tuple(notes)
    channel = 1 if records[0].rate_ok.any() else 0
    worst = max(shown, key=lambda s: float(np.mean(s.residual[channel] ** 2)))
    seen, squared = worst.record, worst.residual[channel] ** 2
    found = places(seen.time, squared, seen.ok[channel], conditions(seen, worst.rate, 0.0))
    return found, tuple(notes)


def body_of(d: Diagnosis) -> dict[str, Any]:
    """Return a diagnosis as the JSON object of the contract, without its schema."""
    return {
        "axis": d.axis.value,
        "verdict": d.verdict,
        "says": d.says,
        "effects": list(d.effects),
        "base": _pair(d.base),
        "final": _pair(d.final),
        "noise_floor": {"angle_rad": d.noise_floor.angle, "rate_rad_s": d.noise_floor.rate},
        "candidates": [
            {
                "effect": c.effect,
                "probability": c.probability,
                "parameters": dict(c.parameters),
                **_pair(c.errors),
                "explained": c.explained,
                "log_evidence": c.score,
                "evidence": c.evidence,
                "confusable_with": list(c.confusable_with),
            }
            for c in d.candidates
        ],
        "where": [
            {
                "condition": w.condition,
                "share_of_error": w.share_of_error,
                "rms_ratio": w.rms_ratio,
                "t_start_s": w.start_s,
                "t_end_s": w.end_s,
            }
            for w in d.where
        ],
        "next_maneuver": d.next_maneuver,
        "skipped": dict(d.skipped),
        "notes": [{"code": n.code, "message": n.message} for n in d.notes],
        "speed_law": {"reference_m_s": d.model.law.reference},
    }


def _pair(p: Any) -> dict[str, Any]:
    return {
        side: {"angle_rms_rad": e.angle_rms_rad, "rate_rms_rad_s": e.rate_rms_rad_s}
        for side, e in (("train", p.train), ("validation", p.validation))
    }
