"""Kinds of noise under which models are compared: a disturbance moment, coloured sensor noise, or both together.

Some logs have both. A disturbance moves angle and rate together, the angle as the integral of the rate; coloured sensor noise is
independent in each channel. So the data separate them: where there is no coloured sensor noise, a model with it gains no
likelihood, whatever effect is missing.
"""

from __future__ import annotations

from fieldsid.diagnosis.data.noise_floor import reported_noise_floor
from fieldsid.diagnosis.evidence.likelihood_fit import (
    MIN_LIKELIHOOD_GAIN,
    FittedProblem,
    LikelihoodFit,
    fit_maximum_likelihood,
)
from fieldsid.diagnosis.evidence.scored_model import ScoredModel
from fieldsid.diagnosis.parallel_map import ParallelMap
from fieldsid.diagnosis.thresholds import ALTERNATIVE_LOG_ODDS, MIN_COLOUR_RATIO
from fieldsid.models.model import Noise
from fieldsid.noise.noise_kinds import JOINT_NOISE, SINGLE_NOISE_KINDS
from fieldsid.noise.white_floor import WhiteBounds


def fit_base(fitted: FittedProblem, floor: Noise, white: WhiteBounds, parallel: ParallelMap) -> LikelihoodFit:
    """Return the base model under the likeliest kind of noise, or both kinds together where that is so.

    White noise is a member of every kind: a later kind is taken only where it gains more than MIN_LIKELIHOOD_GAIN.
    """
    best, *others = parallel.map(
        lambda f: fit_maximum_likelihood(fitted.problem, fitted.x, floor, white, f),
        SINGLE_NOISE_KINDS,
    )
    for other in others:
        best = other if other.log_likelihood > best.log_likelihood + MIN_LIKELIHOOD_GAIN else best
    return joint_noise_fit(best, parallel) if has_sensor_colour(best) else best


def joint_noise_fit(own: LikelihoodFit, parallel: ParallelMap) -> LikelihoodFit:
    """Return the fit of a model under disturbance and sensor colour together, where that is likelier on the training runs.

    The parameters are refitted too, since they are biased where one kind of noise must represent both.
    """
    if own.noise_kind == JOINT_NOISE:
        return own
    problem = own.fitted.problem
    other = fit_maximum_likelihood(
        problem, own.fitted.x, own.noise, own.white, next(f for f in SINGLE_NOISE_KINDS if f != own.noise_kind)
    )
    if not (has_sensor_colour(own) or has_sensor_colour(other)):
        return own
    # start from both fits: an optimum under one kind may be a local minimum under the joint noise
    least = own.log_likelihood + ALTERNATIVE_LOG_ODDS
    ends = parallel.map(
        lambda j: fit_maximum_likelihood(problem, j.fitted.x, j.noise, own.white, JOINT_NOISE, rival=least), (own, other)
    )
    both = max(ends, key=lambda j: j.log_likelihood)
    return both if both.log_likelihood > least else own


def has_sensor_colour(ml_fit: LikelihoodFit) -> bool:
    """Whether the coloured sensor noise exceeds MIN_COLOUR_RATIO times the white one."""
    noise, floor = ml_fit.noise, ml_fit.white.floor
    return noise.coloured_angle > MIN_COLOUR_RATIO * floor.angle or noise.coloured_rate > MIN_COLOUR_RATIO * floor.rate


def sensor_noise(floor: Noise, base: ScoredModel | None) -> Noise:
    """Return the noise floor, with the sensors' coloured noise where the base was fitted under both kinds together."""
    return (
        reported_noise_floor(floor, base.likelihood_fit.noise)
        if base is not None and base.likelihood_fit.noise_kind == JOINT_NOISE
        else floor
    )
