"""Refit of a set of effects with events at the times that its subsets have found."""

from __future__ import annotations

from fieldsid.diagnosis.evidence.scored_model import ScoredModel
from fieldsid.diagnosis.moves.add_effect import starts_apart
from fieldsid.diagnosis.moves.archive import Archive
from fieldsid.diagnosis.moves.grounds import Grounds
from fieldsid.fitting.initial.effect_screen import carry_parameters


def with_events_of_parts(h: ScoredModel, effect: str, tried: Archive, grounds: Grounds) -> ScoredModel:
    """Return a model fitted again with each event at its time in a subset that has an effect too, where that is better.

    A scan takes the times of an event in all runs from one linearisation. Beside another effect that fits a part of what the
    event does, it takes a wrong time in some run, and no descent leaves it.
    """
    for part in (w for _, w in tried.without_each(h) if effect in w.names):
        for place, slot in enumerate(h.likelihood_fit.fitted.problem.layout.parameters):
            fitted = h.likelihood_fit.fitted
            times = carry_parameters(fitted.problem.layout, part.likelihood_fit.fitted.vector, fitted.vector)
            if slot.is_event and starts_apart(times[place], fitted.x[place]):
                start = fitted.x.copy()
                start[place] = times[place]
                h = grounds.better(h, grounds.fit(fitted.problem, start, h.likelihood_fit.noise))
    return h
