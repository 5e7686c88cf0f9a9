"""Bags for tests, written by rosbags itself: a run as Odometry, Imu and Float64 in ENU and FLU, as ROS vehicles log it."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from struct import pack
from typing import Any, Self
from zlib import crc32

import lz4.frame
import numpy as np
from rosbags.rosbag1 import Writer as Ros1Writer
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin
from rosbags.rosbag2 import Writer as Ros2Writer
from rosbags.typesys import Stores, get_typestore

KINDS = ("ros1", "db3", "mcap")
FORMS = (
    ("ros1", ""), ("ros1", "bz2"), ("ros1", "lz4"), ("db3", ""), ("db3", "file"), ("db3", "message"),
    ("mcap", ""), ("mcap", "file"), ("mcap", "message"), ("mcap", "storage"),
)  # fmt: skip
"""Every kind with every compression that rosbags writes."""
EPOCH_NS = 1_700_000_000_000_000_000

TYPES = {
    "/odom": "nav_msgs/msg/Odometry",
    "/imu": "sensor_msgs/msg/Imu",
    "/rudder_cmd": "std_msgs/msg/Float64",
    "/elevator_cmd": "std_msgs/msg/Float64",
}
WRITTEN = (
    "yaw_rad", "pitch_rad", "roll_rad", "yaw_rate_rad_s", "pitch_rate_rad_s", "surge_m_s", "sway_m_s", "heave_m_s",
    "x_m", "y_m", "depth_m", "rudder_rad", "elevator_rad",
)  # fmt: skip
MAPPING: Mapping[str, Any] = {
    "frame": "ENU/FLU",
    "signals": {
        "attitude": {"topic": "/odom", "field": "pose.pose.orientation"},
        "yaw_rate_rad_s": {"topic": "/imu", "field": "angular_velocity.z"},
        "pitch_rate_rad_s": {"topic": "/imu", "field": "angular_velocity.y"},
        "surge_m_s": {"topic": "/odom", "field": "twist.twist.linear.x"},
        "sway_m_s": {"topic": "/odom", "field": "twist.twist.linear.y"},
        "heave_m_s": {"topic": "/odom", "field": "twist.twist.linear.z"},
        "x_m": {"topic": "/odom", "field": "pose.pose.position.x"},
        "y_m": {"topic": "/odom", "field": "pose.pose.position.y"},
        "depth_m": {"topic": "/odom", "field": "pose.pose.position.z"},
        "rudder_rad": {"topic": "/rudder_cmd"},
        "elevator_rad": {"topic": "/elevator_cmd", "field": "data"},
    },
}


def quaternion(yaw: float, pitch: float, roll: float) -> list[float]:
    """x, y, z, w of the z-y-x angles, by multiplying the three turns out: written apart from fieldsid."""

    def times(a: list[float], b: list[float]) -> list[float]:
        ax, ay, az, aw = a
        bx, by, bz, bw = b
        return [
            aw * bx + ax * bw + ay * bz - az * by,
            aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw,
            aw * bw - ax * bx - ay * by - az * bz,
        ]

    about_z = [0.0, 0.0, np.sin(yaw / 2), np.cos(yaw / 2)]
    about_y = [0.0, np.sin(pitch / 2), 0.0, np.cos(pitch / 2)]
    about_x = [np.sin(roll / 2), 0.0, 0.0, np.cos(roll / 2)]
    return times(times(about_z, about_y), about_x)


class BagWriter:
    """Writes messages of any standard type, and of own ones, into a bag of any of the three kinds.

    Compression is `bz2` or `lz4` of chunks in ROS 1; zstd of `file`, `message` or `storage` (mcap's chunks) in ROS 2.
    """

    def __init__(self, path: Path, kind: str, *, types: Mapping[str, str] | None = None, compression: str = "") -> None:
        self.ros1 = kind == "ros1"
        self.store = get_typestore(Stores.ROS1_NOETIC if self.ros1 else Stores.ROS2_HUMBLE)
        if types:
            from rosbags.typesys import get_types_from_msg

            for name, text in types.items():
                self.store.register(get_types_from_msg(text, name))
        plugin = StoragePlugin.MCAP if kind == "mcap" else StoragePlugin.SQLITE3
        self.path = path.with_suffix(".bag") if self.ros1 else path
        self.writer: Any = Ros1Writer(self.path) if self.ros1 else Ros2Writer(self.path, version=9, storage_plugin=plugin)
        if compression and self.ros1:
            self.writer.set_compression(Ros1Writer.CompressionFormat[compression.upper()])
        elif compression:
            self.writer.set_compression(CompressionMode[compression.upper()], CompressionFormat.ZSTD)
        self.links: dict[str, Any] = {}
        self.count = 0

    def __enter__(self) -> Self:
        self.writer.open()
        return self

    def __exit__(self, *problem: object) -> None:
        self.writer.close()

    def make(self, name: str, *values: Any, **fields: Any) -> Any:
        """A message of a type, `pkg/Name`."""
        package, _, short = name.rpartition("/")
        return self.store.types[f"{package}/msg/{short}"](*values, **fields)

    def header(self, stamp_ns: int, frame: str = "base_link") -> Any:
        stamp = self.make("builtin_interfaces/Time", sec=stamp_ns // 10**9, nanosec=stamp_ns % 10**9)
        extra = {"seq": self.count} if self.ros1 else {}
        return self.make("std_msgs/Header", stamp=stamp, frame_id=frame, **extra)

    def vector(self, x: float, y: float, z: float) -> Any:
        return self.make("geometry_msgs/Vector3", float(x), float(y), float(z))

    def write(self, topic: str, type_name: str, message: Any, stamp_ns: int) -> None:
        if topic not in self.links:
            self.links[topic] = self.writer.add_connection(topic, type_name, typestore=self.store)
        serialize = self.store.serialize_ros1 if self.ros1 else self.store.serialize_cdr
        self.writer.write(self.links[topic], stamp_ns, serialize(message, type_name))
        self.count += 1


def write_bag(path: Path, kind: str, signals: Mapping[str, np.ndarray], *, compression: str = "") -> Path:
    """Write a run, given by canonical names in NED and FRD, as a vehicle under ROS would log it; missing signals are zero."""
    time = signals["time_s"]
    row = {name: signals.get(name, np.zeros(time.size)) for name in WRITTEN}
    with BagWriter(path, kind, compression=compression) as bag:
        for i, t in enumerate(time):
            _write_row(bag, EPOCH_NS + round(float(t) * 1e9), {n: float(v[i]) for n, v in row.items()})
    return bag.path


def _write_row(bag: BagWriter, stamp: int, r: Mapping[str, float]) -> None:
    turn = bag.make("geometry_msgs/Quaternion", *map(float, quaternion(np.pi / 2 - r["yaw_rad"], -r["pitch_rad"], r["roll_rad"])))
    place = bag.make("geometry_msgs/Point", r["y_m"], r["x_m"], -r["depth_m"])
    pose = bag.make("geometry_msgs/PoseWithCovariance", bag.make("geometry_msgs/Pose", place, turn), np.zeros(36))
    rates = bag.vector(0.0, -r["pitch_rate_rad_s"], -r["yaw_rate_rad_s"])
    speed = bag.make("geometry_msgs/Twist", bag.vector(r["surge_m_s"], -r["sway_m_s"], -r["heave_m_s"]), rates)
    twist = bag.make("geometry_msgs/TwistWithCovariance", speed, np.zeros(36))
    header, none = bag.header(stamp), np.zeros(9)
    odometry = bag.make("nav_msgs/Odometry", header=header, child_frame_id="base_link", pose=pose, twist=twist)
    imu = bag.make(
        "sensor_msgs/Imu",
        header=header,
        orientation=turn,
        orientation_covariance=none,
        angular_velocity=rates,
        angular_velocity_covariance=none,
        linear_acceleration=bag.vector(0.0, 0.0, 9.8),
        linear_acceleration_covariance=none,
    )
    commands = {
        t: bag.make("std_msgs/Float64", r[s]) for t, s in (("/rudder_cmd", "rudder_rad"), ("/elevator_cmd", "elevator_rad"))
    }
    for topic, message in {"/odom": odometry, "/imu": imu, **commands}.items():
        bag.write(topic, TYPES[topic], message, stamp)


MIXED_TYPES = {
    "my_auv/msg/Nothing": "int32 VERSION=3\n",
    "my_auv/msg/Cell": "bool ok\nfloat32 volts\nstring label\n",
    "my_auv/msg/Pack": "uint8 id\nmy_auv/Cell[] cells\nmy_auv/Nothing none\nint16[3] three\nfloat64 total\n",
    "my_auv/msg/State": (
        "std_msgs/Header header\nstring mode\nmy_auv/Nothing[2] gap\nuint8 small\nfloat64[] angles\n"
        "string[] name\nmy_auv/Pack pack\nmy_auv/Pack[2] packs\nuint64 last\n"
    ),
}
"""Own types: nested ones, empty ones, arrays and sequences of numbers, texts and messages."""


def write_mixed_bag(path: Path, kind: str, compression: str, rows: int = 40) -> Path:
    """Write messages whose layout changes from one to the next, on three topics, some out of the order of their stamps."""
    rng = np.random.default_rng(11)

    def cell(bag: BagWriter) -> Any:
        return bag.make("my_auv/Cell", bool(rng.integers(2)), float(np.float32(rng.normal())), "c" * int(rng.integers(5)))

    def pack(bag: BagWriter) -> Any:
        three = rng.integers(-99, 99, 3).astype(np.int16)
        cells = [cell(bag) for _ in range(rng.integers(4))]
        return bag.make("my_auv/Pack", int(rng.integers(256)), cells, bag.make("my_auv/Nothing"), three, float(rng.normal()))

    def state(bag: BagWriter, stamp: int) -> Any:
        nothing = [bag.make("my_auv/Nothing") for _ in range(2)]
        angles, names = rng.normal(size=rng.integers(5)), [f"n{j}" for j in range(rng.integers(3))]
        head = (bag.header(stamp), "m" * int(rng.integers(7)), nothing, int(rng.integers(256)), angles, names)
        return bag.make("my_auv/State", *head, pack(bag), [pack(bag), pack(bag)], int(rng.integers(2**52)))

    with BagWriter(path, kind, types=MIXED_TYPES, compression=compression) as bag:
        for k in range(rows):
            stamp = EPOCH_NS + k * 10**8 + int(rng.integers(-15, 15)) * 10**7
            bag.write("/state", "my_auv/msg/State", state(bag, stamp), stamp)
            bag.write("/depth", "std_msgs/msg/Float64", bag.make("std_msgs/Float64", float(rng.normal())), stamp + 7)
            if k % 5 == 0:
                bag.write("/off", "std_msgs/msg/Empty", bag.make("std_msgs/Empty"), stamp + 9)
    return bag.path


def write_mcap(
    path: Path, rows: list[tuple[str, int, bytes]], *, compression: str = "", chunk_rows: int = 50, crc: bool = True
) -> Path:
    """Write an MCAP file of Float64 messages without a summary, by the specification: rows of topic, stamp and CDR bytes.

    No chunks for `chunk_rows` 0. Written apart from fieldsid and rosbags, which write no checksums and no LZ4.
    """

    def text(value: str) -> bytes:
        return pack("<I", len(value)) + value.encode()

    def record(op: int, body: bytes) -> bytes:
        return pack("<BQ", op, len(body)) + body

    topics = list(dict.fromkeys(topic for topic, _, _ in rows))
    head = record(3, pack("<H", 1) + text("std_msgs/msg/Float64") + text("ros2msg") + text("float64 data"))
    for number, topic in enumerate(topics):
        head += record(4, pack("<HH", number, 1) + text(topic) + text("cdr") + pack("<I", 0))
    messages = [
        record(5, pack("<HIQQ", topics.index(topic), i, stamp, stamp) + body) for i, (topic, stamp, body) in enumerate(rows)
    ]
    out = b"\x89MCAP0\r\n" + record(1, text("ros2") + text("tests"))
    if not chunk_rows:
        out += head + b"".join(messages)
    for first in range(0, len(messages) if chunk_rows else 0, chunk_rows or 1):
        plain = (head if first == 0 else b"") + b"".join(messages[first : first + chunk_rows])
        packed = lz4.frame.compress(plain) if compression == "lz4" else plain
        stamps = [stamp for _, stamp, _ in rows[first : first + chunk_rows]]
        about = pack("<QQQI", min(stamps), max(stamps), len(plain), crc32(plain) if crc else 0)
        out += record(6, about + text(compression) + pack("<Q", len(packed)) + packed)
    out += record(15, pack("<I", 0)) + record(2, pack("<QQI", 0, 0, 0)) + b"\x89MCAP0\r\n"
    path.write_bytes(out)
    return path


def float64_rows(topic: str, values: np.ndarray, step_ns: int = 10**8) -> list[tuple[str, int, bytes]]:
    """Rows for `write_mcap`: one Float64 each step."""
    return [(topic, EPOCH_NS + k * step_ns, b"\x00\x01\x00\x00" + pack("<d", v)) for k, v in enumerate(values.tolist())]
