"""Causes that are in no catalogue: each a function of one strength, with the events that it needs in each run."""

from __future__ import annotations

import numpy as np

from truth import kernel
from truth.noise import ar1, bursts, jams, telegraph


def fin_memory(rng, k):
    """Return a moment proportional to the recent mean square of the fin angle (heated actuator, wake on the tail)."""
    size, tau = 1.2 * k.moment / 0.26**2, rng.uniform(3.0, 8.0)
    return (lambda s, _u, _i: {"memory_moment": size * s, "memory_tau": tau}), None


def sloshing(rng, k):
    """Return a lightly damped mass on a spring (liquid in a half-full section) that the turning hull excites.

    y'' = -w^2 y - 2 z w y' - p', p' += mu (w^2 y + 2 z w y'), mu being its share of the inertia; passive, hence stable.
    """
    omega = rng.uniform(1.0, 3.5)
    return (lambda s, _u, _i: {"slosh_moment": 0.5 * s, "slosh_omega": omega, "slosh_zeta": 0.04}), None


def hidden_product(rng, k):
    """Return a damping that varies with a motion that is not in the log."""
    seeds = rng.integers(0, 2**31, k.runs)

    def events(inputs, clock, s, i):
        hidden = ar1(np.random.default_rng(seeds[i]), clock.total, 1.0, 3.0, clock.sample)
        inputs[kernel.DAMPING] = 1.0 + 1.5 * s * np.clip(hidden, -0.6 / max(s, 0.6), 2.0)

    return (lambda _s, _u, _i: {}), events


def authority_jumps(rng, k):
    """Return a fin that sometimes loses part of its authority (ventilation, a loose coupling)."""
    seeds, mean = rng.integers(0, 2**31, k.runs), rng.uniform(2.5, 6.0)

    def events(inputs, clock, s, i):
        inputs[kernel.AUTHORITY] = telegraph(np.random.default_rng(seeds[i]), clock.whole, 1.0 - 0.8 * min(s, 1.2), mean)

    return (lambda _s, _u, _i: {}), events


def moment_bursts(rng, k):
    """Return short trains of an oscillating moment at random times (thruster pulsing)."""
    seeds = rng.integers(0, 2**31, k.runs)

    def events(inputs, clock, s, i):
        inputs[kernel.EVENT] += bursts(np.random.default_rng(seeds[i]), clock.whole, 0.6 * k.moment * s, 4)

    return (lambda _s, _u, _i: {}), events


def fin_jams(rng, k):
    """Return a fin that jams for some seconds."""
    seeds = rng.integers(0, 2**31, k.runs)

    def events(inputs, clock, s, i):
        inputs[kernel.JAM] = jams(np.random.default_rng(seeds[i]), clock.whole, 3, 2.0 + 3.0 * min(s, 1.5))

    return (lambda _s, _u, _i: {}), events


CAUSES = {f.__name__: f for f in (fin_memory, sloshing, hidden_product, authority_jumps, moment_bursts, fin_jams)}
