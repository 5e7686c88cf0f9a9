"""How a report says what a model leaves: over the noise, or, of a log that has none to speak of, as its fit."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from fieldsid.comparison.compare import Channel, Comparison
from fieldsid.comparison.metrics import Metrics
from fieldsid.reporting.sections import _channel_error, _vehicle
from fieldsid.vehicle import vehicle_of
from fieldsid.views.comparison import verdict


def run(name, over, fit):
    channel = Channel(name, over, fit, Metrics(0.1, 0.9, 0.5), (), ())
    return Comparison(SimpleNamespace(record=SimpleNamespace(name="run7")), None, None, (channel,), (), None)


@pytest.mark.parametrize(
    ("name", "over", "fit", "says"),
    [
        ("rate", 1.684, 86.52, "rate 1.68 x its noise"),
        ("rate", 34503.16, 86.52, "rate fit 86.5 %"),
        ("angle", 34503.16, 79.04, "angle fit 79.0 %"),
    ],
)
def test_an_error_is_told_over_the_noise_where_there_is_some_and_else_as_the_fit(name, over, fit, says):
    found = run(name, over, fit)
    assert _channel_error(found.worst_channel) == says
    assert verdict([found]).startswith(f"run7: {says}" if over > 100.0 else f"run7: error {over:.2f} x the noise, {name} fit")


def test_of_runs_without_noise_the_worst_is_that_of_the_least_fit_whatever_their_digits():
    runs = [run("rate", 25000.0, 93.3), run("angle", 5600.0, 65.4)]
    assert verdict(runs) == "run7: angle fit 65.4 %"


def test_a_report_tells_the_fins_that_make_rudder_and_elevator():
    fins = {"names": ["a", "b"], "to_rudder": [0.5, 0.5], "to_elevator": [0.5, -0.5], "limits": 0.3}
    told = _vehicle(SimpleNamespace(vehicle=vehicle_of({"name": "v", "fins": fins})))
    assert ("rudder limit", "0.300 rad") in told
    assert ("fins", "a = 1 rudder, within +/-0.3 rad, b = 1 rudder, within +/-0.3 rad") in told
    assert ("fins", "a = 1 elevator, within +/-0.3 rad, b = -1 elevator, within +/-0.3 rad") in told
