"""A first-order hull r' = -a r + b d + c under commands at arbitrary times, integrated exactly from one to the next."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, slots=True)
class Commanded:
    """Commands d (m,) in rad at times (m,) in s, the first before every sample, and the hull, which starts at rest."""

    times: np.ndarray
    values: np.ndarray
    damping: float
    authority: float
    trim: float = 0.0

    def motion(self, time):
        """Return angle and rate (2, n) at times (n,) in s, none before the first command."""
        a, angle, rate, begun, out = self.damping, 0.0, 0.0, float(self.times[0]), []
        whole = np.append(self.times, np.inf)
        for k, value in enumerate(self.values):
            settled = (self.authority * value + self.trim) / a

            def after(s, angle=angle, rate=rate, settled=settled):
                gone = -np.expm1(-a * s) / a
                return np.array([angle + settled * (s - gone) + rate * gone, settled + (rate - settled) * np.exp(-a * s)])

            inside = time[(time >= whole[k]) & (time < whole[k + 1])]
            out.append(after(inside - begun))
            if np.isfinite(whole[k + 1]):
                angle, rate = after(whole[k + 1] - begun)
                begun = float(whole[k + 1])
        return np.concatenate(out, axis=1)


def pulses(phase, *, every=0.8, count=100, size=0.15, seed=5):
    """Return commands of random sign or zero at `phase` s after multiples of `every` s, and a zero command before them."""
    rng = np.random.default_rng(seed)
    times = every * np.arange(1, count + 1) + phase
    return np.append(0.0, times), np.append(0.0, size * rng.integers(-1, 2, count))
