"""The speed lost in a turn: the compiled surge is the plain one, and settles where the equation does."""

from __future__ import annotations

import numpy as np

from fieldsid.numerics.jit import plain_of
from fieldsid.turning.steady.speed_loss import simulated


def test_the_surge_settles_where_push_drag_and_loss_balance_compiled_or_not():
    drag, straight, lost = 0.1, 1.5, 0.05
    columns = [np.full(1200, v) for v in (drag * straight**2, drag, lost)]
    surge = simulated(np.full(1199, 0.2), *columns, 1.0)
    assert surge[0] == 1.0
    np.testing.assert_allclose(surge[-1], np.sqrt(straight**2 - lost / drag), rtol=1e-9)
    np.testing.assert_allclose(surge, plain_of(simulated)(np.full(1199, 0.2), *columns, 1.0), rtol=1e-12)
