"""Causes that no catalogue has: each a function of one strength, with the events it needs per run."""

from __future__ import annotations

import numpy as np

from truth import kernel
from truth.noise import ar1, bursts, jams, telegraph


def fin_memory(rng, k):
    """A moment by the fin's recent mean square (heated actuator, wake on the tail)."""
    size, tau = 1.2 * k.moment / 0.26**2, rng.uniform(3.0, 8.0)
    return (lambda s, _u, _i: {"memory_moment": size * s, "memory_tau": tau}), None


def sloshing(rng, k):
    """A hardly damped mass on a spring (liquid in a half-full section) that the turning hull shakes.

    y'' = -w^2 y - 2 z w y' - p', p' += mu (w^2 y + 2 z w y') with mu its share of the inertia: passive, so stable.
    """
    omega = rng.uniform(1.0, 3.5)
    return (lambda s, _u, _i: {"slosh_moment": 0.5 * s, "slosh_omega": omega, "slosh_zeta": 0.04}), None


def hidden_product(rng, k):
    """Damping that comes and goes with a motion that is not in the log."""
    seeds = rng.integers(0, 2**31, k.runs)

    def events(inputs, clock, s, i):
        hidden = ar1(np.random.default_rng(seeds[i]), clock.total, 1.0, 3.0, clock.sample)
        inputs[kernel.DAMPING] = 1.0 + 1.5 * s * np.clip(hidden, -0.6 / max(s, 0.6), 2.0)

    return (lambda _s, _u, _i: {}), events


def authority_jumps(rng, k):
    """A fin that now and then loses part of its grip (ventilation, a loose coupling)."""
    seeds, mean = rng.integers(0, 2**31, k.runs), rng.uniform(2.5, 6.0)

    def events(inputs, clock, s, i):
        inputs[kernel.AUTHORITY] = telegraph(np.random.default_rng(seeds[i]), clock.whole, 1.0 - 0.8 * min(s, 1.2), mean)

    return (lambda _s, _u, _i: {}), events


def moment_bursts(rng, k):
    """Short trains of oscillating moment at random times (thruster pulsing)."""
    seeds = rng.integers(0, 2**31, k.runs)

    def events(inputs, clock, s, i):
        inputs[kernel.EVENT] += bursts(np.random.default_rng(seeds[i]), clock.whole, 0.6 * k.moment * s, 4)

    return (lambda _s, _u, _i: {}), events


def fin_jams(rng, k):
    """A fin that stays where it is for some seconds."""
    seeds = rng.integers(0, 2**31, k.runs)

    def events(inputs, clock, s, i):
        inputs[kernel.JAM] = jams(np.random.default_rng(seeds[i]), clock.whole, 3, 2.0 + 3.0 * min(s, 1.5))

    return (lambda _s, _u, _i: {}), events


CAUSES = {f.__name__: f for f in (fin_memory, sloshing, hidden_product, authority_jumps, moment_bursts, fin_jams)}
