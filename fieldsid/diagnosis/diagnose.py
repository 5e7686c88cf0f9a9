"""The function behind `sysid diagnose`, which names the physical effects that a model lacks."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from fieldsid.comparison.conditions import conditions
from fieldsid.comparison.localize import Place, places
from fieldsid.diagnosis.data.applicable_effects import applicable_effects
from fieldsid.diagnosis.data.heading_span import shown_by_headings
from fieldsid.diagnosis.data.holdout_split import holdout_split
from fieldsid.diagnosis.data.noise_floor import reported_noise_floor
from fieldsid.diagnosis.evidence.likelihood_fit import LikelihoodFit
from fieldsid.diagnosis.evidence.scored_model import ScoredModel
from fieldsid.diagnosis.records import Candidate, Diagnosis
from fieldsid.diagnosis.report.final_model import final_model
from fieldsid.diagnosis.report.next_maneuver import next_maneuver
from fieldsid.diagnosis.report.report_text import apart_from_the_hulls_own, evidence, headline
from fieldsid.diagnosis.residual_tests.residual_tests import ResidualTests, residual_tests
from fieldsid.diagnosis.search.search import MAX_CANDIDATES, Search
from fieldsid.diagnosis.thresholds import RIVAL_PROBABILITY_RATIO
from fieldsid.diagnosis.verdict import (
    Verdict,
    added_effects,
    error_left,
    excess_explained,
    left_of,
    names_added,
    probabilities,
    verdict_of,
    worsens,
)
from fieldsid.effects import all_effects, apart_from
from fieldsid.errors import DataError, DivergenceError
from fieldsid.fitting.fit_runs import records_of
from fieldsid.fitting.predict.predict import as_flown, predict
from fieldsid.logs.run import Note, Run
from fieldsid.logs.several.sifting import Refused
from fieldsid.models.axis import Axis
from fieldsid.models.definition import NONE
from fieldsid.models.effect import effect_held
from fieldsid.models.model import Model, Noise
from fieldsid.models.record import Record, left_out
from fieldsid.noise.white_floor import told_floor

SEARCH_ENDED = Note(
    "search_ended", "the search ended with what it had found by then: more might explain what is left; `--thorough` goes on"
)
SCREENED = "screened alone and beside what was found: it explains less than those listed"
FinalModel = tuple[Model, tuple[Note, ...]]


def diagnose(
    training: Sequence[Run],
    axis: Axis,
    validation: Sequence[Run] = (),
    *,
    model: Model | None = None,
    report: Callable[[str], None] = lambda _text: None,
    thorough: bool = False,
    unfit: Refused[Run] | None = None,
) -> Diagnosis:
    """Return which catalogued effect the base model lacks, validated on runs it was not fitted to.

    `model` is a model whose effects are known: they are part of the base, which is also fitted from its values. `report` is
    called with the names of each model tried. `thorough` removes the evaluation budget (search/budget.py). `unfit` is called for
    each run that cannot be fitted; without it, or where no training run or no validation run remains, the error is raised. Raises
    DataError where a run cannot be fitted on the axis, EffectError where a user's effect fails.
    """
    known, own = ((), NONE) if model is None else (model.effects, model.own)
    fitted, checked = records_of([training, validation], axis, unfit)
    records, unseen = [record for _, record in fitted], tuple(record for _, record in checked)
    learned, unseen, notes = (tuple(records), unseen, ()) if unseen else holdout_split(records)
    notes = (*notes, *left_out([run for run, _ in (*fitted, *checked)], axis))
    effects, clashes = apart_from(all_effects(axis).values(), [effect_held(name, own) for name in known])
    notes = (*notes, *(Note("effect_left_out", f"not tried: {why}", {"effect": name}) for name, why in clashes.items()))
    catalogue, unlogged = applicable_effects(effects, [*learned, *unseen])
    missing = [n for n in known if n in unlogged]
    if missing:
        raise DataError(f"`{missing[0]}` is in the model but cannot be simulated on these runs", found=unlogged[missing[0]])
    catalogue, narrow = shown_by_headings(catalogue, [*learned, *unseen], known)
    work = Search(learned, unseen, axis, catalogue, known, report, thorough=thorough, given=model)
    return _diagnosis(_search_result(work), unlogged, unlogged | narrow, notes)


@dataclass(frozen=True, slots=True)
class _SearchResult:
    """The final model of a search, its verdict, and the other results that are reported.

    `ml_fit` is the fit of the final model under the noise model of its residual tests; `models` are the base and the final model
    for the file, each with notes on the validation runs; `leading` are the models in their order of report, of which the first
    have their errors computed.
    """

    work: Search
    found: ScoredModel
    ml_fit: LikelihoodFit
    residual_tests: ResidualTests
    verdict: Verdict
    models: tuple[FinalModel, FinalModel]
    places: tuple[tuple[Place, ...], tuple[Note, ...]]
    leading: Sequence[ScoredModel]


def _search_result(work: Search) -> _SearchResult:
    """Return the final model of a search with its residual tests, its models for the file, and its verdict."""
    best = work.best()
    found = work.tried[frozenset(best.names)] = work.reported(best)
    ml_fit = work.tested_fit(found)
    base, ranked = work.base(), _leading(work, found)
    shown, beyond = ranked[:MAX_CANDIDATES], ranked[MAX_CANDIDATES:]

    def with_errors(h: ScoredModel) -> ScoredModel:
        """Return a model with the errors to report; its fit is by output error where that predicts the validation runs better."""
        return (h if h is found else work.with_free_run(h)).evaluate_errors()

    def refitted(h: ScoredModel) -> FinalModel:
        model = final_model(h)
        return model, as_flown(model, work.validation)

    # all in one parallel map, whatever the verdict: at the end of each map one process waits for the other
    parts: list[Callable[[], Any]] = [
        partial(refitted, found),
        partial(residual_tests, ml_fit),
        partial(where_of, base, work.validation or work.records),
        *(partial(with_errors, h) for h in shown),
        *([partial(refitted, base)] if found is not base else []),
    ]
    done = work.parallel.map(lambda part: part(), parts)
    own, left, places = done[:3]
    leading, of_base = (*done[3 : 3 + len(shown)], *beyond), own if found is base else done[-1]
    verdict = verdict_of(work, found, left, ml_fit)
    return _SearchResult(work, found, ml_fit, left, verdict, (of_base, own), places, leading)


def _diagnosis(
    end: _SearchResult, unlogged: Mapping[str, str], skipped: Mapping[str, str], notes: tuple[Note, ...]
) -> Diagnosis:  # fmt: skip
    """Return the result of a search as a diagnosis.

    `skipped` holds the reasons why effects were not tried; `unlogged` those of them whose signal was not logged.
    """
    work, found, verdict, base = end.work, end.found, end.verdict, end.work.base()
    named = found if verdict.word in ("effect", "undecided") else base
    (base_model, _), (model, model_notes) = end.models if named is found else (end.models[0], end.models[0])
    floor = reported_noise_floor(work.floor, end.ml_fit.noise)
    where, diverged = end.places
    left = left_of(work, named, found, end.residual_tests, floor)
    sentence = headline(work, verdict, found, end.residual_tests, left, floor, end.ml_fit.noise)
    return Diagnosis(
        axis=work.axis,
        verdict=verdict.word,
        effects=added_effects(work, named),
        says=sentence.full,
        short=sentence.short,
        base=base.errors,
        final=named.errors,
        noise_floor=told_floor(floor, work.records),
        candidates=_candidates(end, floor, error_left(work, found, end.residual_tests, floor)),
        model=model,
        base_model=base_model,
        where=where,
        next_maneuver=next_maneuver(work, verdict, found, unlogged, floor),
        unusual=apart_from_the_hulls_own(added_effects(work, named))[0],
        skipped={**skipped, **{name: SCREENED for name in _user_effects(work) if not any(name in h.names for h in end.leading)}},
        notes=(
            *notes,
            *diverged,
            *model_notes,
            *([SEARCH_ENDED] if work.budget.is_exhausted and work.leaves_unexplained() else []),
        ),
        noiseless=work.is_noiseless,
        left=left,
    )


def _leading(work: Search, found: ScoredModel) -> list[ScoredModel]:
    """Return all models but the base: the one found, the accepted sets by log evidence, then the others by size.

    The best model with each effect defined by the user is among the first MAX_CANDIDATES.
    """
    base, sums = work.base(), work.evidences()
    others = [h for h in work.ranked() if h is not found and h is not base]
    others.sort(key=lambda h: (-sums[key], 0) if (key := frozenset(h.names)) in sums else (np.inf, len(key)))
    all_models = [*([found] if found is not base else []), *others]
    first = [next((i for i, h in enumerate(all_models) if name in h.names), 0) for name in _user_effects(work)]
    beyond = sorted({i for i in first if i >= MAX_CANDIDATES})[:MAX_CANDIDATES]
    before = MAX_CANDIDATES - len(beyond)
    return [
        *all_models[:before],
        *(all_models[i] for i in beyond),
        *(h for i, h in enumerate(all_models[before:], before) if i not in beyond),
    ]


def _user_effects(work: Search) -> list[str]:
    """Return the names of the effects, defined by the user, that the search tries."""
    return [e.name for e in work.catalogue if e.definition is not None and e.name not in work.known]


def _candidates(end: _SearchResult, floor: Noise, left: float) -> tuple[Candidate, ...]:
    """Return the leading models as candidates, for a search whose final model has an error of `left` over the noise floor."""
    work, sums = end.work, end.work.evidences()
    p = probabilities(sums, left)

    def gain(h: ScoredModel) -> float:
        return sums.get(frozenset(h.names), h.log_evidence) - sums[work.root]

    return tuple(
        Candidate(
            effects=added_effects(work, h),
            probability=p.get(frozenset(h.names), 0.0),
            parameters=dict(h.model.values),
            errors=h.errors,
            explained=excess_explained(work, h, floor),
            score=gain(h),
            evidence=evidence(work, h, h.errors, floor, gain(h)),
            confusable_with=confusable(work, h, end.leading, p, floor),
            worse=worsens(work, h, floor),
        )
        for h in end.leading[:MAX_CANDIDATES]
    )


def confusable(
    work: Search, h: ScoredModel, others: Sequence[ScoredModel], p: Mapping[frozenset[str], float], floor: Noise
) -> tuple[str, ...]:
    """Return the other models of the same size that remove nearly as much of the error and are nearly as probable.

    `p` holds probabilities by sets of effects; a model that the evidence separates from h is not confusable with it.
    """
    mine, own = excess_explained(work, h, floor), p.get(frozenset(h.names), 0.0)

    def as_likely(other: ScoredModel) -> bool:
        its = p.get(frozenset(other.names), 0.0)
        return min(own, its) > 0.0 and min(own, its) >= RIVAL_PROBABILITY_RATIO * max(own, its)

    return tuple(
        "+".join(names_added(work, o))
        for o in others
        if o is not h
        and len(o.names) == len(h.names)
        and as_likely(o)
        and mine > 0.0
        and excess_explained(work, o, floor) > 0.8 * mine
    )[:4]


def where_of(h: ScoredModel, records: Sequence[Record]) -> tuple[tuple[Place, ...], tuple[Note, ...]]:
    """Return where a model's free run fails, in the run with the largest error, and notes on the runs on which it diverges."""
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
