"""Places of a model's error: the share of the squared error under each condition, and the worst stretches of the run."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from fieldsid.comparison.conditions import Condition, Mask
from fieldsid.numerics.arrays import FloatArray
from fieldsid.records.keys import Key

SMALLEST_SHARE = 0.02
"""Share of the samples below which a condition is left out."""
STRETCH_WINDOW_S = 2.0
JOIN_S = 0.5
MOST_STRETCHES = 3


@dataclass(frozen=True, slots=True)
class Place:
    """Where: the condition, its share of the squared error and of the samples, its rms over the run's, its worst time."""

    condition: Annotated[str, Key("In words: `phase: onset`, `side: port`, `rate: above 0.14 rad/s`.")]
    share_of_error: Annotated[float, Key("Share of the squared error that falls on it, 0 to 1.")]
    share_of_samples: Annotated[float, Key("Share of the samples at which it holds.")]
    rms_ratio: Annotated[float, Key("Error under it over that of the whole run.")]
    start_s: Annotated[float, Key("Start of its worst unbroken stretch.", "t_start_s")]
    end_s: Annotated[float, Key("End of that stretch.", "t_end_s")]

    @property
    def beyond(self) -> float:
        """The share of the squared error less that of the samples: it ranks the conditions by how much the model fails."""
        return self.share_of_error - self.share_of_samples


@dataclass(frozen=True, slots=True)
class Stretch:
    """A stretch of time and its share of the squared error."""

    start_s: Annotated[float, Key("Its start.", "t_start_s")]
    end_s: Annotated[float, Key("Its end.", "t_end_s")]
    share_of_error: Annotated[float, Key("Share of the squared error in it.")]


def places(time: FloatArray, square: FloatArray, ok: Mask, conditions: Sequence[Condition]) -> tuple[Place, ...]:
    """Return the places of squared residuals (n,), ordered by `Place.beyond`; ok (n,) marks the measured samples."""
    total, count = float(square[ok].sum()), int(ok.sum())
    found = []
    for condition in conditions:
        here = condition.mask & ok
        share_of_samples = here.sum() / max(count, 1)
        if share_of_samples < SMALLEST_SHARE or total == 0.0:
            continue
        share = float(square[here].sum()) / total
        start, end = worst_run(time, square, here)
        found.append(Place(condition.words, share, float(share_of_samples), float(np.sqrt(share / share_of_samples)), start, end))
    return tuple(sorted(found, key=lambda p: -p.beyond))


def worst_run(time: FloatArray, square: FloatArray, here: Mask) -> tuple[float, float]:
    """Return start and end (s) of the unbroken part of a set of samples with the most error; short breaks are bridged."""
    index = np.flatnonzero(here)
    breaks = np.flatnonzero(np.diff(time[index]) > JOIN_S)
    parts = np.split(index, breaks + 1)
    worst = max(parts, key=lambda part: float(square[part].sum()))
    return float(time[worst[0]]), float(time[worst[-1]])


def stretches(time: FloatArray, square: FloatArray, ok: Mask) -> tuple[Stretch, ...]:
    """Return the worst stretches of two seconds that do not overlap, the worst first."""
    remaining = np.where(ok, square, 0.0)
    total = float(remaining.sum())
    found: list[Stretch] = []
    while total > 0.0 and len(found) < MOST_STRETCHES:
        sums = np.concatenate([[0.0], np.cumsum(remaining)])
        ends = np.searchsorted(time, time + STRETCH_WINDOW_S, side="right")
        inside = sums[ends] - sums[:-1]
        first = int(np.argmax(inside))
        last = int(ends[first]) - 1
        if inside[first] <= 0.0:
            break
        found.append(Stretch(float(time[first]), float(time[last]), float(inside[first]) / total))
        remaining[first : last + 1] = 0.0
    return tuple(found)
