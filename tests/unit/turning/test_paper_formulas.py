"""The paper's turning formulas against its own tables."""

from __future__ import annotations

import numpy as np
import pytest
from truth.paper import YAW

from fieldsid.errors import ModelError, UsageError
from fieldsid.turning.paper_formulas import refuse_short_fin, refuse_unstable, u_turn

TABLE_4 = ((8.91, 22.42, 7.61), (11.53, 17.68, 7.65), (15.48, 13.93, 7.23), (19.54, 11.35, 6.94), (24.87, 9.34, 6.54))


@pytest.mark.parametrize(("row", "wanted"), list(zip(YAW, TABLE_4, strict=True)), ids=lambda v: str(getattr(v, "speed", "")))
def test_table_4_follows_from_table_2_within_one_percent(row, wanted):
    turn = u_turn(row.speed, row.a22, row.b2, 0.26)
    assert (float(np.degrees(turn.yaw_rate_max)), float(turn.time), float(turn.radius)) == pytest.approx(wanted, rel=0.01)


def test_case_study_is_9_7_metres_and_its_steady_circle_9_2():
    turn = u_turn(1.37, 2.15, -1.62, 0.26 - 0.064)
    assert float(turn.radius) == pytest.approx(9.74, abs=0.05)
    assert float(turn.steady_radius) == pytest.approx(9.27, abs=0.1)


def test_papers_law_has_its_minimum_of_the_upper_branch_at_3_7_metres_per_second():
    speed = np.arange(0.25, 5.001, 0.05)
    turn = u_turn(speed, 1.0, 0.3263 * speed**2 + 0.2319, 0.26)
    upper = speed > 2.0
    best = int(np.argmin(np.where(upper, turn.radius, np.inf)))
    assert speed[best] == pytest.approx(3.7, abs=0.05)
    assert turn.radius[best] == pytest.approx(5.75, abs=0.01)
    assert turn.radius[0] == pytest.approx(4.0, abs=0.02)
    assert turn.time[0] == pytest.approx(50.0, abs=0.5)


def test_an_unstable_damping_and_a_fin_below_its_offset_are_refused():
    with pytest.raises(ModelError, match="a22 <= 0"):
        refuse_unstable(-0.2, "at 1.5 m/s", "")
    with pytest.raises(UsageError, match="below the offset"):
        refuse_short_fin(0.05, -0.064, "at 1.4 m/s", "")
