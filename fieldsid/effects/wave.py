"""A regular wave shakes the hull: moment = amplitude sin(2 pi (t - t_first) / period + phase).

period (s) and amplitude (rad/s^2, >= 0) are common to all runs, phase (rad) is estimated for each run. In one variant there is a
second component of another period, whose amplitude and phase are estimated for each run. In the other the frequency changes
linearly over a run, f(t) = (1 + sweep (t - t_middle)) / period, as it does where speed or course change.
Source: Fossen 2011, section 8.2 (first-order wave moment, one or more components; frequency of encounter).
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from fieldsid.models.axis import Axis
from fieldsid.models.effect import Coefficient, Effect, Stage, Terms, Values, Variant
from fieldsid.models.record import Record
from fieldsid.numerics.arrays import FloatArray

SHORTEST_S, LONGEST_S, TRIED, PEAKS = 1.0, 30.0, 60, 2


def terms(values: Values, record: Record) -> Terms:
    """Return the wave's moment, (n,) rad/s^2."""
    since = record.time - record.time[0]
    shifted = since + 0.5 * values.get("sweep", 0.0) * since * (since - since[-1])
    moment = values["amplitude"] * np.sin(2.0 * math.pi * shifted / values["period"] + values["phase"])
    if "second_period" in values:
        angle = 2.0 * math.pi * since / values["second_period"]
        moment = moment + values["second_sin"] * np.sin(angle) + values["second_cos"] * np.cos(angle)
    return Terms(moment=moment)


def slope(name: str, values: Values, record: Record) -> FloatArray:
    """Return the derivative of the wave's moment by one of its coefficients, (n,)."""
    since, turns = record.time - record.time[0], 2.0 * math.pi
    if name.startswith("second_"):
        angle = turns * since / values["second_period"]
        match name:
            case "second_sin":
                return np.asarray(np.sin(angle))
            case "second_cos":
                return np.asarray(np.cos(angle))
        swing = values["second_sin"] * np.cos(angle) - values["second_cos"] * np.sin(angle)
        return np.asarray(-swing * angle / values["second_period"])
    by_sweep = 0.5 * since * (since - since[-1])
    shifted = turns * (since + values.get("sweep", 0.0) * by_sweep) / values["period"]
    if name == "amplitude":
        return np.asarray(np.sin(shifted + values["phase"]))
    by_angle = values["amplitude"] * np.cos(shifted + values["phase"])
    of_angle = {"phase": 1.0, "period": -shifted / values["period"], "sweep": turns * by_sweep / values["period"]}
    return np.asarray(by_angle * of_angle[name])


def initial_guesses(records: Sequence[Record], residuals: Sequence[FloatArray]) -> list[dict[str, float]]:
    """Return a wave at each period at which the residuals have a spectral peak."""
    return [{"period": period, "amplitude": 0.02} for period in spectral_peaks(records, residuals)]


def suggest_second(records: Sequence[Record], residuals: Sequence[FloatArray]) -> list[dict[str, float]]:
    """Return a second component at each period at which the residuals of the first have a spectral peak."""
    return [{"second_period": period} for period in spectral_peaks(records, residuals)]


def spectral_peaks(records: Sequence[Record], residuals: Sequence[FloatArray]) -> list[float]:
    """Return the periods (s) of the highest peaks in the summed periodogram of all runs' rate residuals (Lomb-Scargle)."""
    periods = np.geomspace(SHORTEST_S, LONGEST_S, TRIED)
    power = np.zeros(periods.size)
    for record, residual in zip(records, residuals, strict=True):
        channel, ok = (1, record.rate_ok) if record.rate_ok.any() else (0, record.angle_ok)
        time, e = record.time[ok] - record.time[0], residual[channel][ok]
        turn = 2.0 * math.pi * time / periods[:, None]
        e = e - e.mean()
        power += (np.sin(turn) @ e) ** 2 / e.size + (np.cos(turn) @ e) ** 2 / e.size
    peaks = [i for i in range(periods.size) if power[i] == power[max(0, i - 3) : i + 4].max()]
    best = sorted(peaks, key=lambda i: -power[i])[:PEAKS]
    return [float(periods[i]) for i in best]


SECOND = "rad/s^2", -2.0, 2.0, 0.0
FORMS = (
    Variant(
        "a second component of another period joins it",
        (
            Coefficient("second_period", "s", 1.0, 30.0, 4.0, step=1e-3, says="period of the second component"),
            Coefficient("second_sin", *SECOND, per_run=True, says="its sine part at the run's first sample"),
            Coefficient("second_cos", *SECOND, per_run=True, says="its cosine part at the run's first sample"),
        ),
        suggest_second,
    ),
    Variant(
        "its frequency shifts over a run",
        (
            Coefficient(
                "sweep",
                "1/s",
                -0.05,
                0.05,
                0.0,
                scan=(-0.01, -0.003, 0.003, 0.01),
                step=1e-5,
                says="share of the frequency it shifts by in a second",
            ),
        ),
    ),
)

EFFECT = Effect(
    name="wave",
    says="a regular wave shakes the hull at one period",
    stage=Stage.HYDRODYNAMICS,
    axes=(Axis.YAW, Axis.PITCH),
    equation="moment = amplitude * sin(2 pi * (t - t_first) / period + phase)",
    coefficients=(
        Coefficient(
            "period",
            "s",
            1.0,
            30.0,
            6.0,
            step=1e-3,
            says="period at which the hull meets the wave",
        ),
        Coefficient("amplitude", "rad/s^2", 0.0, 2.0, 0.02, says="largest moment of the wave"),
        Coefficient(
            "phase",
            "rad",
            -4.0 * math.pi,
            4.0 * math.pi,
            0.0,
            scan=(-0.75 * math.pi, -0.25 * math.pi, 0.25 * math.pi, 0.75 * math.pi),
            step=1e-3,
            per_run=True,
            says="phase at the run's first sample",
        ),
    ),
    telltale="the residual swings at one period in every part of the run, with the fin still as well",
    excited_by=("square_pulses", "doublet", "multisine"),
    mistaken_for=("trim_drift", "roll_coupling", "depth_buoyancy", "step_change"),
    source="Fossen 2011, section 8.2",
    terms=terms,
    slope=slope,
    initial_guesses=initial_guesses,
    variants=FORMS,
)
