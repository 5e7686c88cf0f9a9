"""The compiled Kalman filter where the sensors alone are noisy: a state of its own for each, (n_y,) and (n_p,)."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from fieldsid.noise.kalman.transition import STEADY_GAIN_STEPS, gains_repeat, hold_gains, steady_until
from fieldsid.numerics.arrays import FloatArray
from fieldsid.numerics.jit import jit


@jit
def sensor_colour_filter(
    steps: FloatArray, ok: npt.NDArray[np.bool_], noise: FloatArray, series: FloatArray, out: FloatArray, spreads: FloatArray
) -> float:
    """Do what `innovations.kalman_filter` does where nothing moves but what the sensors show."""
    n, log_sum = steps.shape[0] + 1, 0.0
    state = np.empty(series.shape[0])
    for ch in range(2):
        white, wander = noise[ch] ** 2, noise[4 + ch] ** 2
        var, gain, spread, kept = wander, 0.0, 1.0, 1.0
        settled, i, last_h = 0, 0, -1.0
        state[:] = 0.0
        while i < n:
            if settled >= STEADY_GAIN_STEPS:
                stop, settled = steady_until(steps, ok, i, last_h), 0
                over, own, push = 1.0 / spread, kept * (1.0 - gain), kept * gain
                for j in range(series.shape[0]):
                    m = state[j]
                    for l in range(i, stop):
                        out[j, ch, l] = (series[j, ch, l] - m) * over
                        m = own * m + push * series[j, ch, l]
                    state[j] = m
                log_sum += hold_gains(spreads[ch], i, stop, spread)
                i = stop
                continue
            seen = ok[ch, i]
            still = ok[0, i] and ok[1, i]
            spreads[ch, i] = 1.0
            if seen:
                g = var / (var + white)
                still = still and gains_repeat(g, gain)
                spread, gain = np.sqrt(var + white), g
                spreads[ch, i] = spread
                log_sum += np.log(var + white)
                var -= g * var
            for j in range(series.shape[0]):
                out[j, ch, i] = 0.0
                if seen:
                    e = series[j, ch, i] - state[j]
                    out[j, ch, i] = e / spread
                    state[j] += gain * e
            if i < n - 1:
                h = steps[i]
                if abs(h - last_h) > 1e-7 * h:
                    still, last_h, kept = False, h, np.exp(-h / noise[6])
                var = var * kept * kept + wander * (1.0 - kept * kept)
                for j in range(series.shape[0]):
                    state[j] *= kept
                settled = settled + 1 if still else 0
            i += 1
    return log_sum
