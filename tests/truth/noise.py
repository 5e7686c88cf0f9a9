"""Sensor noise, disturbance moments, quantisation, gaps, and events that are in no model."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter

from truth import kernel

PRE_S = 1.0
TAIL_S = 0.6
"""Time (s) flown before the log starts and after it ends, which delays and shifted clocks need."""


@dataclass(frozen=True, slots=True)
class Clock:
    """Sampling of one log: interval in s and number of samples; PRE_S and TAIL_S are flown around it."""

    sample: float
    samples: int

    @property
    def pre(self) -> int:
        return round(PRE_S / self.sample)

    @property
    def total(self) -> int:
        return self.pre + self.samples + round(TAIL_S / self.sample)

    @property
    def time(self):
        return np.arange(self.samples) * self.sample

    @property
    def whole(self):
        """Times (total,) of all flown samples in s, zero at the start of the log."""
        return (np.arange(self.total) - self.pre) * self.sample

    def logged(self, values):
        """Return the part of a flown series (total,) that is in the log."""
        return values[self.pre : self.pre + self.samples]


def white(rng, n, sigma):
    """Return white Gaussian noise (n,)."""
    return sigma * rng.standard_normal(n)


def ar1(rng, n, sigma, correlation_s, sample):
    """Return stationary Ornstein-Uhlenbeck noise (n,) of standard deviation sigma."""
    keep = np.exp(-sample / correlation_s)
    drive = rng.standard_normal(n) * sigma * np.sqrt(1.0 - keep * keep)
    drive[0] = sigma * rng.standard_normal()
    return lfilter([1.0], [1.0, -keep], drive)


def quantised(values, step):
    """Return values rounded to multiples of `step`."""
    return np.round(np.asarray(values) / step) * step


def with_gaps(rng, values, count, length):
    """Return a copy with `count` gaps of `length` samples set to NaN."""
    out = np.array(values, dtype=float)
    for start in rng.integers(0, max(out.size - length, 1), count):
        out[start : start + length] = np.nan
    return out


def telegraph(rng, time, low, mean_s):
    """Return a factor (n,) that jumps between 1 and `low` and stays about `mean_s` s at each."""
    out, level, until = np.ones(time.size), 1.0, time[0] + rng.exponential(mean_s)
    for i, t in enumerate(time):
        if t >= until:
            level, until = (low if level == 1.0 else 1.0), t + rng.uniform(0.4, 1.6) * mean_s
        out[i] = level
    return out


def bursts(rng, time, amplitude, count):
    """Return a moment (n,) of short trains of oscillation at random times."""
    out = np.zeros(time.size)
    for _ in range(count):
        start, length, omega = rng.uniform(2.0, time[-1] - 6.0), rng.uniform(3.0, 7.0), rng.uniform(1.0, 3.0)
        inside = (time >= start) & (time < start + length)
        out[inside] += amplitude * np.sin(omega * (time[inside] - start)) * np.sin(np.pi * (time[inside] - start) / length)
    return out


def jams(rng, time, count, length_s):
    """Return an array (n,) that is one where the fin is jammed and zero elsewhere."""
    out = np.zeros(time.size)
    for _ in range(count):
        start = rng.uniform(3.0, max(time[-1] - length_s - 2.0, 4.0))
        out[(time >= start) & (time < start + length_s)] = 1.0
    return out


def calm(clock, thrust=50.0):
    """Return the inputs of the kernel (9, total) without noise and events, at a steady thrust (N)."""
    out = np.zeros((kernel.INPUTS, clock.total))
    out[[kernel.AUTHORITY, kernel.DAMPING]] = 1.0
    out[kernel.THRUST] = thrust
    return out
