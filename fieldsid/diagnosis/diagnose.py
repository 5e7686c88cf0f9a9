"""Which physical effect is missing: the function behind `sysid diagnose`."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from fieldsid.comparison.conditions import conditions
from fieldsid.comparison.localize import Place, places
from fieldsid.diagnosis.advise import next_maneuver
from fieldsid.diagnosis.floor import shown_floor
from fieldsid.diagnosis.freely import freely
from fieldsid.diagnosis.hypothesis import Hypothesis
from fieldsid.diagnosis.records import Candidate, Diagnosis, Pair
from fieldsid.diagnosis.refitted import refitted_model
from fieldsid.diagnosis.remainder import Remainder, remainder_of
from fieldsid.diagnosis.search import Search
from fieldsid.diagnosis.split import held_back
from fieldsid.diagnosis.trial import Judged
from fieldsid.diagnosis.usable import usable
from fieldsid.diagnosis.verdict import LIKELY, MOSTLY, Verdict, added, explained, probabilities, verdict_of, worsens
from fieldsid.diagnosis.weather import in_its_weather
from fieldsid.diagnosis.words import evidence, headline
from fieldsid.diagnosis.worth import asks_for_more
from fieldsid.effects import all_effects, apart_from
from fieldsid.errors import DataError, DivergenceError
from fieldsid.fitting.fit_runs import records_of
from fieldsid.fitting.predict import as_flown, predict
from fieldsid.logs.run import Note, Run
from fieldsid.logs.sifting import Refused
from fieldsid.models.axis import Axis
from fieldsid.models.definition import NONE, Definition
from fieldsid.models.effect import effect_held
from fieldsid.models.model import Model, Noise
from fieldsid.models.record import Record, left_out

SHOWN = 8
UNTRIED = Note(
    "search_ended", "the search ended with what it had found by then: more might explain what is left; `--thorough` goes on"
)
Refitted = tuple[Model, tuple[Note, ...]]


def diagnose(
    training: Sequence[Run],
    axis: Axis,
    validation: Sequence[Run] = (),
    *,
    known: Sequence[str] = (),
    own: Mapping[str, Definition] = NONE,
    report: Callable[[str], None] = lambda _text: None,
    thorough: bool = False,
    unfit: Refused[Run] | None = None,
) -> Diagnosis:
    """Return which catalogued effect the base model lacks on some runs, judged on runs it was not fitted to.

    known names effects the model has already: they are part of the base; own defines those of them that are not built in, as a
    model holds them. report is told what is being tried. thorough: for as long as there is something to try, see allowance.py.
    unfit is told of each of several runs that cannot be fitted; without it, and where no run to learn from or none of those to
    judge by is left, its error is raised.
    Raises DataError when a run cannot be fitted on the axis, EffectError for a user's effect that fails.
    """
    fitted, checked = records_of([training, validation], axis, unfit)
    records, unseen = [record for _, record in fitted], tuple(record for _, record in checked)
    learned, unseen, notes = (tuple(records), unseen, ()) if unseen else held_back(records)
    notes = (*notes, *left_out([run for run, _ in (*fitted, *checked)], axis))
    effects, clashes = apart_from(all_effects(axis).values(), [effect_held(name, own) for name in known])
    notes = (*notes, *(Note("effect_left_out", f"not tried: {why}", {"effect": name}) for name, why in clashes.items()))
    catalogue, skipped = usable(effects, [*learned, *unseen])
    missing = [n for n in known if n in skipped]
    if missing:
        raise DataError(f"`{missing[0]}` is in the model but cannot be simulated on these runs", found=skipped[missing[0]])
    work = Search(learned, unseen, axis, catalogue, known, report, thorough=thorough)
    found = work.best()
    ending = _ended(work, found, in_its_weather(found.judged, work.beside))
    if ending.verdict.word == "unexplained" and work.is_noiseless:
        # from the first base: one begun anew under the other noise is that of a search that has led nowhere
        first = Search(learned, unseen, axis, catalogue, known, report, thorough=thorough)
        other = freely(first)
        if other is not None and explained(first, other) > MOSTLY:
            ending = _ended(first, other, other.judged, Verdict("effect", added(first, other)))
    return _said(ending, skipped, notes)


@dataclass(frozen=True, slots=True)
class _Ending:
    """Where a search ended, its verdict, and what is said of that.

    judged is the hypothesis found as what is left is judged; models are the base's and its, with how unseen runs were flown;
    shown are the leading hypotheses, with the errors of the first of them.
    """

    work: Search
    found: Hypothesis
    judged: Judged
    left: Remainder
    verdict: Verdict
    models: tuple[Refitted, Refitted]
    places: tuple[tuple[Place, ...], tuple[Note, ...]]
    shown: Sequence[Hypothesis]
    errors: Sequence[Pair]


def _ended(work: Search, found: Hypothesis, judged: Judged, verdict: Verdict | None = None) -> _Ending:
    """Return what a search comes to that ended at a hypothesis, judged in its weather, under a verdict where that is known."""
    base, shown = work.base(), _leading(work, found)

    def refitted(h: Hypothesis) -> Refitted:
        model = refitted_model(h)
        return model, as_flown(model, work.validation)

    # at once, whatever the verdict will be: each sharing out costs a copy of the process
    parts: list[Callable[[], Any]] = [
        partial(refitted, found), partial(remainder_of, judged), partial(where_of, base, work.validation or work.records),
        *(partial(getattr, h, "errors") for h in shown[:SHOWN]), *([partial(refitted, base)] if found is not base else []),
    ]  # fmt: skip
    done = work.beside.each(lambda part: part(), parts)
    own, left, places = done[:3]
    errors, of_base = done[3 : 3 + len(shown[:SHOWN])], own if found is base else done[-1]
    verdict = verdict or verdict_of(work, found, left, judged)
    return _Ending(work, found, judged, left, verdict, (of_base, own), places, shown, errors)


def _said(end: _Ending, skipped: Mapping[str, str], notes: tuple[Note, ...]) -> Diagnosis:
    work, found, verdict, base = end.work, end.found, end.verdict, end.work.base()
    named = found if verdict.word in ("effect", "undecided") else base
    (base_model, _), (model, flown) = end.models if named is found else (end.models[0], end.models[0])
    floor = shown_floor(work.floor, end.judged.noise)
    where, diverged = end.places
    return Diagnosis(
        axis=work.axis,
        verdict=verdict.word,
        effects=added(work, named),
        says=headline(work, verdict, found, end.left, floor, end.judged.noise),
        base=base.errors,
        final=named.errors,
        noise_floor=floor,
        candidates=_candidates(end, floor),
        model=model,
        base_model=base_model,
        where=where,
        next_maneuver=next_maneuver(work, verdict, found, skipped, floor),
        skipped=skipped,
        notes=(*notes, *diverged, *flown, *([UNTRIED] if work.allowance.ended and asks_for_more(found, work.floor) else [])),
    )


def _leading(work: Search, found: Hypothesis) -> list[Hypothesis]:
    """Return all hypotheses but the base, the one found first, then by evidence, those with effects that do not pay last."""
    base, sums = work.base(), work.evidences()
    others = [h for h in work.ranked() if h is not found and h is not base]
    others.sort(key=lambda h: -sums.get(frozenset(h.names), -np.inf))
    return [*([found] if found is not base else []), *others]


def _candidates(end: _Ending, floor: Noise) -> tuple[Candidate, ...]:
    """Return the leading hypotheses."""
    work, sums = end.work, end.work.evidences()
    p = probabilities(sums)

    def gain(h: Hypothesis) -> float:
        return sums.get(frozenset(h.names), h.score) - sums[work.root]

    return tuple(
        Candidate(
            effects=added(work, h),
            probability=p.get(frozenset(h.names), 0.0),
            parameters=dict(h.model.values),
            errors=pair,
            explained=explained(work, h, floor),
            score=gain(h),
            evidence=evidence(work, h, pair, floor, gain(h)),
            confusable_with=confusable(work, h, end.shown, p, floor),
            worse=worsens(work, h, floor),
        )
        for h, pair in zip(end.shown, end.errors, strict=False)
    )


def confusable(
    work: Search, h: Hypothesis, others: Sequence[Hypothesis], p: Mapping[frozenset[str], float], floor: Noise
) -> tuple[str, ...]:
    """Return the other hypotheses of the same size that take away nearly as much of the error, and are as good as likely.

    p are probabilities by sets of effects: what the evidence tells from one is no rival of it.
    """
    mine, own = explained(work, h, floor), p.get(frozenset(h.names), 0.0)

    def as_likely(other: Hypothesis) -> bool:
        its = p.get(frozenset(other.names), 0.0)
        return min(own, its) > 0.0 and min(own, its) >= LIKELY * max(own, its)

    return tuple(
        "+".join(n for n in o.names if n not in work.known)
        for o in others
        if o is not h and len(o.names) == len(h.names) and as_likely(o) and mine > 0.0 and explained(work, o, floor) > 0.8 * mine
    )[:4]


def where_of(h: Hypothesis, records: Sequence[Record]) -> tuple[tuple[Place, ...], tuple[Note, ...]]:
    """Return where a hypothesis's free run fails, over the run it fails most on, and the runs it cannot be simulated on."""
    shown, notes = [], []
    for record in records:
        try:
            shown.append(predict(h.model, record))
        except DivergenceError as error:
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
                "worse": c.worse,
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
