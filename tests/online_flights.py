"""Flights of a linear yaw or pitch vehicle, exact between samples, with noise, for the tests of the live estimate."""

from __future__ import annotations

from functools import cache

import numpy as np
from scipy.linalg import expm

TRUTH = {"yaw": {"a22": 1.2, "b2": -0.8, "C0": 0.02}, "pitch": {"c22": 1.1, "c23": 0.3, "d2": -0.7, "Cb": 0.03}}
STEP_S = 0.05


@cache
def flown(
    axis="yaw",
    count=1200,
    seed=1,
    colour=0.0,
    noise=(0.004, 0.006),
    factor=1.0,
    damped=1.0,
    faster=1.0,
    sea=(0.0, 1.0),
    gust=(0.0, 0.0, 0.0),
):
    """Time, fin, angle and rate (n,) under a fin that jumps at random; noise of AR(1) colour on both sensors.

    The authority is `factor` times the truth's, the damping `damped` times, the vehicle `faster` than at the truth's speed. The
    `sea` is a moment with a standard deviation in rad/s^2 and a correlation time in s, a `gust` one from a time
    to another (s).
    """
    rng = np.random.default_rng(seed)
    values = list(TRUTH[axis].values())
    damping, stiffness, authority, trim = values if axis == "pitch" else (values[0], 0.0, *values[1:])
    damping, authority = damping * damped * faster, authority * factor * faster**2
    fin = np.concatenate([np.full(rng.integers(20, 60), rng.choice([-0.2, 0.0, 0.2])) for _ in range(count // 20)])[:count]
    system = np.zeros((3, 3))
    system[0, 1], system[1] = 1.0, [-stiffness, -damping, 1.0]
    move = expm(system * STEP_S)
    state, moment = np.zeros((count, 2)), moments(rng, count, *sea)
    moment[round(gust[0] / STEP_S) : round(gust[1] / STEP_S)] += gust[2]
    for i in range(count - 1):
        state[i + 1] = (move @ np.array([*state[i], authority * fin[i] + trim + moment[i]]))[:2]
    errors = rng.standard_normal((count, 2))
    for i in range(1, count):
        errors[i] = colour * errors[i - 1] + np.sqrt(1.0 - colour**2) * errors[i]
    angle, rate = (state + errors * noise).T
    return np.arange(count) * STEP_S, fin, angle, rate


def moments(rng, count, std, correlation_s):
    """A disturbance moment (n,), AR(1)."""
    out = np.zeros(count)
    if std:
        kept = np.exp(-STEP_S / correlation_s)
        for i in range(1, count):
            out[i] = kept * out[i - 1] + std * np.sqrt(1.0 - kept**2) * rng.standard_normal()
    return out


def fed(online, samples):
    """The identifier after all samples."""
    for sample in zip(*(np.asarray(s).tolist() for s in samples), strict=True):
        online.update(*sample)
    return online
