"""One made run as several loggers would write it: r' = -0.8 r + 0.7 rudder, held from sample to sample, and a dive beside it."""

import numpy as np

A22, B2, SPEED = 0.8, 0.7, 1.5


def truth(seconds=120.0, rate_hz=10.0, noise=1.0, seed=4, slide_s=0.0):
    """Return signals by canonical name, (n,) each: exact steps of the held fin, white noise on what sensors measure.

    The course of x and y is the heading less `slide_s` times its rate.
    """
    rng = np.random.default_rng(seed)
    time = np.arange(round(seconds * rate_hz)) / rate_hz
    step = 1.0 / rate_hz
    rudder = np.radians(8.0) * np.sign(np.sin(2 * np.pi * time / 17.0 + 0.3)) * (time > 5.0)
    yaw, rate = np.zeros_like(time), np.zeros_like(time)
    decay = np.exp(-A22 * step)
    for k in range(time.size - 1):
        steady = B2 * rudder[k] / A22
        rate[k + 1] = steady + (rate[k] - steady) * decay
        yaw[k + 1] = yaw[k] + steady * step + (rate[k] - steady) * (1 - decay) / A22
    pitch = 0.15 * np.sin(2 * np.pi * time / 40.0)
    depth = 10.0 - np.cumsum(SPEED * np.sin(pitch)) * step
    course = yaw - slide_s * rate
    north, east = np.cumsum(SPEED * np.cos(course)) * step, np.cumsum(SPEED * np.sin(course)) * step

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
