"""Which noise hypotheses are compared under: a sea that moves the hull, sensors that wander, or both together.

On some days both are there. A motion is in angle and rate alike, the one the integral of the other; the sensors' wander is in
each by itself. So the data tell the two apart: where there is no wander, adding it gains nothing, whatever is missing.
"""

from __future__ import annotations

from collections.abc import Collection

from fieldsid.diagnosis.beside import Beside
from fieldsid.diagnosis.floor import TRACE, shown_floor
from fieldsid.diagnosis.hypothesis import Hypothesis
from fieldsid.diagnosis.trial import BOTH, NOISES, SETTLED, Judged, Trial, judge
from fieldsid.diagnosis.worth import WORTH
from fieldsid.models.model import Noise


def base_judged(trial: Trial, floor: Noise, told: Noise, family: str, beside: Beside) -> Judged:
    """Return the base under the kind of noise that is likeliest, or the one given, and under both together where that tells.

    White noise is alike to all kinds: a later one is taken only where it is likelier by more than a search settles to.
    """
    best, *others = beside.each(lambda f: judge(trial.problem, trial.x, floor, told, f), (family,) if family else NOISES)
    for other in others:
        best = other if other.likelihood > best.likelihood + SETTLED else best
    return in_its_weather(best, beside) if wanders(best) else best


def in_its_weather(own: Judged, beside: Beside) -> Judged:
    """Return a hypothesis at its best under sea and sensors together, where that is likelier on the runs fitted to.

    Its own numbers go with it: what one kind alone has to take for the other bends them.
    """
    if own.family == BOTH:
        return own
    problem = own.trial.problem
    other = judge(problem, own.trial.x, own.noise, own.floor, next(f for f in NOISES if f != own.family))
    if not (wanders(own) or wanders(other)):
        return own
    # from what one kind alone has taken of both there may be no way back: from each of them
    least = own.likelihood + WORTH
    ends = beside.each(lambda j: judge(problem, j.trial.x, j.noise, own.floor, BOTH, rival=least), (own, other))
    both = max(ends, key=lambda j: j.likelihood)
    return both if both.likelihood > least else own


def other_noise(h: Hypothesis, floor: Noise, begun: Collection[str], beside: Beside) -> Judged | None:
    """Return a hypothesis under a kind of noise that no search has begun with, where that is likelier, None where none is.

    Both together are asked for where sensors wander by more than a trace.
    """
    own = h.judged
    for family in (f for f in NOISES if f not in begun):
        judged = judge(own.trial.problem, own.trial.x, floor, own.floor, family)
        if judged.likelihood > own.likelihood + WORTH:
            return judged
    if BOTH in begun or not wanders(own):
        return None
    both = in_its_weather(own, beside)
    return None if both is own else both


def wanders(judged: Judged) -> bool:
    """Whether sensors wander by more than a trace of their white noise."""
    noise, floor = judged.noise, judged.floor
    return noise.coloured_angle > TRACE * floor.angle or noise.coloured_rate > TRACE * floor.rate


def sensors(floor: Noise, base: Hypothesis | None) -> Noise:
    """Return the noise floor, with the sensors' wander where a base was judged under sea and sensors together."""
    return shown_floor(floor, base.judged.noise) if base is not None and base.judged.family == BOTH else floor
