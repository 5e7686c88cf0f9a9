"""A hull of one pole under commands given at times of their own: r' = -a r + b d + c, exact from one command to the next."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, slots=True)
class Commanded:
    """Commands d (m,) rad given at times (m,) s, the first before all else, and the hull that they move from rest."""

    times: np.ndarray
    values: np.ndarray
    damping: float
    authority: float
    trim: float = 0.0

    def motion(self, time):
        """Angle and rate (2, n) at any times (n,) s, not before the first command."""
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
    """Commands of random sign or none, given `phase` s after whole multiples of `every` s, and one at rest before them."""
    rng = np.random.default_rng(seed)
    times = every * np.arange(1, count + 1) + phase
    return np.append(0.0, times), np.append(0.0, size * rng.integers(-1, 2, count))
