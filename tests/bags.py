"""Bags for tests, written by rosbags itself: a run as Odometry, Imu and Float64 in ENU and FLU, as ROS vehicles log it."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Self

import numpy as np
from rosbags.rosbag1 import Writer as Ros1Writer
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Ros2Writer
from rosbags.typesys import Stores, get_typestore

KINDS = ("ros1", "db3", "mcap")
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
    """Writes messages of any standard type into a bag of any of the three kinds."""

    def __init__(self, path: Path, kind: str, *, types: Mapping[str, str] | None = None) -> None:
        self.ros1 = kind == "ros1"
        self.store = get_typestore(Stores.ROS1_NOETIC if self.ros1 else Stores.ROS2_HUMBLE)
        if types:
            from rosbags.typesys import get_types_from_msg

            for name, text in types.items():
                self.store.register(get_types_from_msg(text, name))
        plugin = StoragePlugin.MCAP if kind == "mcap" else StoragePlugin.SQLITE3
        self.path = path.with_suffix(".bag") if self.ros1 else path
        self.writer: Any = Ros1Writer(self.path) if self.ros1 else Ros2Writer(self.path, version=9, storage_plugin=plugin)
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


def write_bag(path: Path, kind: str, signals: Mapping[str, np.ndarray]) -> Path:
    """Write a run, given by canonical names in NED and FRD, as a vehicle under ROS would log it; missing signals are zero."""
    time = signals["time_s"]
    row = {name: signals.get(name, np.zeros(time.size)) for name in WRITTEN}
    with BagWriter(path, kind) as bag:
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
