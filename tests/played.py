"""Small interpreters of what is written for vehicles: each reads a file back and plays it, sample by sample.

`step(t, seen)` returns the fin about trim in rad, or None where the autopilot steers; `aborted` says when a limit ended it.
Time begins with the leg's window, the way along where the run-up was planned to end, the way across at the leg's line.
"""

from __future__ import annotations

import configparser
import json
import re

import numpy as np
from lupa.lua53 import LuaRuntime
from moos_helm import Helm, holds, script
from rosbags.highlevel import AnyReader


class Watch:
    """The abort conditions as (signal, kind, limit), watched from the start of the window on."""

    def __init__(self, conditions, run_up):
        self.conditions, self.run_up, self.start, self.aborted = conditions, run_up, None, None

    def see(self, t, seen):
        now = {"time_s": t, "surge_m_s": seen.surge, "yaw_rad": seen.yaw, "pitch_rad": seen.pitch, "roll_rad": seen.roll,
               "depth_m": seen.depth, "x_m": seen.x - self.run_up, "y_m": seen.y}  # fmt: skip
        self.start = self.start or now
        for signal, kind, limit in self.conditions:
            moved = now[signal] - (0.0 if signal == "y_m" else self.start[signal])
            broken = {
                "time": t > limit,
                "below": now[signal] < limit,
                "above": now[signal] > limit,
                "deviation": abs(moved) > limit,
            }[kind]
            if broken and self.aborted is None:
                self.aborted = (t, signal)


class Listed:
    """Fins held from a time on, None for the autopilot, under a watch."""

    def __init__(self, times, fins, steered, most, conditions, run_up):
        self.times, self.most, self.watch = np.asarray(times), most, Watch(conditions, run_up)
        self.fins = [None if s else f for f, s in zip(fins, steered, strict=True)]

    @property
    def aborted(self):
        return self.watch.aborted

    def step(self, t, seen):
        self.watch.see(t, seen)
        if self.aborted:
            return None
        fin = self.fins[int(np.searchsorted(self.times, t + 1e-9)) - 1]
        return None if fin is None else float(np.clip(fin, -self.most, self.most))


def dune(path, run_up):
    """The section of a DUNE task: times, fins and its lines `Abort SIGNAL KIND (UNIT) = LIMIT`."""
    reader = configparser.ConfigParser()
    reader.optionxform = str
    reader.read(path)
    (name,) = reader.sections()
    section = reader[name]
    conditions = []
    for key, value in section.items():
        if found := re.fullmatch(r"Abort (\w+) (\w+) \(.*\)", key):
            conditions.append((found[1], found[2], float(value)))
    times, fins = ([float(v) for v in section[k].split(",")] for k in ("Times (s)", "Fins (rad)"))
    steered = [v.strip() == "true" for v in section["Autopilot"].split(",")]
    return Listed(times, fins, steered, float(section["Maximum Fin (rad)"]), conditions, run_up)


def ros2(path, run_up):
    """The bag: a fin and a flag for each time, and the conditions that stand at its beginning."""
    columns = {"command": [], "autopilot": [], "conditions": []}
    with AnyReader([path]) as reader:
        for connection, stamp, raw in reader.messages():
            data = reader.deserialize(raw, connection.msgtype).data
            columns[connection.topic.rpartition("_")[2].removeprefix("/")].append((stamp * 1e-9, data))
    body = json.loads(columns["conditions"][0][1])
    conditions = [(a["signal"], a["kind"], a["limit"]) for a in body["abort"]]
    times, fins = zip(*columns["command"], strict=True)
    return Listed(times, fins, [s for _, s in columns["autopilot"]], body["fin_max_rad"], conditions, run_up)


class Moos:
    """The timer script beside the helm that runs the behavior file."""

    def __init__(self, text, helm, course):
        self.events, self.conditions = script(text)
        self.helm, self.course, self.next = Helm(helm), course, 0
        self.aborted, self.fin = None, None

    def step(self, t, seen):
        heading = np.degrees(seen.yaw + self.course) % 360.0
        sin, cos = np.sin(self.course), np.cos(self.course)
        nav = {"NAV_SPEED": seen.surge, "NAV_DEPTH": seen.depth, "NAV_PITCH": seen.pitch, "NAV_ROLL": seen.roll,
               "NAV_HEADING": heading, "NAV_X": seen.x * sin + seen.y * cos, "NAV_Y": seen.x * cos - seen.y * sin}  # fmt: skip
        if self.next == 0:
            self.helm.step(0.0, FIELDSID_START="true", **nav)
            assert all(holds(c, self.helm.variables) for c in self.conditions)
        while self.next < len(self.events) and self.events[self.next][0] <= t + 1e-9 and self.aborted is None:
            _, name, value = self.events[self.next]
            self.helm.post(f"{name} = {value}")
            self.next += 1
        self.helm.step(0.05, **nav)
        if self.helm.variables["FIELDSID_ABORT"] == "true" and self.aborted is None:
            self.aborted = (t, "")
        overridden = self.helm.variables["FIELDSID_FIN_OVERRIDE"] == "true"
        return np.radians(float(self.helm.variables["DESIRED_RUDDER"])) if overridden else None


def moos(script_path, helm_path, course):
    return Moos(script_path.read_text(), helm_path.read_text(), course)


AROUND = """
local host = host
local time = {__index = {tofloat = function(t) return t.ms + 0.0 end}}
function time.__sub(a, b) return setmetatable({ms = a.ms - b.ms}, time) end
function millis() return setmetatable({ms = host.millis()}, time) end
local function vector(axes) return {x = function() return axes[0] end, y = function() return axes[1] end} end
local wrapped = {
    get_velocity_NED = function() return vector(host.velocity()) end,
    get_relative_position_NED_origin = function() return vector(host.position()) end,
}
local vehicle = setmetatable({}, {__index = function(_, name)
    return wrapped[name] or function(_, ...) return host[name](...) end
end})
for _, name in ipairs({"ahrs", "baro", "rc", "arming", "gcs", "SRV_Channels"}) do _G[name] = vehicle end
setmetatable(_G, {__index = function(_, name) error("nobody set " .. name) end})
"""
"""What a script finds in the vehicle: times whose differences know `tofloat`, vectors, and the host's own methods by name."""


class ArduPilot:
    """The script in a vehicle's place: what it may ask of the vehicle, and the fin it sets, by ArduPilot's names.

    North, east and heading are the leg's, turned by its course; a velocity is over ground. The servo's trim is 1500 us.
    """

    PWM_PER_RAD, FIN_FUNCTION, CHANNEL, TRIM = 800.0, 21, 4, 1500

    def __init__(self, text, course):
        for name, value in (("PWM_PER_RAD", self.PWM_PER_RAD), ("FIN_FUNCTION", self.FIN_FUNCTION)):
            text, count = re.subn(rf"local {name} = nil", f"local {name} = {value}", text)
            assert count == 1, name
        self.course, self.time, self.seen, self.before, self.fin = course, 0.0, None, None, None
        self.switched, self.aborted, self.said = True, None, []
        lua = LuaRuntime()
        lua.globals().host = self
        lua.execute(AROUND)
        self.update, self.step_ms = lua.execute(text)

    def step(self, t, seen):
        self.before, self.seen, self.time, self.fin = self.seen and (self.time, self.seen), seen, t, None
        self.update()
        return self.fin

    def millis(self):
        return round(1000.0 * self.time)

    def turned(self, along, side):
        sin, cos = np.sin(self.course), np.cos(self.course)
        return float(along * cos - side * sin), float(along * sin + side * cos)

    def velocity(self):
        if self.before is None:
            return self.turned(self.seen.surge, 0.0)
        then, seen = self.before
        return self.turned(*((a - b) / (self.time - then) for a, b in ((self.seen.x, seen.x), (self.seen.y, seen.y))))

    def position(self):
        return self.turned(self.seen.x, self.seen.y)

    def get_yaw_rad(self):
        return (self.seen.yaw + self.course + np.pi) % (2.0 * np.pi) - np.pi

    def get_pitch_rad(self):
        return self.seen.pitch

    def get_roll_rad(self):
        return self.seen.roll

    def get_altitude(self):
        return -self.seen.depth

    def get_aux_cached(self, option):
        assert option == 300
        return 2 if self.switched else 0

    def is_armed(self):
        return True

    def send_text(self, severity, text):
        assert 0 <= severity <= 7
        self.said.append(text)
        if "ABORT" in text:
            self.aborted = (self.time, re.search(r"ABORT, (.*) left", text)[1])

    def get_output_pwm(self, function):
        assert function == self.FIN_FUNCTION
        return self.TRIM

    def find_channel(self, function):
        assert function == self.FIN_FUNCTION
        return self.CHANNEL

    def set_output_pwm_chan_timeout(self, channel, pwm, milliseconds):
        assert channel == self.CHANNEL
        assert milliseconds >= self.step_ms
        self.fin = (pwm - self.TRIM) / self.PWM_PER_RAD


def ardupilot(path, course):
    return ArduPilot(path.read_text(), course)
