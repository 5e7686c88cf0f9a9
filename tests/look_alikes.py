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
