"""What a fit says first: of the noise of its residuals, and of a coefficient on its bound."""

from __future__ import annotations

import numpy as np
import pytest
from truth import maneuvers
from truth.logbook import flown
from truth.noise import Clock
from truth.paper import DEG, YAW, physics_of
from truth.pilots import Autopilot
from truth.vehicle import Fins, Sea, fly_vehicle

from fieldsid.fitting.fit import Fit
from fieldsid.fitting.fit import fit as fitted_alone
from fieldsid.fitting.identify import identify
from fieldsid.logs.run import Run
from fieldsid.models.axis import Axis
from fieldsid.models.record import record_of

CLOCK = Clock(0.05, 660)


def _message(fit: Fit, code: str) -> str:
    (said,) = (n.message for n in fit.notes if n.code == code)
    return said


@pytest.mark.parametrize("gap", [0.03, 0.06])
def test_of_a_missing_effect_no_noise_is_called_the_explanation(gap):
    plan = maneuvers.pulses(CLOCK.time, 0.26, 0.15, start=2.0, recovery=9.0)
    log = flown(physics_of(YAW[1])._replace(backlash_gap=gap), CLOCK, plan, angle_noise=0.1 * DEG, rate_noise=0.1 * DEG, seed=1)
    run = Run("slack", log.pop("time_s"), log)
    said = _message(identify([run], Axis.YAW, whole=True, method="output_error")[0], "coloured_residuals")
    assert "explain" not in said
    assert "of the noises compared" in said
    assert "an effect that the model lacks leaves such residuals too: `sysid diagnose`" in said


def test_a_model_that_is_unstable_within_its_error_says_nothing_sure_of_the_vehicle():
    fly = fly_vehicle(Autopilot(heading=0.0), 60.0, sea=Sea(gust=(0.0, 8.0)), fins=Fins(limit=24.0 * DEG), seed=2)
    log = dict(fly.log)
    held = record_of(Run("held", log.pop("time_s"), log), Axis.YAW)  # `identify` refuses it: feedback alone moves its fin
    fit = fitted_alone([held], Axis.YAW, method="output_error")
    assert -2.0 * fit.model.std_error("a22") < fit.model.values["a22"] < 0.0
    said = _message(fit, "unstable")
    assert "leaves open whether the vehicle does" in said
    assert "the vehicle turns by itself" not in said


def test_remarks_of_several_runs_name_the_speed_of_what_they_speak_of():
    plan = maneuvers.pulses(CLOCK.time, 0.26, 0.15, start=2.0, recovery=9.0)
    runs = []
    for row in (YAW[0], YAW[4]):
        log = flown(physics_of(row)._replace(delay=0.1), CLOCK, plan, angle_noise=0.1 * DEG, rate_noise=0.1 * DEG, seed=1)
        runs.append(Run(f"v{row.speed}", log.pop("time_s"), {**log, "surge_m_s": np.full(CLOCK.samples, row.speed)}))
    (joint,) = identify(runs, Axis.YAW, whole=True, joint=True, method="output_error")
    assert f"it moves a22@{joint.model.law.reference:.3g} from" in _message(joint, "ignored_delay")
    (alone,) = identify(runs[:1], Axis.YAW, whole=True, method="output_error")
    assert "it moves a22 from" in _message(alone, "ignored_delay")


@pytest.mark.parametrize("method", ["output_error", "svf_ls"])
def test_the_trim_of_a_pitch_without_an_angle_is_said_to_be_unknown(method):
    rng, time, step = np.random.default_rng(4), np.arange(0.0, 60.0, 0.05), 0.05
    fin, pitch, rate = 0.1 * np.sign(np.sin(0.9 * time + 0.05 * time**1.3)), np.full(time.size, 0.08), np.zeros(time.size)
    for i in range(time.size - 1):
        rate[i + 1] = rate[i] + step * (-0.9 * rate[i] - 0.5 * pitch[i] - 1.2 * fin[i] + 0.04)
        pitch[i + 1] = pitch[i] + step * rate[i + 1]
    noisy = {"pitch_rad": pitch, "pitch_rate_rad_s": rate + 0.003 * rng.standard_normal(time.size), "elevator_rad": fin}
    alone = {n: v for n, v in noisy.items() if n != "pitch_rad"}
    (known,), (unknown,) = (identify([Run("nod", time, log)], Axis.PITCH, whole=True, method=method) for log in (noisy, alone))
    assert "trim_not_identifiable" not in {n.code for n in known.notes}
    assert "no angle was logged" in _message(unknown, "trim_not_identifiable")


def test_a_plain_number_on_its_bound_has_a_meaning_and_no_unit():
    rng, n, step = np.random.default_rng(2), 800, 0.05
    time = np.arange(n) * step
    speed, fin = 1.4 + 0.4 * np.sin(0.3 * time), 0.15 * np.sign(np.sin(0.7 * time + 0.1))
    rate = np.zeros(n)
    for i in range(n - 1):
        rate[i + 1] = rate[i] + step * (speed[i] / 1.4) ** 4 * (-1.1 * rate[i] - 1.2 * fin[i])
    yaw = np.concatenate([[0.0], np.cumsum(step * rate[1:])])
    noise = 0.003 * rng.standard_normal((2, n))
    log = {"yaw_rad": yaw + noise[0], "yaw_rate_rad_s": rate + noise[1], "rudder_rad": fin, "surge_m_s": speed}
    (fit,) = identify([Run("surging", time, log)], Axis.YAW, whole=True, method="output_error", effects=["speed_varying"])
    assert _message(fit, "on_bound").startswith(
        "speed_share = 1.5 (1 is lift theory, b ~ u^2 and a ~ u; 0 is no change) is on its bound [0, 1.5]"
    )
