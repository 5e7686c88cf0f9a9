"""Gains for a vehicle whose rudder is made of several fins: they keep them, and no limit is beyond what these follow."""

from __future__ import annotations

import pytest

from fieldsid.errors import UsageError
from fieldsid.models.allocation import Fins
from fieldsid.plant.parameter_source import load_parameter_source
from fieldsid.schedule.make import design_schedule
from fieldsid.schedule.record import load_schedule, save_schedule

FINS = Fins(("a", "b"), (0.5, 0.5), (), (0.3, 0.25)).of("yaw")


@pytest.fixture
def source(tmp_path):
    path = tmp_path / "table.csv"
    path.write_text("speed_m_s,a22,b2,C0\n1.4,1.1,-1.2,0.0\n")
    return load_parameter_source([path])


def test_a_schedule_keeps_the_fins_and_says_them(source, tmp_path):
    made = design_schedule(source, 0.25, fins=FINS)
    kept = load_schedule(save_schedule(made, tmp_path / "gains.yaml"))
    assert kept.fins == FINS
    assert kept.fins_said[1] == "b = 1 rudder, within +/-0.25 rad"
    assert "b = 1 rudder, within +/-0.25 rad" in made.summary()
    assert design_schedule(source, 0.25).fins is None


def test_a_limit_beyond_what_the_fins_follow_is_refused_with_theirs(source):
    with pytest.raises(UsageError, match="more than the fins reach") as caught:
        design_schedule(source, 0.26, fins=FINS)
    assert "`--fin-max 0.25`" in caught.value.hint
