"""Runs whose numbers are known, and files of them in the names, units, clocks and damage of the field's own loggers.

Of both a rudder turns a vehicle of first order in yaw, r' = -a r + b delta: `truth` is measured with noise and dives beside it,
`flight` steps its rudder every few seconds and is what each table of TABLES holds.
"""

from __future__ import annotations

from functools import cache

import numpy as np
from binary_logs import write_alog, write_dbd, write_mat

A22, B2, SPEED = 0.8, 0.7, 1.5
A, B, STEP = -0.8, -2.4, 0.25
LENGTH_S = 240.0


def turned(rudder, step, damping, authority):
    """Yaw and its rate (n,) under a rudder that is held from sample to sample, exactly."""
    yaw, rate = np.zeros_like(rudder), np.zeros_like(rudder)
    decay = np.exp(-damping * step)
    for k in range(rudder.size - 1):
        steady = authority * rudder[k] / damping
        rate[k + 1] = steady + (rate[k] - steady) * decay
        yaw[k + 1] = yaw[k] + steady * step + (rate[k] - steady) * (1 - decay) / damping
    return yaw, rate


def way(course, step):
    """North and east (n,) of a vehicle at its speed."""
    return np.cumsum(SPEED * np.cos(course)) * step, np.cumsum(SPEED * np.sin(course)) * step


def truth(seconds=120.0, rate_hz=10.0, noise=1.0, seed=4, slide_s=0.0):
    """Return signals by canonical name, (n,) each: exact steps of the held fin, white noise on what sensors measure.

    The course of x and y is the heading less `slide_s` times its rate.
    """
    rng = np.random.default_rng(seed)
    time = np.arange(round(seconds * rate_hz)) / rate_hz
    step = 1.0 / rate_hz
    rudder = np.radians(8.0) * np.sign(np.sin(2 * np.pi * time / 17.0 + 0.3)) * (time > 5.0)
    yaw, rate = turned(rudder, step, A22, B2)
    pitch = 0.15 * np.sin(2 * np.pi * time / 40.0)
    depth = 10.0 - np.cumsum(SPEED * np.sin(pitch)) * step
    course = yaw - slide_s * rate
    north, east = way(course, step)

    def sensed(values, std):
        return values + noise * std * rng.standard_normal(time.size)

    return {
        "time_s": time,
        "yaw_rad": sensed(yaw, 0.003),
        "yaw_rate_rad_s": sensed(rate, 0.002),
        "rudder_rad": rudder,
        "surge_m_s": sensed(SPEED + 0.0 * time, 0.01),
        "x_m": sensed(north, 0.02),
        "y_m": sensed(east, 0.02),
        "course_rad": sensed(course, 0.003),
        "pitch_rad": sensed(pitch, 0.002),
        "pitch_rate_rad_s": sensed(np.gradient(pitch, time), 0.002),
        "depth_m": sensed(depth, 0.01),
    }


def write_table(path, columns, separator=",", head=""):
    """Write columns (n,) by name as a text table, below lines of words; returns the path."""
    rows = "\n".join(separator.join(f"{v:.10g}" for v in row) for row in zip(*columns.values(), strict=True))
    path.write_text(head + separator.join(columns) + "\n" + rows + "\n")
    return path


def write_dataflash_text(path, run, parameters=(), outputs=14, rudder=3, per_rad=800.0):
    """Write a run as ArduPilot's text log: attitude, gyros, and the pulses of outputs, of which the n-th moves the rudder."""
    names = [f"C{k + 1}" for k in range(outputs)]
    lines = [
        "FMT, 128, 89, FMT, BBnNZ, Type,Length,Name,Format,Columns",
        "FMT, 15, 27, ATT, QccC, TimeUS,Roll,Pitch,Yaw",
        f"FMT, 16, 40, RCOU, Q{'H' * outputs}, TimeUS,{','.join(names)}",
        "FMT, 17, 40, IMU, QBfff, TimeUS,I,GyrX,GyrY,GyrZ",
        "FMT, 19, 40, PARM, QNf, TimeUS,Name,Value",
        *(f"PARM, 1000, {name}, {value}" for name, value in parameters),
    ]
    rng = np.random.default_rng(8)
    idle = np.round(1500 + 20 * rng.standard_normal((run["time_s"].size, outputs)))
    for k, t in enumerate(run["time_s"]):
        pulses = [f"{v:.0f}" for v in idle[k]]
        pulses[0] = "1600"
        pulses[rudder - 1] = f"{1500 + per_rad * run['rudder_rad'][k]:.0f}"
        stamp = round(5e6 + 1e6 * t)
        lines.append(f"RCOU, {stamp}, {', '.join(pulses)}")
        lines.append(f"ATT, {stamp}, 0.0, 0.0, {np.degrees(run['yaw_rad'][k]) % 360:.4f}")
        lines += [f"IMU, {stamp}, {i}, 0.0, 0.0, {run['yaw_rate_rad_s'][k] + 1e-4 * i:.6f}" for i in (0, 1)]
    path.write_text("\n".join(lines) + "\n")
    return path


def write_key_value(path, time, signals):
    """Write signals (n,) at times (n,) as one reading a row: time, key, value."""
    lines = [f"{float(t)!r},{name},{float(v[k])!r}\n" for k, t in enumerate(time) for name, v in signals.items()]
    path.write_text("Timestamp,Key,Value\n" + "".join(lines))
    return path


def write_text_dataflash(path, time, signals):
    """Write signals by canonical name at times (n,) as ArduPilot's text log."""
    return write_dataflash_text(path, {"time_s": time, **signals}, (("SERVO3_FUNCTION", 26),), outputs=4)


def flight(step=STEP, length_s=LENGTH_S, seed=3):
    """Time, and rudder, yaw, yaw rate, x, y and speed on it (n,), SI and NED, of one's own."""
    return {name: values.copy() for name, values in _flown(step, length_s, seed).items()}


@cache
def _flown(step, length_s, seed):
    fine, rng = 0.01, np.random.default_rng(seed)
    count = round(length_s / fine)
    holds = np.repeat(rng.choice([-0.25, -0.12, 0.0, 0.12, 0.25], count // 300 + 1), 300)[:count]
    holds[:500] = 0.0
    yaw, rate = turned(holds, fine, -A, B)
    x, y = way(yaw, fine)
    every = slice(None, None, round(step / fine))
    speed = SPEED + 0.01 * rng.standard_normal(count)
    return {
        "time": fine * np.arange(count)[every],
        **{n: v[every] for n, v in (("rudder", holds), ("yaw", yaw), ("rate", rate), ("x", x), ("y", y), ("speed", speed))},
    }


def heading(found, decimals=2):
    return np.round(np.degrees(found["yaw"]) % 360.0, decimals)


def iver(folder, *, separator=";", spoilt=False):
    """A table of an Iver: clock and date apart, compass beside GPS course, knots, fins as counts about 128."""
    f, lat0 = flight(), 41.7
    seconds = 86400.0 - 100.0 + f["time"] if not spoilt else 3600.0 - 100.0 + f["time"]
    lines = [
        separator.join(
            ["Latitude", "Longitude", "Time", "Date", "Number of Sats", "GPS Speed (Kn)", "GPS True Heading",
             "C Magnetic Heading", "C True Heading", "Pitch Angle", "DFS Depth (m)", "Total Water Column (m)", "Batt State",
             "Time to Empty", "Next Speed (kn)", "Vehicle Speed (kn)", "Motor Speed CMD", "Next Heading", "Depth Goal (m)",
             "Fin Pitch R", "Fin Yaw T", "Fin Yaw B", "Yaw Goal", "Fin Roll", "Depth feet"]
        )
    ]  # fmt: skip
    for i, s in enumerate(seconds):
        day, of_day = divmod(s, 86400.0)
        minute = f"{int(of_day // 60) % 60:02d}:{of_day % 60:04.1f}"
        clock = minute if spoilt else f"{int(of_day // 3600):02d}:{int(of_day // 60) % 60:02d}:{of_day % 60:05.2f}"
        fin = round(128 + 200 * f["rudder"][i])
        lat = lat0 + np.degrees(f["x"][i] / 6.36e6)
        lon = -71.4 + np.degrees(f["y"][i] / (6.385e6 * np.cos(np.radians(lat0))))
        cells = [f"{lat:.8f}", f"{lon:.8f}", clock, f"06/{8 + int(day):02d}/2024", 9, 3.1, heading(f, 0)[i], 14.0,
                 heading(f)[i], round(0.4 + 0.1 * np.sin(i), 2), round(2.0 + 0.05 * np.sin(0.1 * i), 2), 8.5, "D", 1500.0, 3.0,
                 round(f["speed"][i] / 0.514444, 3), 160, 12.0, 2.0, 127 + i % 3, fin, fin, 30.0, 0, 6.6]  # fmt: skip
        lines.append(separator.join(map(str, cells)))
    path = folder / ("spoilt.csv" if spoilt else "iver.log")
    path.write_text("\n".join(lines) + "\n" + separator * 24 + "\n")
    return path


def spreadsheet(folder):
    return iver(folder, separator=",", spoilt=True)


def tank(folder):
    """A towing tank's table without names: three digits of everything, cp1252 words above."""
    f = flight()
    noise = 1e-3 * np.random.default_rng(8).standard_normal((5, f["time"].size))
    columns = (f["time"], 100.0 + f["x"], f["y"] - 5.0, 57.3 * noise[0], np.degrees(f["yaw"]), f["speed"], noise[1],
               np.degrees(f["rate"]), np.degrees(f["rudder"]), 9.2 + noise[3])  # fmt: skip
    rows = ["\t".join(f"{v:.3e}" if k else f"{v:.2e}" for k, v in enumerate(row)) for row in zip(*columns, strict=True)]
    path = folder / "tank.dat"
    path.write_bytes(("Basin, free running\nZ 15°/15°\n\n" + "\n".join(rows) + "\n").encode("cp1252"))
    return path


def units_row(folder):
    """Names, then units, decimal commas, semicolons, words in the middle, UTF-16."""
    f = flight()
    columns = (f["time"] * 1e3, np.degrees(f["yaw"]), np.degrees(f["rate"]), f["speed"] * 100, np.degrees(f["rudder"]))
    rows = [";".join(f"{v:.4f}".replace(".", ",") for v in row) for row in zip(*columns, strict=True)]
    rows.insert(300, "operator: rudder freed; went on")
    path = folder / "units.txt"
    path.write_bytes("\r\n".join(["t;psi;r;u;DRUD", "ms;deg;deg/s;cm/s;deg", *rows, ""]).encode("utf-16"))
    return path


def pulses(folder):
    """Epoch in whole seconds at 4 Hz, pulses of a servo in microseconds."""
    f = flight()
    rows = [
        f"{int(1.71e9 + t)},{h},{p}"
        for t, h, p in zip(f["time"], heading(f), np.round(1500 + 900 * f["rudder"]).astype(int), strict=True)
    ]
    path = folder / "pulses.csv"
    path.write_text("epoch,compass,rudder_servo\n" + "\n".join(rows) + "\n")
    return path


def gps_week(folder):
    f = flight()
    rows = [
        f"2300,{(604700000 + round(1e3 * t)) % 604800000},{h},{d:.3f}"
        for t, h, d in zip(f["time"], heading(f), np.degrees(f["rudder"]), strict=True)
    ]
    rows = [r.replace("2300", "2301", 1) if int(r.split(",")[1]) < 300000000 else r for r in rows]
    path = folder / "gps.csv"
    path.write_text("GPS Week,TOW,Heading deg,Rudder deg\n" + "\n".join(rows) + "\n")
    return path


def glider(folder):
    """A glider's table: three rows of labels, a fin that is measured and commanded."""
    f = flight()
    head = ["dbd_label: DBD_ASC(dinkum_binary_data_ascii)file", "num_label_lines: 3", "num_segments: 1"]
    names = ["m_present_time", "m_heading", "c_heading", "m_fin", "c_fin", "m_roll", "m_depth_rate", "m_depth"]
    units = ["timestamp", "rad", "rad", "rad", "rad", "rad", "m/s", "m"]
    rows = []
    for i, t in enumerate(f["time"]):
        fin = f["rudder"][i]
        measured = [f"{1.6e9 + t:.3f}", f"{f['yaw'][i] % 6.283185:.5f}", "0.5", f"{fin:.4f}", f"{fin:.4f}"]
        rows.append([*measured, "0.01", "0.1", f"{5 + 0.01 * i:.2f}"])
    path = folder / "glider.dba"
    path.write_text("\n".join([*head, " ".join(names), " ".join(units), "8 4 4 4 4 4 4 4", *(" ".join(r) for r in rows)]) + "\n")
    return path


def moos(folder):
    f = flight()
    signals = {"NAV_HEADING": heading(f, 4), "NAV_SPEED": f["speed"], "DESIRED_HEADING": 0.0 * f["time"]}
    return write_alog(folder / "pandan.alog", f["time"], signals | {"DESIRED_RUDDER": np.degrees(f["rudder"])})


def slocum(folder):
    f = flight()
    return write_dbd(folder / "pandan.dbd", f["time"], {"m_heading": f["yaw"], "m_depth": f["speed"], "c_fin": f["rudder"]})


def matlab(folder):
    f = flight()
    return write_mat(folder / "pandan.mat", f["time"], {"heading_deg": heading(f, 4), "Rudder": np.degrees(f["rudder"])})


TABLES = {m.__name__: m for m in (iver, spreadsheet, tank, units_row, pulses, gps_week, glider, moos, slocum, matlab)}
