"""What to fly next between rivals: the maneuver that decides, or that none does."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from fieldsid.diagnosis import advise
from fieldsid.diagnosis.verdict import Verdict

RIVALS = [SimpleNamespace(names=(n,), own_model=None) for n in ("servo_lag", "delay")]
WORK = SimpleNamespace(known=(), records=[SimpleNamespace(fin=np.array([-0.2, 0.0, 0.2]), speed=1.5)])


@pytest.mark.parametrize("odds", [12.0, 0.4])
def test_a_maneuver_that_is_not_expected_to_decide_is_not_advised_as_if_it_did(monkeypatch, odds):
    plan = SimpleNamespace(expected_log_odds=odds, plain=lambda: {"maneuver": "prbs", "expected_log_odds": odds})
    monkeypatch.setattr("fieldsid.planning.discriminate.separate", lambda *_args, **_more: plan)
    fly = advise.next_maneuver(WORK, Verdict("undecided", ("servo_lag",), (RIVALS[1],)), RIVALS[0], {})
    assert fly["expected_log_odds"] == odds
    assert fly["command"] == "sysid plan --separate servo_lag,delay"
    assert ("no maneuver inside the fin angles flown" in fly.get("note", "")) == (odds < advise.DECIDES)
    assert (fly["maneuver"] == "prbs") == (odds >= advise.DECIDES)
