"""The usual pulses, which every leg is compared with, keep the limits that the leg keeps."""

from __future__ import annotations

import pytest

from fieldsid.models.axis import Axis
from fieldsid.planning.belief.prior_model import named_prior
from fieldsid.planning.design.best_leg import COARSE_DRAWS, enforce_envelope, ensemble_at, leg_of, pulses, risk_of
from fieldsid.planning.design.objective import Setting, make_objective
from fieldsid.planning.flight.excitation import Window
from fieldsid.planning.safety.envelope import Envelope


def test_pulses_that_would_leave_the_envelope_are_compared_as_they_would_have_to_be_flown():
    setting = Setting(
        named_prior("torpedo", Axis.PITCH), Envelope(0.26, depth_low=3.0, depth_high=7.0, pitch=0.5), Window(22.0), {}
    )
    judge = make_objective(setting, 1.4)
    crowd = ensemble_at(judge)
    few, usual = crowd.first(COARSE_DRAWS), pulses(judge)
    assert risk_of(judge, few, usual)[0] > setting.envelope.share
    flown = leg_of(judge, enforce_envelope(judge, few, usual), crowd)
    assert {n: e.baseline for n, e in flown.expected.items()} == pytest.approx(
        {n: e.std_error for n, e in flown.expected.items()}
    )
