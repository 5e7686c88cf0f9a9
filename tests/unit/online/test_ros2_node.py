"""The ROS 2 node under templates/ runs as it is: its topics' messages in, a look a second out, its state kept."""

from __future__ import annotations

import json
import runpy
import sys
from types import ModuleType, SimpleNamespace
from typing import ClassVar

import numpy as np
from online_flights import TRUTH, flown

from fieldsid.templates import template_path


class Node:
    """What the node asks of rclpy's."""

    settings: ClassVar[dict[str, object]] = {}

    def __init__(self, _name):
        self.sent, self.gained, self.heard = [], [], []

    def declare_parameter(self, name, default):
        return SimpleNamespace(value=self.settings.get(name, default))

    def create_publisher(self, _kind, topic, _depth):
        return SimpleNamespace(publish=(self.gained if topic == "~/gains" else self.sent).append)

    def create_subscription(self, _kind, topic, _call, _depth):
        self.heard.append(topic)

    def create_timer(self, _period_s, _call):
        pass

    def get_logger(self):
        return SimpleNamespace(info=lambda _text: None)


def stand_in(monkeypatch, name, **names):
    module = ModuleType(name)
    vars(module).update(names)
    monkeypatch.setitem(sys.modules, name, module)


def test_the_node_identifies_from_its_messages(monkeypatch, tmp_path):
    for name in ("rclpy", "geometry_msgs", "nav_msgs", "sensor_msgs", "std_msgs"):
        stand_in(monkeypatch, name)
    stand_in(monkeypatch, "rclpy.node", Node=Node)
    stand_in(monkeypatch, "geometry_msgs.msg", Vector3Stamped=object)
    stand_in(monkeypatch, "nav_msgs.msg", Odometry=object)
    stand_in(monkeypatch, "sensor_msgs.msg", Imu=object)
    stand_in(monkeypatch, "std_msgs.msg", String=lambda data: data)
    file = template_path("ros2") / "sysid_live_node.py"
    assert len(file.read_text().splitlines()) <= 100
    kind = runpy.run_path(str(file))["SysidLive"]
    monkeypatch.setattr(Node, "settings", {"state": str(tmp_path / "state.json")})
    node = kind()
    node.on_odometry(SimpleNamespace(twist=SimpleNamespace(twist=SimpleNamespace(linear=SimpleNamespace(x=1.4)))))
    node.on_half_minute()
    node.job.result()
    for i, (time, fin, angle, rate) in enumerate(zip(*(s.tolist() for s in flown()), strict=True)):
        node.on_fins(SimpleNamespace(vector=SimpleNamespace(x=fin, y=0.0)))
        half = 0.5 * angle
        stamp = SimpleNamespace(sec=int(time), nanosec=round(1e9 * (time - int(time))))
        node.on_imu(
            SimpleNamespace(
                header=SimpleNamespace(stamp=stamp),
                orientation=SimpleNamespace(x=0.0, y=0.0, z=np.sin(half), w=np.cos(half)),
                angular_velocity=SimpleNamespace(x=0.0, y=0.0, z=rate),
            )
        )
        if i % 100 == 99:
            node.on_second()
    last = json.loads(node.sent[-1])
    for name, truth in TRUTH["yaw"].items():
        assert abs(last["parameters"][name]["value"] - truth) < 4.0 * last["parameters"][name]["std_error"]
    node.on_half_minute()
    node.job.result()
    first, then = map(json.loads, node.gained)
    assert first["verdict"] == "refused"
    assert then["verdict"] == "use"
    assert then["row"]["kp"] < 0.0 < then["std_errors"]["kp"]
    assert kind().online.estimate().used == node.online.estimate().used
