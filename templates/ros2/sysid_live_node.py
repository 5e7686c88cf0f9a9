#!/usr/bin/env python3
"""A ROS 2 node that identifies the yaw or pitch model on board and says when there is enough data.

Copy it into a package of your own and set topics and fields below. It needs `rclpy`, NumPy, SciPy and fieldsid (numba is not needed):
    ros2 run YOUR_PACKAGE sysid_live_node --ros-args -p axis:=yaw -p state:=/var/tmp/sysid_yaw.json
It publishes one JSON object a second on `~/estimate` (std_msgs/String), as `sysid live --json` prints them, and on `~/gains` every
half minute the gains of now beside those of the parameter `schedule`, a file of `sysid schedule design`; refused until settled.
"""

import json
import math
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import rclpy
from geometry_msgs.msg import Vector3Stamped
from nav_msgs.msg import Odometry
from rclpy.node import Node
from sensor_msgs.msg import Imu
from std_msgs.msg import String

from fieldsid.artifacts import plain
from fieldsid.errors import FieldsidError
from fieldsid.models.axis import Axis
from fieldsid.online import OnlineIdentifier
from fieldsid.online.identifier import gains_now
from fieldsid.online.look import LiveGains, live_gains, look_body
from fieldsid.online.progress import Watch, default_goals
from fieldsid.online.state_file import load_state, save_state
from fieldsid.schedule import load_schedule
from fieldsid.schedule.search.of_one_model import wanted_of


class SysidLive(Node):
    def __init__(self):
        super().__init__("sysid_live")
        self.axis = Axis(self.declare_parameter("axis", "yaw").value)
        self.state = Path(self.declare_parameter("state", "sysid_live.json").value)
        loaded = self.declare_parameter("schedule", "").value
        self.wanted = wanted_of(load_schedule(Path(loaded))) if loaded else None
        self.watch, self.fin, self.surge = Watch(default_goals(self.axis)), math.nan, math.nan
        known = load_state(self.state, self.axis, self.watch) if self.state.exists() else None
        self.online = known[0] if known else OnlineIdentifier(self.axis)
        self.out = self.create_publisher(String, "~/estimate", 10)
        self.gains = self.create_publisher(String, "~/gains", 10)
        self.pool, self.job = ThreadPoolExecutor(1), None
        # Fin command in rad, positive where it turns as your model has it; here x is the rudder, y the elevator.
        self.create_subscription(Vector3Stamped, "/fins/command", self.on_fins, 10)
        # Body frame forward-starboard-down. For a driver in forward-left-up turn the signs of pitch, yaw and their rates.
        self.create_subscription(Imu, "/imu/data", self.on_imu, 50)
        self.create_subscription(Odometry, "/odometry", self.on_odometry, 10)  # through the water, of which gains are scheduled
        self.create_timer(1.0, self.on_second)
        self.create_timer(30.0, self.on_half_minute)

    def on_fins(self, message):
        self.fin = message.vector.x if self.axis is Axis.YAW else message.vector.y

    def on_odometry(self, message):
        self.surge = message.twist.twist.linear.x

    def on_imu(self, message):
        stamp, q, w = message.header.stamp, message.orientation, message.angular_velocity
        yaw = math.atan2(2.0 * (q.w * q.z + q.x * q.y), 1.0 - 2.0 * (q.y * q.y + q.z * q.z))
        pitch = math.asin(max(-1.0, min(1.0, 2.0 * (q.w * q.y - q.z * q.x))))
        angle, rate = (yaw, w.z) if self.axis is Axis.YAW else (pitch, w.y)
        time = stamp.sec + 1e-9 * stamp.nanosec
        self.online.update(time, self.fin, angle, rate, self.surge)
        self.watch.excitation.hear(time, self.fin, rate)

    def on_second(self):
        now = self.online.estimate()
        body = look_body(now, self.watch.look(now), source="ros2", goals_from="5 % of each value", unreadable=0, then="")
        self.out.publish(String(data=json.dumps(body)))
        self.get_logger().info(body["said"])
        save_state(self.state, self.online, self.watch, "ros2")

    def on_half_minute(self):
        now = self.online.estimate()
        if self.job is None or self.job.done():
            self.job = self.pool.submit(self.send_gains, now, self.watch.look(now))

    def send_gains(self, now, progress):
        try:
            gains = live_gains(now, gains_now(now, progress, self.wanted))
        except FieldsidError as error:
            gains = LiveGains(time=now.time, verdict="refused", says=error.what)
        self.gains.publish(String(data=json.dumps(plain(gains))))


def main():
    rclpy.init()
    rclpy.spin(SysidLive())


if __name__ == "__main__":
    main()
