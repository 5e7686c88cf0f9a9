"""How fast a bag becomes signals: our reader against a loop of rosbags' AnyReader that decodes every message.

    python tests/benchmarks/bag_reading.py [messages]

Both sides read the same six numbers of Odometry and Imu and one Float64; the results are compared first.
"""

from __future__ import annotations

import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from bags import MAPPING, write_bag
from rosbags.highlevel import AnyReader

from fieldsid.logs.mapping import mapping_of
from fieldsid.logs.reader import ReadOptions
from fieldsid.logs.readers.rosbag import read

TARGET = 3.0


def by_anyreader(path: Path) -> dict[str, np.ndarray]:
    """The loop that everybody writes."""
    rows: dict[str, list[float]] = {"surge_m_s": [], "yaw_rate_rad_s": [], "rudder_rad": []}
    with AnyReader([path]) as reader:
        for connection, _, raw in reader.messages():
            message: Any = reader.deserialize(raw, connection.msgtype)
            if connection.topic == "/odom":
                rows["surge_m_s"].append(message.twist.twist.linear.x)
            elif connection.topic == "/imu":
                rows["yaw_rate_rad_s"].append(message.angular_velocity.z)
            elif connection.topic == "/rudder_cmd":
                rows["rudder_rad"].append(message.data)
    return {k: np.array(v) for k, v in rows.items()}


def by_us(path: Path) -> dict[str, np.ndarray]:
    """Our reader, with all signals of the mapping."""
    raw = read(path, mapping_of(MAPPING), ReadOptions())
    return {k: raw.series[k].values for k in ("surge_m_s", "yaw_rate_rad_s", "rudder_rad")}


def best_of(call: Callable[[], Any], times: int = 3) -> float:
    spent = []
    for _ in range(times):
        start = time.perf_counter()
        call()
        spent.append(time.perf_counter() - start)
    return min(spent)


def main(samples: int = 5000) -> int:
    """Print one line per format and return 1 when one of them misses the target."""
    t = np.arange(samples) / 50.0
    signals = {
        "time_s": t,
        "yaw_rad": np.sin(t),
        "yaw_rate_rad_s": np.cos(t),
        "surge_m_s": 1.5 + 0.1 * np.sin(3 * t),
        "rudder_rad": 0.2 * np.cos(t),
    }
    missed = 0
    with tempfile.TemporaryDirectory() as folder:
        for kind in ("ros1", "db3", "mcap"):
            path = write_bag(Path(folder) / kind, kind, signals)
            slow, fast = by_anyreader(path), by_us(path)
            for name, values in slow.items():
                np.testing.assert_array_equal(values, fast[name])
            a, b = best_of(lambda p=path: by_anyreader(p)), best_of(lambda p=path: by_us(p))
            missed += a / b < TARGET
            print(
                f"{kind:5} {4 * samples} messages: AnyReader loop {a:.3f} s, fieldsid {b:.3f} s, "
                f"{a / b:.1f} x (target {TARGET:g} x)"
            )
    return int(missed > 0)


if __name__ == "__main__":
    sys.exit(main(*map(int, sys.argv[1:2])))
