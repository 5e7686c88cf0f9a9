"""How a report says what a model leaves: over the noise, or, of a log that has none to speak of, as its fit."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from fieldsid.reporting.sections import _followed, _without_noise

MERIT = SimpleNamespace(angle_fit=79.04, rate_fit=86.52)


@pytest.mark.parametrize(
    ("name", "over", "says"),
    [("rate", 1.684, "rate 1.68 x its noise"), ("rate", 34503.16, "rate fit 86.5 %"), ("angle", 34503.16, "angle fit 79.0 %")],
)
def test_an_error_is_told_over_the_noise_where_there_is_some_and_else_as_the_fit(name, over, says):
    channel = SimpleNamespace(name=name, over_floor=over)
    found = SimpleNamespace(merit=MERIT, leading=channel)
    assert _followed(found, channel) == says
    if over > 100.0:
        assert _without_noise([found], "1 run") == f"{says} on 1 run; the log has next to no noise"
