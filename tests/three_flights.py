"""Three flights of a hull, two to fit and one to judge by: for tests of diagnoses on logs of other sensors and seas."""

from __future__ import annotations

import numpy as np
from truth import maneuvers
from truth.logbook import flown
from truth.noise import Clock
from truth.physics import Physics

CLOCK = Clock(0.1, 400)
HULL = Physics(damping=0.9, authority=-0.7, fin_bend=0.0)


def plans():
    """The maneuvers: a zig-zag, a multisine and a smaller zig-zag."""
    return (
        maneuvers.zigzag(CLOCK.time, 0.25, 0.4),
        maneuvers.multisine(CLOCK.time, np.random.default_rng(4), 0.25),
        maneuvers.zigzag(CLOCK.time, 0.15, 0.3),
    )


def three_flights(hidden, seed=0, **noise):
    """The logs (columns by canonical name) of the three maneuvers; `noise` is that of `flown`."""
    return [flown(hidden, CLOCK, plan, seed=seed + i, **noise) for i, plan in enumerate(plans())]
