"""The drift law of a measured cross speed: what the runs were flown by comes back, and gives a fit its start values.

The truth here is the sway-yaw pair of Fossen 2011, section 7.1, written out and integrated finely.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fieldsid.effects import pick_effect
from fieldsid.fitting.fit import fit
from fieldsid.logs.run import Run
from fieldsid.models.axis import Axis
from fieldsid.models.helpers.drift_law import drift_law
from fieldsid.models.record import record_of

STEP_S, FINE = 0.1, 20
DAMPING, AUTHORITY, MOMENT = 0.9, -1.6, -0.35
DRIFT_S, PER_RATE, PER_FIN = 1.4, -1.1, 0.5
"""Of the truth at 1.5 m/s: a22, b2, yaw moment per m/s of sway; T v' + v = x r + y delta."""


def flown(seconds=60.0, speed=1.5, seed=1, *, sway_noise=0.01, noise=0.004, per_fin=PER_FIN, moment=MOMENT):
    """A run of the truth at a speed; drift and Munk moment are lift, and go with it."""
    rng = np.random.default_rng(seed)
    time = np.arange(0.0, seconds, STEP_S)
    fin = np.interp(time, np.arange(0.0, seconds + 4.0, 4.0), 0.25 * rng.uniform(-1.0, 1.0, int(seconds / 4) + 1))
    f, h = speed / 1.5, STEP_S / FINE

    def slope(state, fin):
        _, rate, sway = state
        turned = -DAMPING * f * rate + AUTHORITY * f * f * fin + moment * f * sway
        return np.array([rate, turned, (PER_RATE * rate + per_fin * f * fin - sway) * f / DRIFT_S])

    state, rows = np.zeros(3), np.empty((time.size, 3))
    for i in range(time.size):
        rows[i] = state
        # the log holds a command until its next sample
        for _ in range(FINE):
            state = state + h * slope(state + 0.5 * h * slope(state, fin[i]), fin[i])
    signals = {
        "rudder_rad": fin, "yaw_rad": rows[:, 0] + noise * rng.standard_normal(time.size),
        "yaw_rate_rad_s": rows[:, 1] + noise * rng.standard_normal(time.size),
        "sway_m_s": rows[:, 2] + sway_noise * rng.standard_normal(time.size), "surge_m_s": np.full(time.size, speed),
    }  # fmt: skip
    return Run(f"run {seed}", time, signals)


def records(*runs):
    return [record_of(run, Axis.YAW) for run in runs]


def test_the_drift_law_of_runs_at_two_speeds_is_the_one_they_were_flown_by():
    law = drift_law(records(flown(seed=1, sway_noise=0.002), flown(seed=2, speed=2.2, sway_noise=0.002)), 1.5)
    assert law.per_rate == pytest.approx(PER_RATE, rel=0.03)
    assert law.per_fin == pytest.approx(PER_FIN, rel=0.06)
    assert law.time_constant == pytest.approx(DRIFT_S, rel=0.04)


def test_port_for_starboard_leaves_the_drift_law():
    run = flown(seed=3)
    mirrored = Run(run.name, run.time, {n: v if n == "surge_m_s" else -v for n, v in run.signals.items()})
    one, other = drift_law(records(run), 1.5), drift_law(records(mirrored), 1.5)
    assert (one.per_rate, one.per_fin, one.time_constant) == pytest.approx((other.per_rate, other.per_fin, other.time_constant))


def test_only_what_was_measured_counts():
    whole, other = flown(seed=4), flown(seed=5)
    seldom = np.where(np.arange(whole.time.size) % 5 == 2, whole.signals["sway_m_s"], np.nan)
    sparse = replace(whole, signals={**whole.signals, "sway_m_s": seldom})
    blind = replace(other, signals={n: v for n, v in other.signals.items() if n != "sway_m_s"})
    alone, beside = drift_law(records(sparse), 1.5), drift_law(records(sparse, blind), 1.5)
    assert alone == beside
    assert alone.per_rate == pytest.approx(PER_RATE, rel=0.05)
    assert drift_law(records(blind), 1.5) is None
    for name in ("sway_coupling", "crossflow_drag"):
        assert pick_effect(name).initial_guesses(records(blind), []) == []


def test_the_starts_are_the_drift_laws_own():
    seen = records(flown(seed=6, sway_noise=0.002))
    for point, side in zip(pick_effect("sway_coupling").initial_guesses(seen, []), (-1.0, 1.0), strict=True):
        assert point["cross_damping"] == pytest.approx(1.0 / DRIFT_S, rel=0.1)
        assert np.sign(point["cross_rate"]) == side
    for point, length in zip(pick_effect("crossflow_drag").initial_guesses(seen, []), (0.8, 2.0, 5.0), strict=True):
        assert point["flow_rate"] == pytest.approx(-PER_RATE / DRIFT_S / length, rel=0.15)
        assert point["flow_fin"] == pytest.approx(PER_FIN / DRIFT_S / length, rel=0.25)


@pytest.mark.parametrize("moment", [MOMENT, 0.3], ids=["turns on", "turns back"])
def test_a_hull_that_drifts_is_fitted_by_its_state_whether_its_sway_is_measured_or_not(moment):
    runs = [flown(seed=s, per_fin=0.0, moment=moment) for s in (7, 8)]
    for columns in (None, "sway_m_s"):
        logs = [replace(r, signals={n: v for n, v in r.signals.items() if n != columns}) for r in runs]
        values = fit(records(*logs), Axis.YAW, method="output_error", effects=["sway_coupling"]).model.values
        assert values["cross_damping"] == pytest.approx(1.0 / DRIFT_S, rel=0.15)
        assert values["cross_rate"] == pytest.approx(-moment * PER_RATE / DRIFT_S, rel=0.15)
