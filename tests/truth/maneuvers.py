"""Excitations, written independently of the package: the open-loop command, and at each sample who steers."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from truth.kernel import HOLD, OPEN, ZIGZAG


@dataclass(frozen=True, slots=True)
class Maneuver:
    """The command (n,) in rad where mode (n,) is OPEN; in HOLD the pilot steers, in ZIGZAG the zig-zag rule.

    A command other than zero in HOLD makes the pilot keep the heading at which HOLD begins, not the initial one.
    """

    name: str
    command: np.ndarray
    mode: np.ndarray
    settings: dict[str, float] = field(default_factory=dict)


def _sequence(name, time, parts, *, keep_course=False):
    """Return a maneuver with the open-loop parts [(start, end, fin)], in s and rad, and a pilot who keeps the course between."""
    command, mode = np.zeros(time.size), np.full(time.size, HOLD)
    if keep_course:
        command[:] = 1.0
    for start, end, fin in parts:
        inside = (time >= start - 1e-9) & (time < end - 1e-9)
        command[inside], mode[inside] = fin, OPEN
    return Maneuver(name, command, mode)


def pulses(time, amplitude=0.26, second=0.15, *, width=2.0, start=2.0, recovery=11.0, polarity=1.0, name="pulses"):
    """Return the paper's pulses: +/- `amplitude`, `width` s each, recovery by the pilot, +/- `second`, recovery; mirrored."""
    parts, t, sign = [], start, polarity
    while t + 2 * width + 4.0 < time[-1]:
        for size in (amplitude, second):
            parts += [(t, t + width, sign * size), (t + width, t + 2 * width, -sign * size)]
            t += 2 * width + recovery
        sign = -sign
    return _sequence(name, time, parts)


def three_two_one_one(time, amplitude=0.2, *, step=1.2, start=2.0, recovery=9.0):
    """Return 3-2-1-1 inputs: 3, 2, 1 and 1 times `step` s to alternate sides, then recovery; every second one mirrored."""
    parts, t, sign = [], start, 1.0
    while t + 7 * step + 3.0 < time[-1]:
        for i, length in enumerate((3, 2, 1, 1)):
            parts.append((t, t + length * step, sign * amplitude * (-1) ** i))
            t += length * step
        t, sign = t + recovery, -sign
    return _sequence("3211", time, parts)


def prbs(time, rng, amplitude=0.15, *, hold=0.8, start=2.0, block=14.0, recovery=6.0):
    """Return a random binary fin, constant over `hold` s, in blocks of `block` s with recovery between them."""
    parts, t = [], start
    while t + 4.0 < time[-1]:
        end = min(t + block, time[-1] - 2.0)
        signs = rng.choice([-1.0, 1.0], max(int(np.ceil((end - t) / hold)), 1))
        parts += [(t + i * hold, min(t + (i + 1) * hold, end), s * amplitude) for i, s in enumerate(signs)]
        t = end + recovery
    return _sequence("prbs", time, parts)


def multisine(time, rng, amplitude=0.2, *, start=2.0, end_rest=4.0):
    """Return a sum of six sines from 0.08 to 1.2 Hz, scaled to a peak of `amplitude`."""
    inside = (time >= start) & (time < time[-1] - end_rest)
    wave = sum(np.sin(2 * np.pi * f * (time - start) + rng.uniform(0, 2 * np.pi)) / f**0.3 for f in np.geomspace(0.08, 1.2, 6))
    scale = amplitude / np.abs(wave[inside]).max()
    return Maneuver("multisine", np.where(inside, scale * wave, 0.0), np.where(inside, OPEN, HOLD))


def zigzag(time, fin=0.17, angle=0.17, *, start=2.0, end_rest=4.0):
    """Return a zig-zag: the fin, +/- `fin`, is reversed when the heading (pitch) differs by `angle` from the initial one."""
    inside = (time >= start) & (time < time[-1] - end_rest)
    return Maneuver("zigzag", np.zeros(time.size), np.where(inside, ZIGZAG, HOLD), {"zigzag_fin": fin, "zigzag_angle": angle})


def circle(time, fin=0.2, *, start=2.0, length=22.0, rest=6.0):
    """Return circles: a constant fin to one side for `length` s, a rest on the course reached, then the other side."""
    parts, t, sign = [], start, 1.0
    while t + 5.0 < time[-1]:
        parts.append((t, min(t + length, time[-1] - 2.0), sign * fin))
        t, sign = t + length + rest, -0.6 * sign
    return _sequence("circle", time, parts, keep_course=True)


def stairs(time, amplitude=0.2, *, start=2.0, length=5.0, rest=4.0):
    """Return steps of 1/4, 1/2, 3/4 and 1 times the amplitude to alternate sides, with recovery between them."""
    parts, t, i = [], start, 0
    while t + length + 2.0 < time[-1]:
        parts.append((t, t + length, amplitude * (0.25 * (1 + i % 4)) * (-1) ** i))
        t, i = t + length + rest, i + 1
    return _sequence("stairs", time, parts)
