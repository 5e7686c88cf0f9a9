"""Records of every kind, made by hand of round numbers, so that what they say does not hang on the last bit of a fit."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from fieldsid.change.compare import compare_models
from fieldsid.comparison.compare import compare
from fieldsid.diagnosis import Candidate, Diagnosis, Errors, Pair
from fieldsid.diagnosis.records import NextManeuver
from fieldsid.extension.extend import Extension, Gain
from fieldsid.fitting.fit import Fit
from fieldsid.fitting.predict.predict import Prediction
from fieldsid.fitting.problem.estimator import History
from fieldsid.logs import Note, Run
from fieldsid.models.axis import Axis
from fieldsid.models.model import Model, Noise
from fieldsid.models.record import record_of
from fieldsid.models.speed_law import SpeedLaw
from fieldsid.plant.parameter_source import source_of_models
from fieldsid.schedule.make import design_schedule
from fieldsid.schedule.verify import verify_schedule
from fieldsid.turning.measured.measured_turn import measure_turn
from fieldsid.turning.radius import turn_radius

UNITS = {"a22": "1/s", "b2": "1/s^2", "C0": "rad/s^2", "lag": "s"}
NOISE = Noise(0.005, 0.004)


def run_named(name, *, seconds=20.0, speed=1.4, source=None, notes=()):
    """A sine of the rudder and what the heading makes of it, sampled at 20 Hz."""
    time = np.arange(0.0, seconds, 0.05)
    signals = {
        "yaw_rad": 0.2 * np.sin(0.5 * time),
        "yaw_rate_rad_s": 0.1 * np.cos(0.5 * time),
        "rudder_rad": 0.25 * np.sign(np.sin(0.5 * time)),
        "surge_m_s": np.full(time.size, speed),
    }
    return Run(name, time, signals, source, tuple(notes))


def model_named(*runs, speed=1.4, effects=(), values=None):
    known = values or {"a22": 1.1, "b2": -1.2, "C0": 0.02}
    sigma = np.array([0.013, 0.021, 0.0004, *([0.01] * (len(known) - 3))])
    covariance = np.diag(sigma**2)
    covariance[0, 1] = covariance[1, 0] = -0.7 * sigma[0] * sigma[1]
    return Model(
        Axis.YAW, effects, known, {n: UNITS[n] for n in known}, tuple(known), covariance, SpeedLaw(speed), NOISE,
        {"speed_low": speed, "speed_high": speed, "fin_max": 0.25, "rate_max": 0.1, "held_s": 2.0}, "output_error", runs,
        {"whiteness_p": 0.41},
    )  # fmt: skip


def fit_of(*runs, notes=(), history=None):
    """A fit whose free runs miss the angle by 0.012 rad and the rate by 0.006 rad/s throughout."""
    records = [record_of(run, Axis.YAW) for run in runs]
    shown = tuple(Prediction(r, r.angle - 0.012, r.rate - 0.006, r.fin, (0.0, 0.0, 0.0), {}) for r in records)
    model = model_named(*(run.name for run in runs))
    sigma = np.sqrt(np.diag(model.covariance))
    return Fit(model, shown, NOISE, model.covariance / np.outer(sigma, sigma), tuple(notes), history)


def pair(train, unseen):
    return Pair(Errors(train, 0.8 * train), Errors(unseen, 0.8 * unseen))


@pytest.fixture(scope="session")
def made():
    """The makers, for tests that need records of their own."""
    return SimpleNamespace(run=run_named, model=model_named, fit=fit_of)


@pytest.fixture(scope="session")
def held():
    """One record of every kind that a user can hold, by the name of its class."""
    warning = Note("correlated", "a22 and b2 cannot be told apart (correlation -0.970, limit 0.95)", {"correlation": -0.97})
    told = Note("noise_model", "white noise")
    run = run_named("pulses", source=Path("runs/pulses.parquet"), notes=[Note("unit", "yaw: degrees as its name says")])
    history = History(run.time, ("a22",), np.ones((400, 1)), np.ones((400, 1)), {"a22": 4.0})
    fit = fit_of(run, run_named("zigzag", speed=1.4), notes=[warning, told], history=history)
    lagged = model_named("pulses", effects=("servo_lag",), values={"a22": 1.3, "b2": -1.5, "C0": 0.02, "lag": 0.2})
    (comparison,) = compare(fit.model, [run])
    best = Candidate(
        ("servo_lag",),
        0.97,
        {"a22": 1.3, "lag": 0.2},
        pair(0.005, 0.0052),
        0.98,
        120.4,
        "from 3.2 to 1.0",
        ("delay",),
    )
    diagnosis = Diagnosis(
        Axis.YAW, "effect", ("servo_lag",), "servo_lag (the fin follows late): from 3.20 to 1.04 x the noise floor",
        "servo_lag: from 3.20 to 1.04 x the noise floor",
        pair(0.015, 0.016), pair(0.005, 0.0052), NOISE, (best,), lagged, fit.model, comparison.where,
        NextManeuver("zigzag", "it tells the two apart"), {"roll_coupling": "needs roll, which the log lacks"}, (told,),
    )  # fmt: skip
    gain = Gain(("servo_lag",), pair(0.015, 0.016), pair(0.005, 0.0052), NOISE, True, ("pulses",), ("zigzag",))
    slow, fast = model_named("slow", speed=1.0), model_named("fast", speed=1.4)
    fast = replace(fast, values={"a22": 1.5, "b2": -2.35, "C0": 0.03})
    source = source_of_models([slow, fast], ["slow", "fast"])
    turned = circle_run()
    turns = turn_radius(source, [1.0, 1.4], 0.3, measured=[turned], draws=20)
    schedule = design_schedule(source, 0.3)
    verification = verify_schedule(schedule, source, draws=3)
    weaker = replace(model_named("after", speed=1.0), values={"a22": 1.1, "b2": -1.0, "C0": 0.02})
    change = compare_models(source_of_models([slow], ["slow"]), source_of_models([weaker], ["after"]), fin_limit=0.3)
    records = (
        change, run, fit, fit.model,
        comparison, diagnosis, best, Extension(lagged, gain, 115.3), turns, turns.rows[0], turns.measured[0],
        measure_turn(turned), source.laws, schedule, schedule.rows[0], verification, verification.scheduled[0],
    )  # fmt: skip
    return {type(record).__name__: record for record in records}


def circle_run():
    """Straight on for ten seconds, then a circle of 4 m to starboard."""
    time = np.arange(0.0, 60.0, 0.1)
    rate = np.where(time < 10.0, 0.0, 0.3)
    yaw = np.concatenate([[0.0], np.cumsum(0.1 * rate[1:])])
    x, y = (np.concatenate([[0.0], np.cumsum(0.12 * part(yaw)[1:])]) for part in (np.cos, np.sin))
    fin = np.where(time < 10.0, 0.0, -0.3)
    signals = {
        "yaw_rad": yaw,
        "yaw_rate_rad_s": rate,
        "rudder_rad": fin,
        "x_m": x,
        "y_m": y,
        "surge_m_s": np.full(time.size, 1.2),
    }
    return Run("circle", time, signals)
