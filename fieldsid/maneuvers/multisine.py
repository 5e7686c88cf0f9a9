"""A multisine of low crest factor; rudder and elevator have alternate harmonics, so that both can be excited at once.

u(t) = sum over k of A_k cos(2 pi k t / T + phi_k), k = first + channel, first + channel + 2, ... The phases start from
Schroeder's; clipping and taking the new phases in turn (van der Ouderaa 1988) lowers the crest factor.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from fieldsid.maneuvers._contract import Maneuver, Parameter, Parameters, amplitude
from fieldsid.numerics.arrays import FloatArray

MAX_CREST_ITERATIONS = 150


def harmonics(p: Parameters) -> tuple[int, ...]:
    """Return the harmonics of 1/period between the two frequencies that belong to the channel."""
    first = max(1, int(np.ceil(p["low_hz"] * p["period"] - 1e-9)))
    last = max(first + 1, int(np.floor(p["high_hz"] * p["period"] + 1e-9)))
    return tuple(range(first + round(p["channel"]), last + 1, 2))


@lru_cache(maxsize=64)
def phases(numbers: tuple[int, ...]) -> FloatArray:
    """Return phases (h,) of equal cosines at `numbers` (h,) whose sum has a low crest factor."""
    count = len(numbers)
    index = np.array(numbers)
    best = -np.pi * np.arange(count) * (np.arange(count) + 1) / count
    size = 1 << int(np.ceil(np.log2(16 * max(numbers))))
    phase, lowest = best, np.inf
    for round_ in range(MAX_CREST_ITERATIONS):
        wave = _wave(index, phase, size)
        peak = float(np.max(np.abs(wave)))
        if peak < lowest:
            best, lowest = phase, peak
        clip = peak * (0.75 + 0.2 * round_ / MAX_CREST_ITERATIONS)
        phase = np.angle(np.fft.rfft(np.clip(wave, -clip, clip))[index])
    best.setflags(write=False)
    return best


def _wave(index: np.ndarray, phase: FloatArray, size: int) -> FloatArray:
    spectrum = np.zeros(size // 2 + 1, dtype=np.complex128)
    spectrum[index] = np.exp(1j * phase)
    return np.asarray(np.fft.irfft(spectrum, size) * size / 2)


def _shape(p: Parameters, time: FloatArray) -> FloatArray:
    numbers = harmonics(p)
    phase = phases(numbers)
    angle = 2.0 * np.pi * np.outer(time / p["period"], numbers) + phase
    size = 1 << int(np.ceil(np.log2(64 * max(numbers))))
    peak = float(np.max(np.abs(_wave(np.array(numbers), phase, size))))
    return np.asarray(np.cos(angle).sum(axis=1) / peak)


def _command(p: Parameters, time: FloatArray) -> FloatArray:
    wave = np.clip(_shape(p, time), -1.0, 1.0)
    inside = (time >= -1e-9) & (time < p["period"] * p["periods"] - 1e-9)
    return np.where(inside, p["amplitude"] * wave, np.where(time < 0, 0.0, np.nan))


MANEUVER = Maneuver(
    name="multisine",
    says="many sines at once with their peaks spread out; rudder and elevator use different harmonics",
    parameters=(
        amplitude(0.2),
        Parameter("low_hz", "Hz", 0.01, 5.0, 0.05, "lowest frequency"),
        Parameter("high_hz", "Hz", 0.02, 10.0, 0.6, "highest frequency"),
        Parameter("period", "s", 2.0, 300.0, 20.0, "length of one period", tuned=False),
        Parameter("periods", "", 1, 20, 1, "number of periods", whole=True, tuned=False),
        Parameter("channel", "", 0, 1, 0, "0 rudder, 1 elevator", whole=True, tuned=False),
    ),
    duration=lambda p: p["period"] * p["periods"],
    command=_command,
    source="Schroeder 1970; van der Ouderaa 1988; Morelli 2012, orthogonal multisines",
)
