"""Signals that the residual follows: a regression of the moment that the model lacks on every signal of the run.

The residual of the rate obeys e' + a e = missing moment to first order; means over a quarter of a second reduce the sensor noise.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from fieldsid.fitting.fin_history import BLOCK_S
from fieldsid.fitting.predict.predict import Prediction
from fieldsid.numerics.arrays import FloatArray
from fieldsid.numerics.block_means import block_means, block_width
from fieldsid.records.keys import Key

FEWEST_BLOCKS = 20


@dataclass(frozen=True, slots=True)
class Companion:
    """A signal, and the share (0..1) of the missing moment's variance that it and its square with sign explain."""

    signal: Annotated[str, Key("The signal, in words.")]
    explained: Annotated[float, Key("Share of the missing moment's variance that it explains.")]


def missing_moment(shown: Prediction, damping: float) -> tuple[FloatArray, FloatArray]:
    """Return block times (m,) s and the missing moment (m,) rad/s^2; empty where the rate was not measured."""
    record = shown.record
    if not record.rate_ok.all() or len(record) < 3:
        return np.zeros(0), np.zeros(0)
    residual = record.rate - shown.rate
    width = block_width(record.steps, BLOCK_S)
    time, slow = block_means(record.time, width), block_means(residual, width)
    if time.size < FEWEST_BLOCKS:
        return np.zeros(0), np.zeros(0)
    return time, np.gradient(slow, time) + damping * slow


def companions(shown: Prediction, damping: float) -> tuple[Companion, ...]:
    """Return the signals by the share of the missing moment that they explain, the largest first."""
    _, moment = missing_moment(shown, damping)
    if moment.size == 0 or float(np.var(moment)) == 0.0:
        return ()
    width = block_width(shown.record.steps, BLOCK_S)
    found = [Companion(name, _share_explained(moment, block_means(values, width))) for name, values in _signals(shown).items()]
    return tuple(sorted(found, key=lambda c: -c.explained))


def _signals(shown: Prediction) -> Mapping[str, FloatArray]:
    change = np.diff(shown.fin, prepend=shown.fin[0])
    return {"fin": shown.fin, "fin movement": change, "rate": shown.rate, "angle": shown.angle, **shown.record.signals}


def _share_explained(moment: FloatArray, signal: FloatArray) -> float:
    centred = signal - np.median(signal)
    if float(np.ptp(centred)) == 0.0:
        return 0.0
    columns = np.stack([np.ones(centred.size), centred, centred * np.abs(centred)], axis=1)
    columns /= np.maximum(np.abs(columns).max(axis=0), 1e-300)
    unexplained = moment - columns @ np.linalg.lstsq(columns, moment, rcond=None)[0]
    return max(0.0, 1.0 - float(np.var(unexplained)) / float(np.var(moment)))
