"""How fast a bag becomes signals, in one run against rosbags: files into packets, messages into numbers, and the whole.

    python tests/benchmarks/bag_reading.py [samples]

Both sides read the same files, and give the same packets and numbers before they are timed. A reader of our own whose
ratio is below the target is not worth its lines.
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

from fieldsid.logs.mapping.mapping_file import mapping_of
from fieldsid.logs.reader import ReadOptions
from fieldsid.logs.readers.bags.messages.definitions import DefinitionSearch, decoder_of
from fieldsid.logs.readers.bags.stores import collected
from fieldsid.logs.readers.rosbag import read

TARGET = 2.0
FORMS = (("ros1", ""), ("ros1", "lz4"), ("db3", ""), ("mcap", ""), ("mcap", "storage"))
FIELDS = {
    "/odom": ("surge_m_s", "twist.twist.linear.x", lambda m: m.twist.twist.linear.x),
    "/imu": ("yaw_rate_rad_s", "angular_velocity.z", lambda m: m.angular_velocity.z),
    "/rudder_cmd": ("rudder_rad", "data", lambda m: m.data),
}


def packets_of_rosbags(path: Path) -> dict[str, list[tuple[int, bytes]]]:
    """Stamps and bytes by topic, through AnyReader."""
    found: dict[str, list[tuple[int, bytes]]] = {}
    with AnyReader([path]) as reader:
        for connection, stamp, raw in reader.messages():
            found.setdefault(connection.topic, []).append((stamp, raw))
    return found


def numbers_of_rosbags(path: Path, packets: dict[str, list[tuple[int, bytes]]]) -> dict[str, np.ndarray]:
    """The fields of packets that were read before, through objects."""
    with AnyReader([path]) as reader:
        types = {c.topic: c.msgtype for c in reader.connections}
        return {
            signal: np.array([get(reader.deserialize(raw, types[topic])) for _, raw in packets[topic]])
            for topic, (signal, _, get) in FIELDS.items()
        }


def whole_by_rosbags(path: Path) -> dict[str, np.ndarray]:
    """The loop that everybody writes."""
    rows: dict[str, list[float]] = {signal: [] for signal, _, _ in FIELDS.values()}
    with AnyReader([path]) as reader:
        for connection, _, raw in reader.messages():
            message: Any = reader.deserialize(raw, connection.msgtype)
            if connection.topic in FIELDS:
                signal, _, get = FIELDS[connection.topic]
                rows[signal].append(get(message))
    return {k: np.array(v) for k, v in rows.items()}


def numbers_of_ours(path: Path, collector: Any) -> dict[str, np.ndarray]:
    """The same fields of packets that were read before, decoded in blocks."""
    found = {}
    for topic, (signal, field, _) in FIELDS.items():
        payloads = collector.packets[topic].payloads
        decoder, _ = decoder_of(collector.connections[topic], payloads[0], DefinitionSearch(path))
        found[signal] = decoder.decode(payloads, [field])[0][0][:, 0]
    return found


def whole_by_us(path: Path) -> dict[str, np.ndarray]:
    """Our reader, with all signals of the mapping."""
    raw = read(path, mapping_of(MAPPING), ReadOptions())
    return {signal: raw.series[signal].values for signal, _, _ in FIELDS.values()}


def best_of(calls: tuple[Callable[[], Any], ...], times: int = 7) -> list[float]:
    """Return the shortest time of each call; they take turns, so that a busy moment meets all of them."""
    spent: list[list[float]] = [[] for _ in calls]
    for _ in range(times):
        for call, seconds in zip(calls, spent, strict=True):
            start = time.perf_counter()
            call()
            seconds.append(time.perf_counter() - start)
    return [min(s) for s in spent]


def same(path: Path) -> tuple[dict[str, list[tuple[int, bytes]]], Any]:
    """Read a bag by both, compare, and return the packets of both."""
    theirs, ours = packets_of_rosbags(path), collected(path, None)
    for topic, packets in theirs.items():
        assert packets == list(zip(ours.packets[topic].stamps, ours.packets[topic].payloads, strict=True))
    numbers = numbers_of_rosbags(path, theirs)
    for found in (numbers_of_ours(path, ours), whole_by_us(path), whole_by_rosbags(path)):
        for signal, values in numbers.items():
            np.testing.assert_array_equal(values, found[signal])
    return theirs, ours


def main(samples: int = 5000) -> int:
    """Print one line per form and return 1 when one of them misses the target."""
    t = np.arange(samples) / 50.0
    signals = {
        "time_s": t,
        "yaw_rad": np.sin(t),
        "yaw_rate_rad_s": np.cos(t),
        "surge_m_s": 1.5 + 0.1 * np.sin(3 * t),
        "rudder_rad": 0.2 * np.cos(t),
    }
    missed = 0
    print(f"{4 * samples} messages, rosbags' AnyReader / fieldsid in s, and their ratio (target {TARGET:g} x)")
    with tempfile.TemporaryDirectory() as folder:
        for kind, compression in FORMS:
            path = write_bag(Path(folder) / f"{kind}{compression}", kind, signals, compression=compression)
            theirs, ours = same(path)
            pairs = {
                "packets": (lambda p=path: packets_of_rosbags(p), lambda p=path: collected(p, None)),
                "numbers": (lambda p=path, k=theirs: numbers_of_rosbags(p, k), lambda p=path, k=ours: numbers_of_ours(p, k)),
                "whole": (lambda p=path: whole_by_rosbags(p), lambda p=path: whole_by_us(p)),
            }
            line = f"{kind + (' ' + compression if compression else ''):13}"
            for name, both in pairs.items():
                a, b = best_of(both)
                missed += a / b < TARGET
                line += f" {name} {a:.3f} / {b:.3f} {a / b:4.1f} x"
            print(line)
    return int(missed > 0)


if __name__ == "__main__":
    sys.exit(main(*map(int, sys.argv[1:2])))
