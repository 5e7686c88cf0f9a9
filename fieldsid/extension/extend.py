"""Extension of a model by effects: all parameters are refitted, and the result is judged on runs that were not fitted.

The models before and after come from the same search as in `diagnose`, with the same start values, noise models and runs, so that
they differ in the addition only.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise
from typing import Annotated

from fieldsid.diagnosis.data.applicable_effects import applicable_effects
from fieldsid.diagnosis.data.holdout_split import holdout_split
from fieldsid.diagnosis.data.noise_floor import reported_noise_floor
from fieldsid.diagnosis.evidence.acceptance import common_own_moment, is_accepted
from fieldsid.diagnosis.evidence.scored_model import ScoredModel
from fieldsid.diagnosis.records import FLOOR, Errors, Pair
from fieldsid.diagnosis.report.final_model import final_model
from fieldsid.diagnosis.search.given_model import refitted_from
from fieldsid.diagnosis.search.search import Search
from fieldsid.diagnosis.thresholds import MAX_ERROR_RATIO
from fieldsid.display import Brief, Plotted
from fieldsid.dynamics.at_bound import at_bound
from fieldsid.effects import pick_effect, refuse_clash
from fieldsid.errors import DataError, UsageError
from fieldsid.fitting.fit_runs import records_of
from fieldsid.fitting.predict.predict import as_flown
from fieldsid.logs.run import Note, Run
from fieldsid.logs.several.sifting import Refused
from fieldsid.models.axis import Axis
from fieldsid.models.effect import Effect, as_fitted, effect_held
from fieldsid.models.model import Model, Noise
from fieldsid.models.record import Record, left_out
from fieldsid.noise.white_floor import told_floor
from fieldsid.records.keys import INLINE, Key, Number

FITTED_TO_ALL = Note(
    "fitted_to_all",
    "the runs to fit leave the addition's size open, and the unseen ones settle it: all were fitted, none is left to judge by",
)
FORM_TAKEN = "form_taken"
"""Code of the note that an effect was added in a variant other than the textbook form."""
BEAM_WIDTH = 2
"""Number of partial sets of the effects that the search continues from after each addition."""


@dataclass(frozen=True, slots=True)
class Fall:
    """Free-run error over the noise floor, both channels pooled."""

    before: Annotated[float, Key("Without the addition.")]
    after: Annotated[float, Key("With it.")]


@dataclass(frozen=True, slots=True, repr=False)
class Gain(Brief):
    """What an addition changed: errors before and after over one noise floor, on named runs.

    `unseen` tells whether there were data to judge by that were not fitted.
    """

    added: Annotated[tuple[str, ...], Key("The effects added.")]
    before: Annotated[Pair, Key("Errors without them.")]
    after: Annotated[Pair, Key("Errors with them.")]
    noise_floor: Annotated[Noise, Key(FLOOR)]
    unseen: Annotated[bool, Key("Whether there were runs to judge by that were not fitted.")]
    learned_on: Annotated[tuple[str, ...], Key("Runs that were fitted.")]
    judged_on: Annotated[tuple[str, ...], Key("Runs it was judged by.")]

    @property
    def judged(self) -> tuple[Errors, Errors]:
        """The error before and after, on unseen data where there are any."""
        before, after = (p.validation if self.unseen else p.train for p in (self.before, self.after))
        return before, after

    @property
    def fall(self) -> Annotated[Fall, Key(name="over_floor")]:
        """The errors it is judged by, over the noise floor."""
        return Fall(*self.over_floor)

    @property
    def over_floor(self) -> tuple[float, float]:
        """The error before and after over the noise floor, on unseen data where there are any."""
        before, after = self.judged
        return before.over(self.noise_floor), after.over(self.noise_floor)

    def left(self, *, kept: bool) -> tuple[float, float]:
        """Return the error over the noise floor on fitted and on validation runs, with the addition if `kept`, else without.

        It is NaN where there are no validation runs.
        """
        pair = self.after if kept else self.before
        return pair.train.over(self.noise_floor), pair.validation.over(self.noise_floor)


@dataclass(frozen=True, slots=True)
class AddedCoefficient:
    """A coefficient of an effect that was added."""

    value: Annotated[float, Key("The estimate.")]
    std_error: Annotated[Number, Key("Its standard error.")]
    unit: Annotated[str, Key("Its unit.")]
    at_bound: Annotated[bool, Key("Whether it ended on a bound: then no error is right.")]


@dataclass(frozen=True, slots=True, repr=False)
class Extension(Plotted):
    """The extended model, what the addition changed, and its gain in log evidence."""

    model: Model
    gain: Annotated[Gain, INLINE]
    evidence: Annotated[float, Key("Gain in log evidence.", "log_evidence")]
    notes: Annotated[tuple[Note, ...], Key("What else there is to know.")] = ()

    @property
    def axis(self) -> Annotated[Axis, Key()]:
        """The plane."""
        return self.model.axis

    @property
    def coefficients(self) -> Annotated[Mapping[str, AddedCoefficient], Key()]:
        """The coefficients of the added effects, by name."""
        model, bound = self.model, at_bound(self.model)
        shared = (c for n in self.gain.added for c in as_fitted(pick_effect(n), model.values).shared)
        return {c.name: AddedCoefficient(model.values[c.name], model.std_error(c.name), c.unit, c.name in bound) for c in shared}

    @property
    def pays(self) -> Annotated[bool, Key()]:
        """Whether the error falls by more than a negligible factor; where all data were fitted, the evidence must rise too."""
        before, after = self.gain.over_floor
        return after < MAX_ERROR_RATIO * before and (self.gain.unseen or self.evidence > 0.0)


def extend_in_steps(
    parent: Model,
    add: Sequence[str],
    training: Sequence[Run],
    validation: Sequence[Run] = (),
    *,
    found: Model | None = None,
    report: Callable[[str], None] = lambda _text: None,
    unfit: Refused[Run] | None = None,
) -> tuple[Extension, ...]:
    """Return one extension for each effect added, each of the model of the step before.

    All steps come from one search, in which the base parameters and all effects are refitted to the training runs together. The
    full set of effects is reached in the best of several orders; the order of the steps is one of them. `found` is a model with
    all effects, as a diagnosis names it: the full set is also fitted from its values, and each step adds the effect that lowers
    the error most. Without validation runs, a part of the training runs is held out for validation. Where the training runs do
    not determine the size of an addition, it may be accepted though the error on the validation runs does not fall; then all runs
    are fitted together. `report` is called with the name of each trial. `unfit` is called with each of several runs that cannot
    be fitted; without `unfit`, and where no run of a group can be fitted, the error of the run is raised. Raises UsageError for
    an effect that is unknown, of the other axis or in the model already, DataError for runs that cannot be used or lack a signal
    the effects need, EffectError for a user's effect that fails, or whose coefficient has a name that another effect uses.
    """
    new = new_effects(parent, add)
    fitted, checked = records_of([training, validation], parent.axis, unfit)
    records, unseen = [record for _, record in fitted], tuple(record for _, record in checked)
    learned, judged, notes = (tuple(records), unseen, ()) if unseen else holdout_split(records)
    parts = _with_signals((*(effect_held(n, parent.own) for n in parent.effects), *new), [*learned, *judged])
    notes = (*notes, *left_out([run for run, _ in (*fitted, *checked)], parent.axis))
    begin = partial(Search, axis=parent.axis, catalogue=parts, known=parent.effects, report=report, thorough=True, given=parent)
    work = begin(learned, judged)
    line = _refitted_line(work, new, found)
    steps = _extensions_of_line(work, line, notes)
    if not judged or whole_of(steps).pays or not is_accepted(line[0], line[-1]):
        return steps
    work = begin((*learned, *judged), ())
    return _extensions_of_line(work, _refitted_line(work, new, found), (*notes, FITTED_TO_ALL))


def whole_of(steps: Sequence[Extension]) -> Extension:
    """Return steps as one extension, from before the first to after the last, with the notes on the runs of the last one."""
    first, last = steps[0].gain, steps[-1].gain
    gain = replace(last, added=tuple(name for s in steps for name in s.gain.added), before=first.before)
    notes = (*(n for s in steps[:-1] for n in s.notes if n.code == FORM_TAKEN), *steps[-1].notes)
    return replace(steps[-1], gain=gain, evidence=sum(s.evidence for s in steps), notes=notes)


def _refitted_line(work: Search, new: Sequence[Effect], found: Model | None) -> list[ScoredModel]:
    """Return the refitted parent and the refitted models after each addition: in order, or as the error falls most with `found`.

    The full set is built up from the best few sets of each size and from the line's own. Then the search of `diagnose` runs with
    these effects alone, and the better optimum of each set is kept, for the full set also from the values of `found`.
    """
    work.base()
    line, front = [work.root], {work.root}
    for effect in new:
        children = {frozenset(c.names): c for key in front for c in work.grow(work.tried[key], forced=True)}
        longer = [c for names, c in children.items() if line[-1] < names]
        line.append(line[-1] | {effect.name} if found is None else _nearest(longer, work.floor))
        front = set(sorted(children, key=lambda key: -children[key].log_evidence)[:BEAM_WIDTH]) | {line[-1]}
    if found is not None:
        work.tried[line[-1]] = refitted_from(found, work.tried[line[-1]], work.grounds)
    work.best()
    return work.parallel.map(work.reported, [work.tried[names] for names in line])


def _nearest(models: Sequence[ScoredModel], floor: Noise) -> frozenset[str]:
    """Return the names of the effects of the model with the least error of all runs over a noise floor."""
    return frozenset(min(models, key=lambda h: h.error_of_all_runs(floor)).names)


def _extensions_of_line(
    work: Search, line: Sequence[ScoredModel], notes: tuple[Note, ...]
) -> tuple[Extension, ...]:  # fmt: skip
    """Return the extensions from each model of a line to the next; the residual of the last defines the noise of all."""
    work.lower_floor(line[-1])
    return tuple(_extension(work, before, after, notes) for before, after in pairwise(line))


def _extension(
    work: Search, before: ScoredModel, after: ScoredModel, notes: tuple[Note, ...]
) -> Extension:  # fmt: skip
    """Return the extension from a model without an effect to one with it, both fitted by one search."""
    learned, judged = work.records, work.validation
    new = [e for e in work.catalogue if e.name in {*after.names} - {*before.names}]
    moment_std = common_own_moment(before, after)
    before, after = before.with_own_moment(moment_std), after.with_own_moment(moment_std)
    noise = work.tested_fit(after).noise
    gain = Gain(
        added=tuple(e.name for e in new),
        before=before.errors,
        after=after.errors,
        noise_floor=told_floor(reported_noise_floor(work.floor, noise), learned),
        unseen=bool(judged),
        learned_on=tuple(r.name for r in learned),
        judged_on=tuple(r.name for r in (judged or learned)),
    )
    model = final_model(after)
    notes = (*notes, *forms_taken(model, new), *as_flown(model, judged))
    return Extension(model, gain, after.log_evidence - before.log_evidence, notes)


def forms_taken(model: Model, new: Sequence[Effect]) -> tuple[Note, ...]:
    """Return a note for each effect that a model has in a variant other than the textbook form, with the variant in words."""
    notes = []
    for effect in new:
        own, textbook = effect.names & set(model.values), {c.name for c in effect.coefficients}
        form = next((v for v in effect.variants if {c.name for c in v.coefficients} | (textbook - set(v.without)) == own), None)
        if form is not None and own != textbook:
            words = (
                f"`{effect.name}` has more evidence here in a form that is not the textbook's ({form.says}: "
                f"{', '.join(sorted(own - textbook))}): where `diagnose` judged another form, its error is another"
            )
            notes.append(Note(FORM_TAKEN, words, {"effect": effect.name, "coefficients": sorted(own)}))
    return tuple(notes)


def new_effects(parent: Model, add: Sequence[str]) -> tuple[Effect, ...]:
    """Return the effects that are to be added to a model; raises UsageError or EffectError as `extend_in_steps` does."""
    names = tuple(dict.fromkeys(add))
    if not names:
        raise UsageError("there is no effect to add", hint="name one: `--add servo_lag`; `sysid diagnose` says which is missing")
    effects = tuple(pick_effect(n) for n in names)
    for effect in effects:
        if effect.name in parent.effects:
            raise UsageError(
                f"effect `{effect.name}` is in the model already",
                found=", ".join(parent.effects),
                hint="refit the model as it is: `sysid identify RUN... --effects " + ",".join(parent.effects) + "`",
            )
        if parent.axis not in effect.axes:
            raise UsageError(
                f"effect `{effect.name}` does not act on the {parent.axis.value} axis",
                found=", ".join(a.value for a in effect.axes),
                hint=f"see `sysid effects list --axis {parent.axis.value}`",
            )
        refuse_clash(effect, (effect_held(n, parent.own) for n in parent.effects))
    return effects


def _with_signals(parts: Sequence[Effect], records: Sequence[Record]) -> tuple[Effect, ...]:
    """Return the effects with the variants that can be tried; raises DataError for one whose signals the records lack."""
    kept, skipped = applicable_effects(parts, records)
    for name, why in skipped.items():
        raise DataError(
            f"effect `{name}` {why}",
            found=", ".join(dict.fromkeys(f"{r.name} has {', '.join(sorted(r.signals)) or 'none'}" for r in records)),
            hint="map the signal on import, where the log has it, or leave the effect out",
        )
    return kept
