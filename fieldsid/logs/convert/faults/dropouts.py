"""Find drop-outs: one fill value to which a sensor jumps repeatedly, such as 0 without a satellite fix, or -999 of a logger.

A noisy signal returns to exactly the same number by chance only where its digits are few. A number is a fill value if the signal
jumps to it and back by more than its noise explains, and more often than by chance. The chance follows from how many different
numbers the jumps could reach, which is estimated from how often the other jumps reach equal numbers. A number that the signal
often has, because it rests there, is expected at the end of many jumps, and is no fill value.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
from scipy.special import gammainc

from fieldsid.logs.convert.faults.spikes import DIGITS, OF_MEDIAN, SPREADS, last_digit
from fieldsid.logs.convert.faults.spikes import FEWEST as SHORTEST
from fieldsid.logs.run import FINS, MEASURED, SIGNALS, Note
from fieldsid.numerics.arrays import FloatArray

MOST_CHANCE = 1e-3
"""Largest probability of so many jumps to one number by chance at which that number is a fill value."""
FEWEST = 3
"""Smallest number of jumps to one number for a drop-out; fewer may be spikes."""
SENSED = MEASURED - {*FINS}
"""Signals that are searched for drop-outs: not the fins, which jump to the same angles again and again."""


def _chance(count: int, others: npt.NDArray[np.intp]) -> float:
    """Return the probability that any number ends `count` jumps by chance, where each other number ends `others` (k,) jumps.

    Of N jumps to V equally likely numbers, N (N - 1) / V ordered pairs end at the same number, which gives V. The incomplete
    gamma function is the probability of `count` events or more with a mean number of its second argument (Poisson).
    """
    jumps, pairs = int(others.sum()), int((others * (others - 1)).sum())
    if pairs == 0:
        return 0.0
    numbers = jumps * (jumps - 1) / pairs
    return numbers * float(gammainc(count, (jumps + count) / numbers))


def _note(name: str, number: float, count: int, samples: int) -> Note:
    """Return the finding that a signal jumps to one number and back so often, and how many samples it has."""
    unit, shown = SIGNALS[name], f"{number:.6g}"
    if unit in ("rad", "rad/s"):  # most logs have the number in degrees
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
    """Return the fill value of a signal (n,) without gaps, its number of jumps and of samples; None where there is none."""
    if values.size < SHORTEST:
        return None
    steps = np.diff(values)
    bend = float(np.median(np.abs(np.diff(values, 2))))
    limit = max(SPREADS * OF_MEDIAN * bend, DIGITS * last_digit(values), 1e-12)
    far = np.flatnonzero(np.abs(steps) > limit)
    if far.size < 2 * FEWEST:
        return None
    numbers, counts = np.unique(values[far + 1] + 0.0, return_counts=True)  # + 0.0 makes -0.0 equal to 0.0
    k = int(np.argmax(counts))
    number, count = float(numbers[k]), int(counts[k])
    jumps_back = int(np.count_nonzero(values[far] == number))
    samples = int(np.count_nonzero(values == number))
    chance = max(_chance(count, np.delete(counts, k)), float(gammainc(count, far.size * samples / values.size)))
    if count < FEWEST or jumps_back < FEWEST - 1 or chance > MOST_CHANCE:
        return None
    return number, count, samples
