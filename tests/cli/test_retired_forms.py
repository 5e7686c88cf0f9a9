"""A model file of 0.1.0 whose form took a measured cross speed as an input: every command says to identify again."""

from __future__ import annotations

import numpy as np
import pytest

from fieldsid.models.axis import Axis
from fieldsid.models.model import Model, Noise, save_model
from fieldsid.models.speed_law import SpeedLaw

DRIFT = {"drift_damping": 0.7, "drift_per_rate": -1.1, "drift_per_fin": 0.5, "drift_speed": 1.5}


@pytest.mark.parametrize(
    ("effect", "values"),
    [
        ("sway_coupling", {"cross_moment": -0.3} | DRIFT),
        ("sway_coupling", {"munk_moment": -0.2} | DRIFT),
        ("crossflow_drag", {"length": 1.8, "crossflow": 2.0}),
    ],
)
def test_a_form_that_took_a_measured_cross_speed_is_refused_with_what_helps(run_cli, tmp_path, effect, values):
    held = {"a22": 1.2, "b2": -1.5, "C0": 0.0} | values
    model = Model(
        Axis.YAW, (effect,), held, dict.fromkeys(held, "1"), ("a22",), np.ones((1, 1)), SpeedLaw(1.5), Noise(0.01, 0.01)
    )
    path = save_model(model, tmp_path / "old.yaml")
    result = run_cli("turn-radius", str(path))
    assert result.code == 2
    assert f"old.yaml`: the model holds `{effect}` in a form that is no longer known: with `{next(iter(values))}`" in result.err
    assert f"identify again: `sysid identify RUN... --axis yaw --effects {effect}`" in result.err
