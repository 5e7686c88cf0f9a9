"""What to fly next between rivals: the maneuver that decides, or that none does."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from fieldsid.diagnosis.records import Errors
from fieldsid.diagnosis.report import next_maneuver
from fieldsid.diagnosis.verdict import Verdict
from fieldsid.maneuvers import parse_spec
from fieldsid.models.model import Noise
from fieldsid.planning.discriminate.discriminate import Separation
from fieldsid.planning.flight.excitation import Window

FLOOR = Noise(0.004, 0.002)
RIVALS = [SimpleNamespace(names=(n,), likelihood_model=None) for n in ("servo_lag", "delay")]
WORK = SimpleNamespace(
    is_noiseless=False, known=(), records=[SimpleNamespace(fin=np.array([-0.2, 0.0, 0.2]), speed=1.5)],
    parallel=SimpleNamespace(map=None),
)  # fmt: skip


@pytest.mark.parametrize("odds", [12.0, 0.4])
def test_a_maneuver_that_is_not_expected_to_decide_is_not_advised_as_if_it_did(monkeypatch, odds):
    plan = Separation("prbs", parse_spec("prbs")[1], 1.4, odds, {}, Window(), {})
    monkeypatch.setattr("fieldsid.planning.discriminate.discriminate.separate", lambda *_args, **_more: plan)
    fly = next_maneuver.next_maneuver(WORK, Verdict("undecided", ("servo_lag",), (RIVALS[1],)), RIVALS[0], {}, FLOOR)
    assert fly.expected_log_odds == odds
    assert fly.command == "sysid plan --separate servo_lag,delay"
    assert ("no maneuver inside the fin angles flown" in (fly.note or "")) == (odds < next_maneuver.RIVAL_LOG_ODDS)
    assert (fly.maneuver == "prbs") == (odds >= next_maneuver.RIVAL_LOG_ODDS)


LACKS = {"roll_coupling": "needs roll, which the log lacks"}


@pytest.mark.parametrize(
    ("word", "over", "asked"),
    [
        ("sufficient", 1.02, False),
        ("sufficient", 1.4, False),
        ("effect", 1.02, False),
        ("effect", 1.12, False),
        ("effect", 1.4, True),
    ],
)
def test_a_signal_is_missed_only_where_something_is_left_for_it(word, over, asked):
    found = SimpleNamespace(selection_errors=Errors(over * FLOOR.angle, over * FLOOR.rate))
    fly = next_maneuver.next_maneuver(WORK, Verdict(word, ()), found, LACKS, FLOOR)
    assert (fly is not None) == asked
    if fly:
        left = "an error of 1.40 x the noise floor is left"
        assert fly.why == f"{left}, and roll_coupling could not be tried: needs roll, which the log lacks"
