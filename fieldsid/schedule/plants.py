"""The plants at any speed for which a schedule is designed and verified: of the posterior of all runs, or of the models."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from fieldsid.dynamics.steady_kernel import settled_rates
from fieldsid.errors import ModelError
from fieldsid.logs.run import Note, Run
from fieldsid.models.axis import Axis
from fieldsid.models.hull import OF_ANGLE, Core
from fieldsid.models.model import Noise
from fieldsid.plant.parameter_source import ParameterSource
from fieldsid.records.keys import body_of
from fieldsid.schedule.dive_path import PATH_OF_PITCH, DivePath, dive_path_of
from fieldsid.schedule.linear_plant import FinLimits, LinearPlant, between, family_at, plants_at
from fieldsid.turning.maneuvering.belief import Belief, believe, fitted_to, like_no_vehicle, not_fitted
from fieldsid.turning.maneuvering.equations import NAMES, about_straight, coefficients
from fieldsid.turning.steady.speed_loss import TYPICAL_LOSS, SurgeModel, draw_speed_loss, fit_surge

LAG, RATE = NAMES.index("lag"), NAMES.index("rate_limit")


def believed_plant(belief: Belief, near: LinearPlant, limits: FinLimits, draws: int) -> LinearPlant:
    """Return the plant of a posterior at the speed of `near`, the plant of the models there; the first draw is the maximum.

    The sign of the fin, its trim and its delay are those of the models: the trim depends on the speed, and the delay is part of
    the fin path that the fit of the posterior was given. Lag and rate limit are those of the posterior unless they are stated.
    """
    vectors = belief.posterior.vectors
    chosen = vectors[np.linspace(0, vectors.shape[0] - 1, draws - 1).round().astype(int)] if draws > 1 else vectors[:0]
    hull = np.array([coefficients(v) for v in (belief.fitted.vector, *chosen)])
    which = np.arange(draws) % near.count
    zero = np.zeros(draws)
    sign = -float(np.sign(near.authority[0]))  # as in the fit; the steady sign of a model with sway may differ
    (sway, sway_by_rate, sway_by_fin), (by_sway, by_rate, by_fin) = about_straight(hull, near.speed).transpose(1, 2, 0)
    # the cross state is the yaw moment of the sway
    states = zip(-sway, -by_sway * sway_by_rate, sign * by_sway * sway_by_fin, strict=True)
    core = np.array([Core(cross_damping=c, cross_rate=r, cross_fin=f) for c, r, f in states])
    return LinearPlant(
        axis=Axis.YAW,
        speed=near.speed,
        damping=-by_rate,
        stiffness=zero,
        authority=sign * by_fin,
        offset=near.offset[which],
        core=core,
        lag=hull[:, LAG] if limits.lag is None else zero + limits.lag,
        delay=near.delay[which],
        fin_rate=hull[:, RATE] if limits.rate is None else zero + limits.rate,
        powers=np.zeros((draws, near.powers.shape[1])),
        speed_loss=np.zeros((draws, near.speed_loss.shape[1])),
        hull=hull,
    )


def with_speed_loss(plant: LinearPlant, surge: SurgeModel | None, fin_limit: float, seed: int) -> LinearPlant:
    """Return a yaw plant with the loss of speed in its turns, one draw of it for each of the plant; a pitch plant unchanged."""
    if plant.axis is not Axis.YAW:
        return plant
    curvature = abs(_full_rate(plant.one(), fin_limit)) / plant.speed
    loss = draw_speed_loss(surge, max(curvature, 1e-3), plant.count, np.random.default_rng(seed))
    return replace(plant, speed_loss=np.column_stack([loss.drag, loss.fin, loss.turn]))


def _full_rate(one: LinearPlant, fin_limit: float) -> float:
    """Return the steady rate (rad/s) with the fin at its limit; without an equilibrium by the authority over a least damping."""
    core, push, rate = one.core.copy(), np.abs(one.authority) * fin_limit, np.empty(1)
    core[:, OF_ANGLE] = 0.0
    settled_rates(core, one.damping, push, np.sign(one.authority) * fin_limit, 1.0, np.zeros(0), np.zeros((1, 0)), rate)
    if np.isfinite(rate[0]):
        return float(rate[0])
    return abs(float(one.slow_authority[0])) * fin_limit / max(float(one.slow_damping[0]), 0.05)


def speed_loss_words(axis: Axis, surge: SurgeModel | None) -> str:
    """Return the source of the loss of speed, in words."""
    if axis is not Axis.YAW:
        return "speed held"
    if surge is not None and surge.surge_measured:
        return "speed lost in the turn as measured in the runs"
    return f"no run to measure the speed lost in the turn: {100 * TYPICAL_LOSS:.0f} % assumed at full fin"


BELIEVED = "speed lost in the turn, sway and drag as all runs together have them"


@dataclass(frozen=True, slots=True)
class Plants:
    """The plants of a source with the limits of the fin and the loss of speed: by a posterior (`belief`), else by `surge`.

    `note` says why no posterior is used although the runs would allow one. `path` leads from a pitch to the depth.
    """

    source: ParameterSource
    limits: FinLimits
    surge: SurgeModel | None
    belief: Belief | None
    note: Note | None = None
    path: DivePath = PATH_OF_PITCH

    def at(self, speed: float, fin_limit: float, draws: int, seed: int) -> LinearPlant:
        """Return the plant at a speed (m/s) with `draws` of its errors, interpolated between the models."""
        near = plants_at(self.source, speed, self.limits, draws, seed)
        if self.belief is None:
            return self._diving(with_speed_loss(between(near), self.surge, fin_limit, seed))
        first = near[0][0]
        offset = np.sum([share * plant.offset for plant, share in near], axis=0)
        return believed_plant(self.belief, replace(first, offset=offset), self.limits, draws)

    def family_at(self, speed: float, fin_limit: float, draws: int, seed: int) -> LinearPlant:
        """Return the uncertainty set at a speed (m/s): the draws of all neighbouring models, or of the posterior."""
        if self.belief is None:
            family = family_at(self.source, speed, self.limits, draws, seed)
            return self._diving(with_speed_loss(family, self.surge, fin_limit, seed))
        return self.at(speed, fin_limit, draws, seed)

    def _diving(self, plant: LinearPlant) -> LinearPlant:
        return replace(plant, path_lag=self.path.lag(plant.speed), level_pitch=self.path.level_pitch(plant.speed))

    def noise_at(self, speed: float) -> Noise | None:
        """Return the noise of the model with the largest weight at a speed (m/s), None for a table."""
        if not self.source.models:
            return None
        nearest, _ = max(self.source.near(speed), key=lambda at: at[1])
        return self.source.models[nearest].noise

    @property
    def actuator(self) -> dict[str, float | None]:
        """Lag, delay and rate limit in the design: as stated, else those of the posterior's maximum or the models' worst."""
        values = [m.values for m in self.source.models]
        lag, delay = (max((v.get(n, 0.0) for v in values), default=0.0) for n in ("lag", "delay"))
        rate = min((v["max_rate"] for v in values if "max_rate" in v), default=None)
        if self.belief is not None:
            best = coefficients(self.belief.fitted.vector)
            lag, rate = float(best[LAG]), float(best[RATE])
        identified = {"lag_s": lag, "delay_s": delay, "fin_rate_rad_s": rate, "latency_s": 0.0}
        return identified | {name: value for name, value in body_of(self.limits).items() if value is not None}

    @property
    def tightest_flown(self) -> float:
        """The largest curvature (1/m) in the runs of the posterior; NaN without a posterior."""
        return self.belief.largest_curvature if self.belief is not None else float("nan")

    @property
    def draws_of(self) -> str:
        """The distribution that the draws are from, in words."""
        return "what all runs together allow" if self.belief is not None else "the models' errors"

    def share_rejected(self, speed: float, count: int, seed: int) -> float:
        """Return the share of the draws at a speed that are rejected as unphysical; none of a posterior is."""
        return 0.0 if self.belief is not None else self.source.share_rejected(speed, count, seed)

    @property
    def says(self) -> str:
        """The source of the loss of speed, in words."""
        return BELIEVED if self.belief is not None else speed_loss_words(self.source.axis, self.surge)


def plants_of(source: ParameterSource, limits: FinLimits, runs: Sequence[Run], length: float | None) -> Plants:
    """Return the plants of a source; runs are those its models were fitted to, `length` the vehicle's in m where it is known.

    As for a turning radius, the posterior of all runs is used for yaw models with effects whose runs have a fin, a turn and a
    speed. Where its fit fails or is too far from the prior, the plants of the models are used, one for each speed, with a note.
    """
    if source.axis is not Axis.YAW or not any(model.effects for model in source.models):
        return models_plants(source, limits, runs)
    try:
        fitted = fitted_to(runs, source.models, length)
        if fitted is not None and not fitted.is_usual:
            return models_plants(source, limits, runs, like_no_vehicle(fitted, length))
        belief = believe(runs, source.models, length)
    except ModelError as error:
        return models_plants(source, limits, runs, not_fitted(error, runs))
    if belief is None:
        return models_plants(source, limits, runs)
    return Plants(source, limits, None, belief)


def models_plants(source: ParameterSource, limits: FinLimits, runs: Sequence[Run], note: Note | None = None) -> Plants:
    """Return the plants of the models, one for each of their speeds; `note` says why no posterior is used."""
    if source.axis is Axis.YAW:
        return Plants(source, limits, fit_surge(runs), None, note)
    return Plants(source, limits, None, None, note, dive_path_of(runs))
