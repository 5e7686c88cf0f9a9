"""A hypothesis with one of its effects begun again from its own scan points: far from the floor a cost has many ends."""

from __future__ import annotations

from collections.abc import Collection

from fieldsid.diagnosis.beside import Beside
from fieldsid.diagnosis.hypothesis import Hypothesis, hypothesis_of, with_free_run
from fieldsid.diagnosis.trial import SETTLED, judge, refine
from fieldsid.diagnosis.ways import followed
from fieldsid.fitting.problem import Problem
from fieldsid.fitting.starts import carried, ground_of, promises_of
from fieldsid.logs.run import FloatArray
from fieldsid.models.effect import Effect
from fieldsid.models.model import Noise

DOUBTFUL = 1.5
"""Error over the noise floor from which a hypothesis may be at another end than its best."""
POINTS, ROUNDS = 6, 6
"""Scan points that are followed, and for how many rounds."""


def begun_again(h: Hypothesis, known: Collection[str], told: Noise, family: str, floor: Noise, beside: Beside) -> Hypothesis:
    """Return the likeliest end of a hypothesis's effects, each begun again beside the others.

    known are the effects of the base, which stay as they are.
    """

    def judged_from(of: tuple[Effect, bool]) -> Hypothesis:
        effect, plain = of
        problem, start = _start(h, effect, plain=plain)
        return hypothesis_of(judge(problem, start, h.judged.noise, told, family), h.validation)

    ends = beside.each(judged_from, [(e, plain) for e in h.effects if e.name not in known for plain in (True, False)])
    best = max(ends, key=lambda end: end.score, default=h)
    return with_free_run(best, floor) if best.score > h.score + SETTLED else h


def _start(h: Hypothesis, effect: Effect, *, plain: bool) -> tuple[Problem, FloatArray]:
    """Return where the best scan points of an effect lead to beside a hypothesis's others, by the free run or by its noise."""
    trial = h.judged.trial
    rest = trial.problem.with_effects([e for e in h.effects if e is not effect])
    x = carried(trial.problem.layout, trial.x, rest.layout)
    noise = h.judged.noise
    if plain:
        free = refine(rest, x, trial.weights)
        x, noise = free.x, free.weights
    ground = ground_of(rest, x, noise)
    best = followed(ground, promises_of(ground, effect)[:POINTS], rounds=ROUNDS)
    return best.problem, best.start
