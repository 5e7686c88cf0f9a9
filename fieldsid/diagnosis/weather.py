"""The sea and the sensors together: the noise that what is left of a hypothesis is judged under.

A search compares hypotheses under one kind of noise, a moment that disturbs the hull or sensors whose noise is coloured. On
some days both are there: sensors that wander for seconds in a sea that moves the hull. A motion is in angle and rate alike,
the one the integral of the other; the sensors' wander is in each by itself. So the data tell the two apart.
"""

from __future__ import annotations

from fieldsid.diagnosis.hypothesis import Hypothesis
from fieldsid.diagnosis.trial import NOISES, Judged, judge
from fieldsid.diagnosis.worth import WORTH


def in_its_weather(h: Hypothesis) -> Judged:
    """Return a hypothesis at its best under sea and sensors together, where that is likelier on the runs fitted to.

    Its own numbers go with it: what one kind alone has to take for the other bends them.
    """
    own, problem = h.judged, h.judged.trial.problem
    other = judge(problem, own.trial.x, own.noise, own.floor, next(f for f in NOISES if f != own.family))
    # from what one kind alone has taken of both there may be no way back: from each of them
    both = max((judge(problem, j.trial.x, j.noise, own.floor, "both") for j in (own, other)), key=lambda j: j.likelihood)
    return both if both.likelihood > own.likelihood + WORTH else own
