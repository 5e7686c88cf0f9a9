"""How fast the recursive estimator is: the compiled sweep, one sample at a time, and a loop in NumPy, on the same rows.

    python tests/benchmarks/rls_speed.py [samples]

The answers are compared first. Times are processor time, the best of several.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable

import numpy as np

from fieldsid.fitting.regression.recursive_ls import INITIAL_VARIANCE, MEMORY, initial_memory, sweep
from fieldsid.online import OnlineIdentifier

TARGET_RATIO = 50.0
TARGET_BULK_US = 0.1
TARGET_SINGLE_US = 250.0
"""Half a per cent of a core at 20 Hz; nearly all of it is the look for a jump of authority, once a second."""
LAMBDA, BETA = 4.0, 0.9995


def log(count: int) -> np.ndarray:
    """Samples [time, fin at start, fin at end, angle, rate, counts] of a pitching vehicle, noise on both sensors."""
    rng, h = np.random.default_rng(6), 0.05
    fin = 0.2 * np.sign(np.sin(np.arange(count) * 0.05)) + 0.05 * np.sin(np.arange(count) * 0.013)
    y, q = np.zeros(count), np.zeros(count)
    for i in range(count - 1):
        q[i + 1] = q[i] + h * (-2.0 * q[i] - 0.2 * y[i] + 1.5 * fin[i] - 0.05)
        y[i + 1] = y[i] + h * q[i + 1]
    held = np.r_[0.0, fin[:-1]]
    noisy = y + 0.005 * rng.standard_normal(count), q + 0.005 * rng.standard_normal(count)
    return np.column_stack([np.arange(count) * h, held, held, *noisy, np.ones(count)])


def compiled(samples: np.ndarray, room: tuple[np.ndarray, np.ndarray, np.ndarray]) -> np.ndarray:
    """The sweep over all samples: filter, update, history of values and bands."""
    sweep(np.zeros(MEMORY), initial_memory(stiff=True), LAMBDA, BETA, 1, 4, np.zeros(5), samples, *room)
    return room[0][-1]


def plain_update(
    theta: np.ndarray, big: np.ndarray, phi: np.ndarray, target: float, beta: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return Theta (p,) and P (p, p) after one row, as the equations are written."""
    gain = big @ phi
    spread = beta + phi @ gain
    theta = theta + gain * ((target - phi @ theta) / spread)
    big = big - np.outer(gain, gain) / spread
    if float(np.diag(big).max()) < beta * INITIAL_VARIANCE:
        big = big / beta
    return theta, big


def numpy_loop(rows: np.ndarray) -> np.ndarray:
    """The same update, written as one writes it in NumPy, on rows that are filtered already."""
    theta, big = np.zeros(4), np.eye(4) * INITIAL_VARIANCE
    for row in rows:
        theta, big = plain_update(theta, big, row[:4], row[4], BETA)
    return theta


def singly(samples: np.ndarray) -> np.ndarray:
    """One sample at a time by the identifier as it runs on board."""
    online = OnlineIdentifier("pitch", bandwidth=LAMBDA, forgetting=BETA)
    fins = np.r_[samples[1:, 1], 0.0]
    for (t, _, _, angle, rate, _), fin in zip(samples.tolist(), fins.tolist(), strict=True):
        online.update(t, fin, angle, rate)
    return np.array(list(online.estimate().values.values()))


def best(call: Callable[[], np.ndarray], times: int) -> float:
    """Return the shortest processor time of a call in s."""
    found = []
    for _ in range(times):
        start = time.process_time()
        call()
        found.append(time.process_time() - start)
    return min(found)


def main() -> int:
    """Print the table and return 0 when every target is met."""
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 100_000
    samples = log(count)
    room = np.ones((count, 4)), np.ones((count, 4)), np.ones((count, 5))
    theta = compiled(samples, room).copy()
    part = room[2][np.isfinite(room[2][:, 4])]
    np.testing.assert_allclose(numpy_loop(part), theta, rtol=1e-6)
    np.testing.assert_allclose(singly(samples), theta, rtol=0.02)  # it takes out the bias of the sensors' noise
    bulk = best(lambda: compiled(samples, room), 7) / count * 1e6
    short = samples[: min(count, 20_000)]
    single = best(lambda: singly(short), 3) / len(short) * 1e6
    loop = best(lambda: numpy_loop(part[:20_000]), 3) / min(len(part), 20_000) * 1e6
    met = bulk <= TARGET_BULK_US, single <= TARGET_SINGLE_US, loop / bulk >= TARGET_RATIO
    print(f"samples                         {count}")
    print(f"in bulk, with filter            {bulk:8.3f} us a sample   target <= {TARGET_BULK_US}")
    print(f"one at a time, with filter      {single:8.3f} us a sample   target <= {TARGET_SINGLE_US}")
    print(f"NumPy loop, update only         {loop:8.3f} us a sample")
    print(f"ratio loop / bulk               {loop / bulk:8.0f}                target >= {TARGET_RATIO:.0f}")
    return 0 if all(met) else 1


if __name__ == "__main__":
    sys.exit(main())
