"""Long logs: time and peak memory of an hour of bag and of five million rows of text, in one run against rosbags and pandas.

    python tests/benchmarks/long_logs.py [hours] [rows]

Each reading is a process of its own, whose peak memory the system counts. The ratio is that of reading alone: our reader gives
the mapped signals, the loop of rosbags keeps five numbers of each message, pandas reads the table as it is. An import is
the whole of `sysid import`, with all findings.
"""

from __future__ import annotations

import json
import resource
import struct
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from bags import EPOCH_NS, KINDS, MAPPING, WRITTEN, BagWriter, _write_row

BAG_MIB, TABLE_MIB = 500.0, 1536.0
"""Most memory that an hour of bag and five million rows may take."""
RATE_HZ = 100


class _Templates(BagWriter):
    """Keeps the bytes of a message of each topic instead of writing it."""

    def write(self, topic: str, type_name: str, message: object, stamp_ns: int) -> None:  # noqa: ARG002 - the bytes are kept
        self.links[topic] = self.writer.add_connection(topic, type_name, typestore=self.store)
        serialize = self.store.serialize_ros1 if self.ros1 else self.store.serialize_cdr
        self.made[topic] = bytearray(serialize(message, type_name))

    made: dict[str, bytearray]


def write_long_bag(path: Path, kind: str, hours: float) -> Path:
    """Imu at 100 Hz, Odometry at 50 Hz, fins at 20 Hz: only their stamps and fins differ, so that it is written fast."""
    with _Templates(path, kind) as bag:
        bag.made = {}
        _write_row(bag, EPOCH_NS, dict.fromkeys(WRITTEN, 0.0))
        write, every = bag.writer.write, {"/imu": 1, "/odom": 2, "/rudder_cmd": 5, "/elevator_cmd": 5}
        for i in range(round(hours * 3600 * RATE_HZ)):
            stamp = EPOCH_NS + i * (10**9 // RATE_HZ)
            for topic, step in every.items():
                if i % step == 0:
                    raw = bag.made[topic]
                    if topic in ("/imu", "/odom"):
                        raw[4:12] = struct.pack("<II", stamp // 10**9, stamp % 10**9)
                    else:
                        raw[-8:] = struct.pack("<d", 0.2 * (-1) ** (i // 500))
                    write(bag.links[topic], stamp, bytes(raw))
    return bag.path


def write_long_table(path: Path, rows: int) -> Path:
    """Ten canonical columns of six digits."""
    import pyarrow as pa
    from pyarrow import csv

    t = np.arange(rows) / 100.0
    waves = {
        "yaw_rad": 0.3 * np.sin(0.2 * t),
        "yaw_rate_rad_s": 0.06 * np.cos(0.2 * t),
        "pitch_rad": 0.02 * np.sin(0.5 * t),
        "pitch_rate_rad_s": 0.01 * np.cos(0.5 * t),
        "roll_rad": 0.01 * np.sin(0.9 * t),
        "depth_m": 5.0 + np.sin(0.01 * t),
        "surge_m_s": 1.5 + 0.1 * np.sin(0.03 * t),
        "rudder_rad": 0.2 * np.sign(np.sin(0.2 * t + 0.1)),
        "elevator_rad": 0.1 * np.sign(np.sin(0.5 * t + 0.1)),
    }
    columns = {"time_s": t, **{name: np.round(v, 6) for name, v in waves.items()}}
    csv.write_csv(pa.table(columns), path, csv.WriteOptions(quoting_style="none"))
    return path


def import_it(path: Path) -> None:
    """All of `sysid import`, with a mapping for a bag."""
    from fieldsid.cli.app import main

    with tempfile.TemporaryDirectory() as folder:
        mapping = Path(folder) / "mapping.yaml"
        mapping.write_text(json.dumps(MAPPING))
        options = [] if path.suffix == ".csv" else ["--mapping", str(mapping)]
        code = main(["import", str(path), *options, "-o", f"{folder}/runs", "--json"])
    if code:
        raise SystemExit(code)


def read_it(path: Path) -> None:
    """The reader alone."""
    from fieldsid.logs.mapping.mapping_file import mapping_of
    from fieldsid.logs.reader import ReadOptions, reader_of

    reader, options = reader_of(path), ReadOptions()
    reader.read(path, reader.own_map(path, options) or mapping_of(MAPPING), options)


def by_rosbags(path: Path) -> None:
    """A loop of AnyReader over the mapped topics."""
    from rosbags.highlevel import AnyReader

    rows: list[tuple[float, ...]] = []
    with AnyReader([path]) as reader:
        for connection, stamp, raw in reader.messages():
            m = reader.deserialize(raw, connection.msgtype)
            if connection.topic == "/odom":
                speed, turn = m.twist.twist.linear, m.pose.pose.orientation
                rows.append((stamp, speed.x, turn.x, turn.y, turn.z, turn.w))
            elif connection.topic == "/imu":
                rows.append((stamp, m.angular_velocity.y, m.angular_velocity.z))
            else:
                rows.append((stamp, m.data))


def by_pandas(path: Path) -> None:
    """pandas' own reading."""
    import pandas as pd

    pd.read_csv(path)


WAYS: dict[str, Callable[[Path], None]] = {"import": import_it, "read": read_it, "rosbags": by_rosbags, "pandas": by_pandas}


def measured(way: str, path: Path) -> tuple[float, float]:
    """Return time in s and peak memory in MiB of one way in a process of its own."""
    call = [sys.executable, __file__, "--only", way, str(path)]
    done = subprocess.run(call, capture_output=True, text=True, check=True)
    spent, peak = done.stderr.split()[-2:]
    return float(spent), float(peak)


def only(way: str, path: Path) -> int:
    """Do one reading and say what it took."""
    start = time.perf_counter()
    WAYS[way](path)
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(f"\n{time.perf_counter() - start:.3f} {peak:.1f}", file=sys.stderr)
    return 0


def main(hours: float = 1.0, rows: int = 5_000_000) -> int:
    """Print one line per log and return 1 when one takes more memory than it may."""
    missed = 0
    with tempfile.TemporaryDirectory() as folder:
        logs = {kind: (lambda k=kind: write_long_bag(Path(folder) / k, k, hours), "rosbags", BAG_MIB) for kind in KINDS}
        logs["csv"] = (lambda: write_long_table(Path(folder) / "log.csv", rows), "pandas", TABLE_MIB)
        for name, (write, other, limit) in logs.items():
            path = write()
            size = sum(p.stat().st_size for p in ([path] if path.is_file() else path.iterdir())) / 2**20
            whole, ours, theirs = measured("import", path), measured("read", path), measured(other, path)
            missed += whole[1] > limit
            print(
                f"{name:5} {size:4.0f} MiB: import {whole[0]:5.1f} s, {whole[1]:5.0f} MiB (limit {limit:.0f}); "
                f"reading {ours[0]:5.1f} s, {ours[1]:5.0f} MiB; {other} {theirs[0]:5.1f} s, {theirs[1]:5.0f} MiB; "
                f"ratio of times {theirs[0] / ours[0]:.1f}"
            )
    return int(missed > 0)


if __name__ == "__main__":
    if sys.argv[1:2] == ["--only"]:
        sys.exit(only(sys.argv[2], Path(sys.argv[3])))
    sys.exit(main(*(kind(value) for kind, value in zip((float, int), sys.argv[1:], strict=False))))
