"""A sensor that falls to one and the same number, time and again: zeros of a lost lock, -999 and 9999 of a logger.

What moves with noise comes back to one number to the last bit by chance only where its digits are few. A number to which a signal
jumps, from beyond what its noise explains, and from which it jumps back is no measurement.
"""

from __future__ import annotations

import numpy as np

from fieldsid.logs.doctor.spikes import DIGITS, OF_MEDIAN, SPREADS, last_digit
from fieldsid.logs.run import GOALS, SIGNALS, Note
from fieldsid.numerics.arrays import FloatArray

FEWEST = 3
"""Jumps to one number from which on it is a drop-out; a spike may stand alone."""
SENSED = (
    frozenset(SIGNALS)
    - GOALS
    - {"thrust", "thrust_ratio", "propeller_rpm"}
    - {n for n in SIGNALS if n.startswith(("rudder", "elevator"))}
)
"""A fin jumps, and to the same angles."""


@np.errstate(over="ignore", invalid="ignore")
def dropout_findings(name: str, values: FloatArray) -> list[Note]:
    """Return the finding that a signal (n,) without gaps jumps to one number and back; none where it does not."""
    if name not in SENSED or values.size < 20:
        return []
    steps = np.diff(values)
    usual = float(np.median(np.abs(np.diff(values, 2))))
    limit = max(SPREADS * OF_MEDIAN * usual, DIGITS * last_digit(values), 1e-12)
    far = np.flatnonzero(np.abs(steps) > limit)
    if far.size < 2 * FEWEST:
        return []
    numbers, counts = np.unique(values[far + 1], return_counts=True)
    k = int(np.argmax(counts))
    number, count = float(numbers[k]), int(counts[k])
    left = int(np.count_nonzero(values[far] == number))
    if count < FEWEST or left < FEWEST - 1:
        return []
    samples = int(np.count_nonzero(values == number))
    message = (
        f"{name} jumps to exactly {number:.6g} and back {count} times, {samples} samples in all (limit {FEWEST}): what its "
        "sensor or logger writes where it has nothing; leave those cells empty"
    )
    return [Note("dropouts", message, {"signal": name, "value": count, "limit": FEWEST, "number": number, "samples": samples})]
