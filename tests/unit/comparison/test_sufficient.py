"""One limit of what is the noise: of the same errors over the same noise every room comes to the same verdict."""

from __future__ import annotations

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fieldsid.comparison.compare import Channel, Comparison
from fieldsid.comparison.left_by import left_by_addition
from fieldsid.comparison.sufficient import SUFFICIENT_ERROR_RATIO, is_noise, over_noise, pooled
from fieldsid.diagnosis.records import Errors, Pair
from fieldsid.extension.extend import Gain
from fieldsid.models.model import Noise

RATIO = st.floats(0.5, 3.0)
NAN = float("nan")


def compared(floor, angle, rate):
    channels = [Channel(n, r, 90.0, None, (), ()) for n, r in (("angle", angle), ("rate", rate)) if r == r]  # noqa: PLR0124
    return Comparison(None, None, floor, tuple(sorted(channels, key=lambda c: -c.over_floor)), (), None)


@given(st.floats(1e-4, 0.1), st.floats(1e-4, 0.1), RATIO, st.one_of(RATIO, st.just(NAN)))
def test_compare_extend_diagnose_and_status_come_to_one_verdict(angle_noise, rate_noise, angle, rate):
    floor = Noise(angle_noise, rate_noise)
    errors = Errors(angle * angle_noise, rate * rate_noise)
    record = {"angle_rms_rad": errors.angle_rms_rad, "rate_rms_rad_s": None if rate != rate else errors.rate_rms_rad_s}  # noqa: PLR0124
    noise = {"angle_rad": angle_noise, "rate_rad_s": rate_noise}
    both = Pair(errors, errors)
    gain = Gain(("servo_lag",), both, both, floor, unseen=True, learned_on=("a",), judged_on=("b",))
    info = {"extension": {"noise_floor": noise, "after": {"train": record, "validation": record}}}
    found = compared(floor, angle, rate)
    overs = [
        errors.over(floor),
        over_noise(record, noise),
        found.over_noise,
        *gain.left(kept=True),
        left_by_addition(info),
    ]
    assert overs == pytest.approx([overs[0]] * len(overs))
    if abs(overs[0] - SUFFICIENT_ERROR_RATIO) > 1e-6:
        assert len({is_noise(over) for over in overs}) == 1
        assert bool(found.failing) is not is_noise(overs[0])


def test_one_channel_a_little_above_its_noise_is_no_failure_of_the_run():
    found = compared(Noise(1.0, 1.0), 1.02, 1.23)
    assert found.over_noise == pytest.approx(1.13, abs=0.005)
    assert found.failing == ()
    worse = replace(found, channels=(replace(found.channels[0], over_floor=1.4), found.channels[1]))
    assert [c.name for c in worse.failing] == ["rate"]


def test_runs_are_pooled_as_channels_are_and_what_was_not_measured_counts_for_nothing():
    assert pooled([1.0, 2.0, NAN]) == pytest.approx(2.5**0.5)
    assert is_noise(pooled([]))
