"""How fast the recursive estimator is: the compiled sums, one sample at a time on board, and a loop in NumPy.

    python tests/benchmarks/rls_speed.py [samples]

The answers are compared first. Times are processor time, the best of several.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable

import numpy as np

from fieldsid.fitting.regression.instruments import moved_by_fin
from fieldsid.fitting.regression.recursive_iv import recursive_iv
from fieldsid.fitting.regression.svf_equation import RegressionParameters, filtered_equation, measured_signals
from fieldsid.logs.run import Run
from fieldsid.models.axis import Axis
from fieldsid.models.record import Record, record_of
from fieldsid.online import OnlineIdentifier

TARGET_RATIO = 50.0
TARGET_BULK_US = 0.1
TARGET_SINGLE_US = 250.0
"""Half a per cent of a core at 20 Hz; nearly all of it is the look for a jump of authority, once a second."""
LAMBDA, BETA = 4.0, 0.9995


TRUTH = RegressionParameters(2.0, 0.2, 1.5, -0.05)


def log(count: int) -> Record:
    """A pitching vehicle, noise on both sensors."""
    rng, h = np.random.default_rng(6), 0.05
    fin = 0.2 * np.sign(np.sin(np.arange(count) * 0.05)) + 0.05 * np.sin(np.arange(count) * 0.013)
    y, q = np.zeros(count), np.zeros(count)
    for i in range(count - 1):
        q[i + 1] = q[i] + h * (-2.0 * q[i] - 0.2 * y[i] + 1.5 * fin[i] - 0.05)
        y[i + 1] = y[i] + h * q[i + 1]
    noisy = y + 0.005 * rng.standard_normal(count), q + 0.005 * rng.standard_normal(count)
    signals = {"elevator_rad": fin, "pitch_rad": noisy[0], "pitch_rate_rad_s": noisy[1]}
    return record_of(Run("log", np.arange(count) * h, signals), Axis.PITCH)


def rows_of(record: Record) -> tuple[np.ndarray, np.ndarray]:
    """Instruments (n, 4), and columns with target (n, 5)."""
    signals = measured_signals(record, LAMBDA)
    by_fin, rows = (filtered_equation(record, s, LAMBDA, TRUTH) for s in (moved_by_fin(record, signals, TRUTH), signals))
    return by_fin.columns, np.column_stack([rows.columns, rows.target])


def compiled(z: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """The sums over all rows, and the history of values and bands."""
    return recursive_iv(z, rows, BETA, np.unique(np.linspace(0, len(rows) - 1, 4000).astype(np.int64)))[0][-1]


def plain_update(
    theta: np.ndarray, big: np.ndarray, z: np.ndarray, phi: np.ndarray, target: float, beta: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return Theta (p,) and P (p, p) after one row with its instruments, as the equations are written."""
    gain = big @ z / (beta + phi @ big @ z)
    return theta + gain * (target - phi @ theta), (big - np.outer(gain, phi @ big)) / beta


def numpy_loop(z: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """The same estimate by the update, written as one writes it in NumPy, on rows that are filtered already."""
    theta, big = np.zeros(4), np.eye(4) * 1e6
    for instruments, row in zip(z, rows, strict=True):
        theta, big = plain_update(theta, big, instruments, row[:4], row[4], BETA)
    return theta


def singly(record: Record) -> np.ndarray:
    """One sample at a time by the identifier as it runs on board."""
    online = OnlineIdentifier("pitch", bandwidth=LAMBDA, forgetting=BETA)
    for sample in zip(*(s.tolist() for s in (record.time, record.fin, record.angle, record.rate)), strict=True):
        online.update(*sample)
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
    record, short = log(count), log(min(count, 20_000))
    z, rows = rows_of(record)
    theta = compiled(z, rows)
    np.testing.assert_allclose(numpy_loop(z, rows), theta, rtol=1e-6)
    np.testing.assert_allclose(singly(record), theta, rtol=0.02)  # its instruments are those of its own estimate
    bulk = best(lambda: compiled(z, rows), 7) / count * 1e6
    filters = best(lambda: rows_of(record)[0], 7) / count * 1e6
    single = best(lambda: singly(short), 3) / len(short) * 1e6
    loop = best(lambda: numpy_loop(z[:20_000], rows[:20_000]), 3) / min(len(rows), 20_000) * 1e6
    met = bulk <= TARGET_BULK_US, single <= TARGET_SINGLE_US, loop / bulk >= TARGET_RATIO
    print(f"samples                         {count}")
    print(f"in bulk, update and history     {bulk:8.3f} us a sample   target <= {TARGET_BULK_US}")
    print(f"filter and instruments          {filters:8.3f} us a sample")
    print(f"one at a time, with filter      {single:8.3f} us a sample   target <= {TARGET_SINGLE_US}")
    print(f"NumPy loop, update only         {loop:8.3f} us a sample")
    print(f"ratio loop / bulk               {loop / bulk:8.0f}                target >= {TARGET_RATIO:.0f}")
    return 0 if all(met) else 1


if __name__ == "__main__":
    sys.exit(main())
