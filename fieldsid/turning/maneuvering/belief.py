"""Turns predicted by the posterior of all runs: median and band of the settled circle, and the transient.

The band contains the spread of the posterior and the model error of the equations, as found with such data on hulls of the
ensemble and on the field vehicle (`FORM_LOG_SD`, `UNSEEN_LOG_SD`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from hashlib import sha256
from typing import TypeVar

import numpy as np

from fieldsid.dynamics.free_run import effects_of
from fieldsid.errors import ModelError
from fieldsid.logs.run import Note, Run
from fieldsid.models.axis import NAMES
from fieldsid.models.model import Model
from fieldsid.numerics.arrays import FloatArray
from fieldsid.numerics.block_means import block_means, block_width
from fieldsid.plant.yaw_plant import LEAST_SURGE_M_S, STEP_S, steady_fins
from fieldsid.turning.maneuvering.equations import coefficients, longest_step, simulate
from fieldsid.turning.maneuvering.fit import Fitted, fit_maneuvering
from fieldsid.turning.maneuvering.flown import HEADING, OWN_EFFECTS, SURGE, SWAY, FlownRun, nearest_model, usable_runs
from fieldsid.turning.maneuvering.posterior import Posterior, draw_posterior, effective_draws, settled_turns, weighted_quantile
from fieldsid.turning.maneuvering.prior import FARTHEST_COST
from fieldsid.turning.model_error import STALL_LOG_SD
from fieldsid.turning.steady.transient import MAX_TRANSIENT_S, Transient, read_off

T = TypeVar("T")
SEED = 20240511
FORM_LOG_SD = 0.025
"""Log error of the equations for a turn that was flown: 0.4 % on the ensemble (seed 1), 0.5 to 4 % on a vehicle outside it."""
UNSEEN_LOG_SD = 0.16
"""Additional log error, times the share of the curvature that was not flown: 10 % on the ensemble (seed 1) with pulses only."""
TRACK_STEPS = round(MAX_TRANSIENT_S / STEP_S)
"""Time steps of a simulated turn through 180 deg: four minutes for a vehicle, 200 lengths for a ship."""


@dataclass(frozen=True, slots=True)
class BelievedTurn:
    """One turn: radius (m) with its 95 % band, rate (rad/s, magnitude), path speed (m/s).

    `curvature_covered` and `fin_covered` are the largest values in the runs over those of the turn, at most one. `unsettled` is
    the share of draws without a settled turn, `effective` the effective number of independent draws, `transient` that of the
    maximum a posteriori.
    """

    radius: float
    interval95: tuple[float, float]
    rate: float
    path_speed: float
    curvature_covered: float
    fin_covered: float
    unsettled: float
    effective: float
    transient: Transient


@dataclass(frozen=True, slots=True)
class Belief:
    """The posterior of a vehicle's coefficients, and the models that give the steady fin angle."""

    fitted: Fitted
    posterior: Posterior
    models: tuple[Model, ...]

    @property
    def runs(self) -> tuple[FlownRun, ...]:
        """The runs of the fit."""
        return self.fitted.runs

    def turn(self, entry: float, rudder: float, side: float, of_models: float = math.nan) -> BelievedTurn:
        """Return the turn to starboard (side +1) or port (-1) from a straight run at `entry` m/s at `rudder` rad.

        `of_models` is the radius (m) by the identified models, NaN where they have none. Where the fit lies far from the prior
        the equations may not describe the vehicle, and the logarithm of the ratio of both radii is added to the model error.
        """
        fin = _steady_fin(self.models, entry, rudder, side)
        path, rate = settled_turns(self.posterior, entry, fin)
        radius = path / np.abs(rate)
        ok = np.isfinite(radius) & (side * rate > 0.0)
        log_radius = np.log(np.where(ok, radius, np.nan))
        middle = float(np.exp(_median(log_radius)))
        covered = min(self.largest_curvature * middle, 1.0) if np.isfinite(middle) else 0.0
        fin_covered = min(max(float(np.max(np.abs(r.fin))) for r in self.runs) / max(abs(fin), 1e-9), 1.0)
        effective = effective_draws(np.where(ok, log_radius, _median(log_radius)).reshape(self.posterior.chains.shape[:2]))
        model_error = FORM_LOG_SD + UNSEEN_LOG_SD * (1.0 - covered) + STALL_LOG_SD * (1.0 - fin_covered)
        if not self.fitted.is_usual and np.isfinite(of_models):
            model_error += abs(math.log(middle / of_models))
        sampling_error = float(np.std(log_radius[ok])) / np.sqrt(max(effective, 1.0)) if ok.any() else 0.0
        low, high = _band(log_radius[ok], float(np.hypot(model_error, sampling_error)))
        medians = _median(np.abs(rate[ok])), _median(path[ok])
        transient = self._transient(entry, fin, side)
        return BelievedTurn(middle, (low, high), *medians, covered, fin_covered, float(1.0 - ok.mean()), effective, transient)

    @property
    def largest_curvature(self) -> float:
        """The largest curvature in a run's means over one second, 1/m."""
        largest = 0.0
        for run in self.runs:
            ok = np.isfinite(run.rate)
            # without a measured surge, that of the straight part is an upper bound, and so the curvature a lower one
            surge = np.where(np.isfinite(run.measured[SURGE]), run.measured[SURGE], run.speed)
            rates, speeds = (block_means(of[ok], block_width(np.diff(run.time), 1.0)) for of in (run.rate, surge))
            largest = max(largest, float(np.max(np.abs(rates) / np.maximum(speeds, LEAST_SURGE_M_S), initial=0.0)))
        return largest

    def _transient(self, entry: float, fin: float, side: float) -> Transient:
        best = coefficients(self.fitted.vector)
        step = longest_step(float(best[0]), entry)
        time = step * np.arange(TRACK_STEPS, dtype=np.float64)
        time.setflags(write=False)  # like that of a run: the same compiled kernel then serves both
        path = np.full((time.size - 1, 2), fin)
        path[0, 0] = 0.0
        first = np.array([[entry, 0.0, 0.0]])
        motion = simulate(best, entry, first, np.zeros(1, dtype=np.int64), time, path, np.ones(time.size), step)
        u, v, heading = motion[SURGE], motion[SWAY], motion[HEADING]
        along, across = u * np.cos(heading) - v * np.sin(heading), u * np.sin(heading) + v * np.cos(heading)
        travelled = np.cumsum(np.stack([along, across, np.hypot(u, v)]), axis=1) * step
        track = np.concatenate([heading[None], travelled - travelled[:, :1]]).T[:, :, None]
        return read_off(time, track, side)


def believe(runs: Sequence[Run], models: Sequence[Model], length: float | None, seed: int = SEED) -> Belief | None:
    """Return the posterior of a vehicle from its runs; None where these lack fin, yaw or speed.

    `length` is the vehicle's in m where it is known. Raises ModelError where the fit or its posterior has no finite solution.
    """
    fitted = fitted_to(runs, models, length, seed)
    if fitted is None:
        return None
    inputs = _Inputs(usable_runs(runs, models), length, seed)
    return Belief(fitted, _finite(lambda: _drawn(inputs), inputs.flown), tuple(models))


def fitted_to(runs: Sequence[Run], models: Sequence[Model], length: float | None, seed: int = SEED) -> Fitted | None:
    """Return the fit of `believe` without the draws of its posterior, which take longer; None and errors as there."""
    flown = usable_runs(runs, models)
    return _finite(lambda: _fitted(_Inputs(flown, length, seed)), flown) if flown else None


def _finite(compute: Callable[[], T], flown: Sequence[FlownRun]) -> T:
    """Return the result of a computation on some runs; raises ModelError where it raises LinAlgError."""
    try:
        return compute()
    except np.linalg.LinAlgError as error:
        raise ModelError(
            "surge, sway and yaw cannot be fitted to all runs at once",
            found=f"{error} ({', '.join(r.name for r in flown)})",
            hint="look at these runs with `sysid inspect`, and leave out what no vehicle does",
        ) from error


def not_fitted(error: ModelError, runs: Sequence[Run]) -> Note:
    """Return the note for a fit to all runs that failed, so that the model of each speed is used."""
    words = f"{error.what}: {error.found}; each speed's own model is taken instead: {error.hint}"
    return Note("maneuvering_not_fitted", words, {"runs": [run.name for run in runs]})


def like_no_vehicle(fitted: Fitted, length: float | None) -> Note:
    """Return the note for a fit whose prior cost exceeds FARTHEST_COST, so that the model of each speed is used."""
    prior_cost, runs = fitted.prior.cost(fitted.vector), [run.name for run in fitted.runs]
    hint = "" if length is not None else "state `length_m` in vehicle.yaml, "
    words = (
        "what all runs together make of surge, sway and yaw lies where no vehicle does: "
        f"{prior_cost:.0f} from the vehicles known, limit {FARTHEST_COST:.0f} ({', '.join(runs)}); "
        f"each speed's own model is taken instead: {hint}look at the runs with `sysid inspect`, or fly a zig-zag"
    )
    return Note("like_no_vehicle", words, {"runs": runs, "value": prior_cost, "limit": FARTHEST_COST})


class _Inputs:
    """The inputs of a fit, hashable by their content for a cache: runs, length (m) and the seed of the draws."""

    def __init__(self, flown: tuple[FlownRun, ...], length: float | None, seed: int) -> None:
        self.flown, self.length, self.seed = flown, length, seed
        digest = sha256(repr((length, seed)).encode())
        for run in flown:
            digest.update(repr((run.name, run.time.size, run.speed, run.speed_sd, run.rate_bias_sd)).encode())
            for values in (run.time, run.fin, run.thrust, run.measured, run.discrepancy):
                digest.update(np.ascontiguousarray(values).tobytes())
        self.digest = digest.digest()

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Inputs) and self.digest == other.digest

    def __hash__(self) -> int:
        return hash(self.digest)


@lru_cache(maxsize=4)
def _fitted(inputs: _Inputs) -> Fitted:
    """Return the fit, cached: turns, gains and their verification use the same runs."""
    return fit_maneuvering(inputs.flown, inputs.length)


@lru_cache(maxsize=4)
def _drawn(inputs: _Inputs) -> Posterior:
    """Return the draws of the posterior, cached like the fit."""
    return draw_posterior(_fitted(inputs), np.random.default_rng(inputs.seed))


def _steady_fin(models: Sequence[Model], speed: float, rudder: float, side: float) -> float:
    """Return the steady fin angle (rad, positive turns to port as in the equations) for a rudder command toward `side`."""
    if not models:
        return -side * rudder
    near = nearest_model(models, speed)
    sign = float(np.sign(near.base[NAMES[near.axis].authority])) or 1.0
    acting = [e for e in effects_of(near) if e.name not in OWN_EFFECTS]
    values = {c.name: c.start for e in acting for c in e.nuisance} | dict(near.values)
    return -sign * float(steady_fins(near, acting, [values], side * sign * rudder, np.array([speed]))[0, 0])


def _median(values: FloatArray) -> float:
    """Return the median of the finite values, NaN where there are none."""
    finite = values[np.isfinite(values)]
    return float(np.median(finite)) if finite.size else float("nan")


def _band(log_radius: FloatArray, spread: float) -> tuple[float, float]:
    """Return the 95 % band of the radius (m): draws (n,) of its logarithm, convolved with a normal error of sd `spread`."""
    nodes, node_weights = np.polynomial.hermite_e.hermegauss(15)
    values = (log_radius[:, None] + spread * nodes[None, :]).ravel()
    weights = np.broadcast_to(node_weights, (log_radius.size, node_weights.size)).ravel()
    return float(np.exp(weighted_quantile(values, weights, 0.025))), float(np.exp(weighted_quantile(values, weights, 0.975)))
