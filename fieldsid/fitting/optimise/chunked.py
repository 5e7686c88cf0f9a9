"""Normal equations of a long record in chunks, so that its sensitivities are never in memory all at once."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fieldsid.fitting.problem.problem import Problem
from fieldsid.models.model import Noise
from fieldsid.noise.whiten import is_white
from fieldsid.numerics.arrays import FloatArray

CHUNK_SAMPLES = 20_000


def is_chunked(problem: Problem, noise: Noise) -> bool:
    """Whether a problem is long, and can be processed in chunks: without sensor effects, extra states and run moments."""
    simple = all(e.measure is None and e.moment is None and not e.extra_states for e in problem.layout.effects)
    return simple and is_white(noise) and max(len(r) for r in problem.records) > 2 * CHUNK_SAMPLES


def chunked_normal_equations(
    problem: Problem, x: FloatArray, noise: Noise, free: Sequence[int]
) -> tuple[float, FloatArray, FloatArray]:
    """Return whitened cost, normal matrix (F, F) and gradient (F,) under white noise."""
    place = {slot: i for i, slot in enumerate(free)}
    total, normal, gradient = 0.0, np.zeros((len(free), len(free))), np.zeros(len(free))
    sigma = np.array([noise.angle, noise.rate])[:, None]
    for run, record in enumerate(problem.records):
        slots, pieces = problem.linearise_chunked(x, run, free, CHUNK_SAMPLES)
        index = np.array([place[s] for s in slots], dtype=int)
        for part, out, sens in pieces:
            ok, measured = record.ok[:, part], record.both[:, part]
            flat = (np.where(ok, sens, 0.0) / sigma).reshape(len(slots), -1)
            left = (np.where(ok, measured - out[:, :2].T, 0.0) / sigma).ravel()
            if not (np.isfinite(left).all() and np.isfinite(sens).all()):
                return float("inf"), normal, gradient
            normal[np.ix_(index, index)] += flat @ flat.T
            gradient[index] += flat @ left
            total += float(left @ left)
    return total, normal, gradient
