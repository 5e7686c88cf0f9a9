"""Whether a schedule earns its place: against the best constant gain and P with feed-forward, on a hull of every kind."""

from __future__ import annotations

import numpy as np
import pytest
from truth.against_table import OWN, PAPER, compared, line
from truth.gain_table import AT_LEAST_S, WITHIN
from truth.maneuvering.hulls import KINDS, draw_hull

from fieldsid.schedule.wish import Wish

SEED = 7


@pytest.mark.slow
@pytest.mark.parametrize("number", range(len(KINDS)), ids=list(KINDS))
def test_no_row_is_worse_than_one_constant_gain_and_a_quicker_p_asks_for_more_fin(number):
    hull = draw_hull(number, SEED)
    laws, worse = compared(hull, number, SEED, Wish("pd"))
    print("\n".join(line(name, rows) for name, rows in laws.items()))
    assert worse == 0
    own = laws[OWN]
    assert np.all(np.abs(own.flown - own.said) <= np.maximum(WITHIN * own.said, AT_LEAST_S))
    assert (PAPER in laws) == hull.stable  # P alone holds no unstable hull, and is refused
    if PAPER in laws:
        quicker = laws[PAPER].said < own.said / 1.01
        assert np.all(laws[PAPER].fin[quicker] > own.fin[quicker])
