"""A run's own speed: its log has it to about a third of a percent, and twice that goes into the authority.

A heading adds that up: a turn of two radians that is half a percent short is off by five times a compass's noise. So the
speed of a run that a model is flown on is its own unknown, as its initial state is, with the measurement as what is known
of it: the share e that it was faster by is at the minimum of

    sum over channels |r - S e|^2 / (L s^2) + (e / MEASURED)^2,   |e| <= MOST MEASURED,

r the residual and S its change with the speed, both with what a better start would take from them taken away, s the rms of
r and L its correlation length, so that what a wrong model leaves weighs little. A speed that nobody measured stays as it is.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fieldsid.fitting.between import LAGS_S, correlation_length, left_rms
from fieldsid.fitting.problem import Problem
from fieldsid.fitting.products import solved
from fieldsid.logs.run import FloatArray, Note
from fieldsid.models.axis import NAMES
from fieldsid.models.model import Noise
from fieldsid.models.record import Record

MEASURED, GUESSED = 0.003, 0.01
"""Standard error, as a share, that the speed of a run is taken to have, where it was measured and where it was not."""
MOST = 3.0
"""Errors of the measurement that a speed is moved by at most."""
ROUNDS, SETTLED = 4, 0.02
"""Rounds, each with the weights of what the last one has left, and the change in errors of the measurement that ends them."""
WORTH_SAYING = 0.001
SURPRISING = 2.0
"""Standard errors from which on a speed that is off is a finding of its own."""


def speed_doubt(problem: Problem, x: FloatArray, speed: float) -> FloatArray:
    """Return what a one-run problem's shared slots (F,) move by where the run's speed is off by as much as it may be."""
    return (MEASURED if np.isfinite(speed) else GUESSED) * _moves(problem, x)


def at_own_speed(problem: Problem, x: FloatArray, floor: Noise) -> tuple[Problem, FloatArray, float]:
    """Return a one-run problem at the run's own speed, x (N,) with its start moved along, and the share it was faster by."""
    groups = problem.layout.groups
    if not (np.isfinite(groups.run_speeds[0]) and np.isfinite(groups.speeds[groups.reference])):
        return problem, x, 0.0
    moved, own, faster = problem, x, 0.0
    for _ in range(ROUNDS):
        step = _step(moved, own, faster, floor)
        if step is None:
            return problem, x, 0.0
        new = float(np.clip(faster + step[-1], -MOST * MEASURED, MOST * MEASURED))
        own = own.copy()
        own[problem.layout.shared :] += step[:-1]
        moved, change, faster = _faster(problem, new), new - faster, new
        if abs(change) < SETTLED * MEASURED:
            break
    return moved, own, faster


def says_much(faster: float) -> bool:
    """Whether a share is worth telling of."""
    return abs(faster) >= WORTH_SAYING


def said(record: Record, faster: float) -> Note | None:
    """Return the note on a run that was flown at another speed than its log has, None where that is next to nothing.

    One that is off by more than its measurement should be is a finding: of the log's scale, or of the model.
    """
    if not says_much(faster):
        return None
    way, errors = "faster" if faster > 0.0 else "slower", abs(faster) / MEASURED
    said = (
        f"{record.name}: as the motion says, flown {100 * abs(faster):.2f} % {way} than the {record.speed:.3f} m/s of its log, "
        f"{errors:.1f} x the standard error of {100 * MEASURED:g} % that a measured speed is taken to have"
    )
    if errors >= SURPRISING:
        most = f" ({100 * MOST * MEASURED:g} % is the most it is moved by)" if errors > MOST - SETTLED else ""
        said += f"{most}: the scale of its speed is probably off, or the model is at this speed"
    return Note("own_speed", said, {"run": record.name, "faster": faster, "speed_m_s": record.speed, "std_error": MEASURED})


def _faster(problem: Problem, share: float) -> Problem:
    groups = problem.layout.groups
    speeds = (groups.run_speeds[0] * (1.0 + share),)
    return Problem(problem.records, replace(problem.layout, groups=replace(groups, run_speeds=speeds)))


def _step(problem: Problem, x: FloatArray, faster: float, floor: Noise) -> FloatArray | None:
    """Return the change of the run's own slots and, last, of the share it was faster by; None where the motion diverges."""
    record, shared = problem.records[0], problem.layout.shared
    result = problem.linearise(x, 0)
    if not np.isfinite(result.stack).all():
        return None
    slopes = np.zeros((x.size, *result.residual.shape))
    slopes[list(result.slots)] = result.sensitivity * record.ok
    columns = np.concatenate([slopes[shared:], np.tensordot(_moves(problem, x), slopes[:shared], axes=1)[None]])
    weight = _weights(record, result.residual, floor)[:, None]
    flat, left = (columns * weight).reshape(columns.shape[0], -1), (result.residual * weight).ravel()
    gram, right = flat @ flat.T, flat @ left
    gram[-1, -1] += MEASURED**-2
    right[-1] -= faster * MEASURED**-2
    return solved(gram, right)


def _weights(record: Record, residual: FloatArray, floor: Noise) -> FloatArray:
    """Return the weight of each channel (2,): over the rms of what is left of it, correlated samples counted once."""
    lags = round(LAGS_S / float(np.median(record.steps)))
    lengths = [correlation_length(e[ok], lags) if ok.any() else 1.0 for e, ok in zip(residual, record.ok, strict=True)]
    return 1.0 / (left_rms(record, residual, floor) * np.sqrt(lengths))


def _moves(problem: Problem, x: FloatArray) -> FloatArray:
    """Return what a one-run problem's shared slots (F,) move by with each share that the run is faster by."""
    layout, names = problem.layout, NAMES[problem.layout.axis]
    powers = {names.damping: layout.groups.exponent, names.authority: 2.0, names.trim: 2.0 * layout.groups.trim_of_fin}
    return np.array([powers.get(n, 0.0) * x[i] for i, n in enumerate(layout.names)])
