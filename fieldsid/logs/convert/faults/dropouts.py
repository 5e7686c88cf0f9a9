"""A sensor that falls to one and the same number, time and again: zeros of a lost lock, -999 and 9999 of a logger.

What moves with noise comes back to one number to the last bit by chance only where its digits are few. A number to which a signal
jumps, from beyond what its noise explains, and from which it jumps back is no measurement, where it does so oftener than chance:
how many numbers there are to land on is told by how often the other jumps land on the same one, and a number at which the signal
rests is one that many jumps end at.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from fieldsid.logs.convert.faults.spikes import DIGITS, OF_MEDIAN, SPREADS, last_digit
from fieldsid.logs.run import FINS, MEASURED, SIGNALS, Note
from fieldsid.numerics.arrays import FloatArray

MOST_CHANCE = 1e-3
"""Chance, of any number at all, that jumps land on it as often, above which it is one of few digits."""
FEWEST = 3
"""Jumps to one number from which on it is a drop-out; a spike may stand alone."""
SENSED = MEASURED - {*FINS}
"""A fin jumps, and to the same angles."""


def _chance(count: int, others: npt.NDArray[np.intp]) -> float:
    """Return the chance that some number is landed on `count` times, where others are by `others` (k,) times each.

    Of N jumps to V equally likely numbers, N (N - 1) / V ordered pairs land on the same: that gives V.
    """
    jumps, pairs = int(others.sum()), int((others * (others - 1)).sum())
    if pairs == 0:
        return 0.0
    numbers = jumps * (jumps - 1) / pairs
    return numbers * _as_many(count, (jumps + count) / numbers)


def _as_many(count: int, usual: float) -> float:
    """Return the chance of `count` events or more where `usual` are expected (Poisson)."""
    return max(1.0 - sum(math.exp(-usual + i * math.log(usual) - math.lgamma(i + 1)) for i in range(count)), 0.0)


def _note(name: str, number: float, count: int, samples: int) -> Note:
    """Return the finding that a signal jumps to one number and back so often, and how many samples it has."""
    unit, shown = SIGNALS[name], f"{number:.6g}"
    if unit in ("rad", "rad/s"):  # most logs have it in degrees
        shown += f" {unit} ({math.degrees(number):.6g} {unit.replace('rad', 'deg')})"
    message = (
        f"{name} jumps to exactly {shown} and back {count} times, {samples} samples in all (limit {FEWEST}): what "
        f"its sensor or logger writes where it has nothing; they are missing now"
    )
    return Note("dropouts", message, {"signal": name, "value": count, "limit": FEWEST, "number": number, "samples": samples})


def without_dropouts(name: str, values: FloatArray) -> tuple[FloatArray, list[Note]]:
    """Return a signal (n,) with its drop-outs missing, and the notes that say so."""
    notes = list[Note]()
    while (found := _dropout_of(values[np.isfinite(values)])) is not None:
        notes.append(_note(name, *found))
        values = np.where(values == found[0], np.nan, values)
    return values, notes


@np.errstate(over="ignore", invalid="ignore")
def _dropout_of(values: FloatArray) -> tuple[float, int, int] | None:
    """Return the number to which a signal (n,) without gaps jumps and back again, how often, and its samples; None for none."""
    if values.size < 20:
        return None
    steps = np.diff(values)
    usual = float(np.median(np.abs(np.diff(values, 2))))
    limit = max(SPREADS * OF_MEDIAN * usual, DIGITS * last_digit(values), 1e-12)
    far = np.flatnonzero(np.abs(steps) > limit)
    if far.size < 2 * FEWEST:
        return None
    numbers, counts = np.unique(values[far + 1] + 0.0, return_counts=True)  # a zero has no sign
    k = int(np.argmax(counts))
    number, count = float(numbers[k]), int(counts[k])
    left = int(np.count_nonzero(values[far] == number))
    samples = int(np.count_nonzero(values == number))
    chance = max(_chance(count, np.delete(counts, k)), _as_many(count, far.size * samples / values.size))
    if count < FEWEST or left < FEWEST - 1 or chance > MOST_CHANCE:
        return None
    return number, count, samples
