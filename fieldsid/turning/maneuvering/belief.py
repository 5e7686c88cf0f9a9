"""The turns that all runs together make believe in: median and band of the settled circle, and the way into it.

The equations are not the vehicle: beyond the posterior's own spread the radius is spread by what equations with such data were
off by on hulls of the ensemble and on the field vehicle (`FORM_LOG_SD`, `UNSEEN_LOG_SD`).
"""

from __future__ import annotations

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
from fieldsid.plant.yaw_plant import steady_fins
from fieldsid.turning.maneuvering.equations import coefficients, longest_step, simulate
from fieldsid.turning.maneuvering.fit import Fitted, fit_maneuvering
from fieldsid.turning.maneuvering.flown import HEADING, OWN_EFFECTS, SURGE, SWAY, FlownRun, nearest_model, usable_runs
from fieldsid.turning.maneuvering.posterior import Posterior, draw_posterior, effective_draws, settled_turns, weighted_quantile
from fieldsid.turning.maneuvering.prior import FARTHEST_COST
from fieldsid.turning.model_error import STALL_LOG_SD
from fieldsid.turning.steady.transient import LEAST_SURGE_M_S, Transient, read_off

T = TypeVar("T")
SEED = 20240511
FORM_LOG_SD = 0.025
"""Log error of the equations where the turn was flown: 0.4 % on the ensemble (seed 1), 0.5 to 4 % on a vehicle outside it."""
UNSEEN_LOG_SD = 0.16
"""More for each share of the turn's curvature that was not flown: with pulses alone the ensemble (seed 1) was off by 10 %."""
TRACK_STEPS = 4800
"""Of a turn through 180 deg: four minutes of a vehicle, 200 lengths of a ship."""


@dataclass(frozen=True, slots=True)
class BelievedTurn:
    """One turn: radius (m) with its 95 % band, rate (rad/s, magnitude), path speed (m/s).

    `curvature_covered` and `fin_covered` are what was flown over what the turn has, at most one, `unsettled` is the share of
    the draws that have no settled turn there, `effective` how many independent draws they are worth, `transient` that of the
    likeliest vector.
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
    """The posterior of a vehicle's coefficients, and how its fin goes."""

    fitted: Fitted
    posterior: Posterior
    models: tuple[Model, ...]

    @property
    def runs(self) -> tuple[FlownRun, ...]:
        """The runs it rests on."""
        return self.fitted.runs

    def turn(self, entry: float, rudder: float, side: float) -> BelievedTurn:
        """Return the turn to starboard (side +1) or port (-1) from a straight run at `entry` m/s at `rudder` rad."""
        fin = _fin(self.models, entry, rudder, side)
        path, rate = settled_turns(self.posterior, entry, fin)
        radius = path / np.abs(rate)
        ok = np.isfinite(radius) & (side * rate > 0.0)
        log_radius = np.log(np.where(ok, radius, np.nan))
        middle = float(np.exp(_median(log_radius)))
        covered = min(self.largest_curvature * middle, 1.0) if np.isfinite(middle) else 0.0
        fin_covered = min(max(float(np.max(np.abs(r.fin))) for r in self.runs) / max(abs(fin), 1e-9), 1.0)
        effective = effective_draws(np.where(ok, log_radius, _median(log_radius)).reshape(self.posterior.chains.shape[:2]))
        form = FORM_LOG_SD + UNSEEN_LOG_SD * (1.0 - covered) + STALL_LOG_SD * (1.0 - fin_covered)
        drawn = float(np.std(log_radius[ok])) / np.sqrt(max(effective, 1.0)) if ok.any() else 0.0
        low, high = _band(log_radius[ok], float(np.hypot(form, drawn)))
        states = _median(np.abs(rate[ok])), _median(path[ok])
        way = self._transient(entry, fin, side)
        return BelievedTurn(middle, (low, high), *states, covered, fin_covered, float(1.0 - ok.mean()), effective, way)

    @property
    def largest_curvature(self) -> float:
        """The largest curvature that a run held for a moment, 1/m."""
        largest = 0.0
        for run in self.runs:
            ok = np.isfinite(run.rate)
            # where nothing measures the surge it is at most that of the straight part: the curvature is at least this
            surge = np.where(np.isfinite(run.measured[SURGE]), run.measured[SURGE], run.speed)
            rates, speeds = (block_means(of[ok], block_width(np.diff(run.time), 1.0)) for of in (run.rate, surge))
            largest = max(largest, float(np.max(np.abs(rates) / np.maximum(speeds, LEAST_SURGE_M_S), initial=0.0)))
        return largest

    def _transient(self, entry: float, fin: float, side: float) -> Transient:
        best = coefficients(self.fitted.vector)
        step = longest_step(float(best[0]), entry)
        time = step * np.arange(TRACK_STEPS, dtype=np.float64)
        time.setflags(write=False)  # as that of a run is: what is compiled for one serves the other
        path = np.full((time.size - 1, 2), fin)
        path[0, 0] = 0.0
        first = np.array([[entry, 0.0, 0.0]])
        motion = simulate(best, entry, first, np.zeros(1, dtype=np.int64), time, path, np.ones(time.size), step)
        u, v, heading = motion[SURGE], motion[SWAY], motion[HEADING]
        along, across = u * np.cos(heading) - v * np.sin(heading), u * np.sin(heading) + v * np.cos(heading)
        whole = np.cumsum(np.stack([along, across, np.hypot(u, v)]), axis=1) * step
        track = np.concatenate([heading[None], whole - whole[:, :1]]).T[:, :, None]
        return read_off(time, track, side)


def believe(runs: Sequence[Run], models: Sequence[Model], length: float | None, seed: int = SEED) -> Belief | None:
    """Return what runs make believe of a vehicle, its length in m where known; None where they lack fin, yaw or speed.

    Raises ModelError where the fit or its posterior has no finite solution.
    """
    fitted = fitted_to(runs, models, length, seed)
    if fitted is None:
        return None
    known = _Known(usable_runs(runs, models), length, seed)
    return Belief(fitted, _finite(lambda: _drawn(known), known.flown), tuple(models))


def fitted_to(runs: Sequence[Run], models: Sequence[Model], length: float | None, seed: int = SEED) -> Fitted | None:
    """Return the fit that a belief rests on, without its draws, which take longer; None and errors as `believe`."""
    flown = usable_runs(runs, models)
    return _finite(lambda: _fitted(_Known(flown, length, seed)), flown) if flown else None


def _finite(of: Callable[[], T], flown: Sequence[FlownRun]) -> T:
    """Return what a function of some runs finds; raises ModelError where that is nothing finite."""
    try:
        return of()
    except np.linalg.LinAlgError as error:
        raise ModelError(
            "surge, sway and yaw cannot be fitted to all runs at once",
            found=f"{error} ({', '.join(r.name for r in flown)})",
            hint="look at these runs with `sysid inspect`, and leave out what no vehicle does",
        ) from error


def not_fitted(error: ModelError, runs: Sequence[Run]) -> Note:
    """Return what is said where the fit to all runs fails and each speed's own model is taken."""
    words = f"{error.what}: {error.found}; each speed's own model is taken instead: {error.hint}"
    return Note("maneuvering_not_fitted", words, {"runs": [run.name for run in runs]})


def like_no_vehicle(fitted: Fitted, length: float | None) -> Note:
    """Return what is said where the fit lies where no vehicle does and each speed's own model is taken."""
    away, runs = fitted.prior.cost(fitted.vector), [run.name for run in fitted.runs]
    hint = "" if length is not None else "state `length_m` in vehicle.yaml, "
    words = (
        "what all runs together make of surge, sway and yaw lies where no vehicle does: "
        f"{away:.0f} from the vehicles known, limit {FARTHEST_COST:.0f} ({', '.join(runs)}); "
        f"each speed's own model is taken instead: {hint}look at the runs with `sysid inspect`, or fly a zig-zag"
    )
    return Note("like_no_vehicle", words, {"runs": runs, "value": away, "limit": FARTHEST_COST})


class _Known:
    """What a belief rests on, told from another by all that it holds: its runs, the length (m), the seed of its draws."""

    def __init__(self, flown: tuple[FlownRun, ...], length: float | None, seed: int) -> None:
        self.flown, self.length, self.seed = flown, length, seed
        of = sha256(repr((length, seed)).encode())
        for run in flown:
            of.update(repr((run.name, run.time.size, run.speed, run.speed_sd, run.rate_bias_sd)).encode())
            for values in (run.time, run.fin, run.thrust, run.measured, run.discrepancy):
                of.update(np.ascontiguousarray(values).tobytes())
        self.digest = of.digest()

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Known) and self.digest == other.digest

    def __hash__(self) -> int:
        return hash(self.digest)


@lru_cache(maxsize=4)
def _fitted(known: _Known) -> Fitted:
    """Return the fit; a turn, the gains and their check of one morning rest on the same runs."""
    return fit_maneuvering(known.flown, known.length)


@lru_cache(maxsize=4)
def _drawn(known: _Known) -> Posterior:
    """Return the draws."""
    return draw_posterior(_fitted(known), np.random.default_rng(known.seed))


def _fin(models: Sequence[Model], speed: float, rudder: float, side: float) -> float:
    """Return the fin angle that a rudder at its limit leaves, positive to port, as the equations have it."""
    if not models:
        return -side * rudder
    near = nearest_model(models, speed)
    sign = float(np.sign(near.base[NAMES[near.axis].authority])) or 1.0
    acting = [e for e in effects_of(near) if e.name not in OWN_EFFECTS]
    values = {c.name: c.start for e in acting for c in e.nuisance} | dict(near.values)
    return -sign * float(steady_fins(near, acting, [values], side * sign * rudder, np.array([speed]))[0, 0])


def _median(values: FloatArray) -> float:
    """Return the median of what is not NaN, NaN where nothing is."""
    known = values[np.isfinite(values)]
    return float(np.median(known)) if known.size else float("nan")


def _band(log_radius: FloatArray, spread: float) -> tuple[float, float]:
    """Return the 95 % band of draws (n,), each spread by a normal error of the equations."""
    nodes, parts = np.polynomial.hermite_e.hermegauss(15)
    whole = (log_radius[:, None] + spread * nodes[None, :]).ravel()
    shares = np.broadcast_to(parts, (log_radius.size, parts.size)).ravel()
    return float(np.exp(weighted_quantile(whole, shares, 0.025))), float(np.exp(weighted_quantile(whole, shares, 0.975)))
