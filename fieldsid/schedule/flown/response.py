"""Time simulations of the closed loop for every draw of a plant: steps, dives, a straight leg; and the numbers read from them.

Time step and length of a simulation follow the time constants of the plant. With the full fin at the largest error e the
bandwidth is w, w^2 = k + |b| delta/e. Loops between the two bandwidths below are simulated for 60 s in steps of 0.02 s; for
slower and faster ones both are longer or shorter in the same proportion.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import accumulate

import numpy as np
import numpy.typing as npt

from fieldsid.display import Brief
from fieldsid.models.model import Noise
from fieldsid.numerics.arrays import FloatArray
from fieldsid.plant.yaw_plant import LEAST_SURGE_M_S
from fieldsid.schedule.controller import Gains
from fieldsid.schedule.flown.closed_loop_kernel import MOTION, Dive, Plants, close_loop
from fieldsid.schedule.linear_plant import LinearPlant
from fieldsid.schedule.record import Row
from fieldsid.turning.maneuvering.equations import NAMES

SIDES = (1.0, -1.0)
"""The signs of the steps that are simulated: a trim leaves less of the fin to one side than to the other."""
STEP_S, FLIGHT_S, FLOWN_TIMES = 0.02, 60.0, 25.0
"""Usual time step and length of a flight, and the length that suffices, times the bandwidth of the full fin."""
SLOWEST_RAD_S, QUICKEST_RAD_S = FLOWN_TIMES / FLIGHT_S, 2.0
"""Bandwidths of the full fin: below the first 60 s are too short, above the second a step of 0.02 s is too coarse."""
LEAST_RAD_S = 1e-4
"""Lower limit of the bandwidth, below that of any fin."""
LARGEST_TURN = 0.2
"""Largest product of time step and fastest eigenvalue of the hull: the midpoint rule is then exact to a hundredth of it."""
LONGER = (1.0, 2.0, 4.0)
"""Factors of the simulated time: a response that has not settled is simulated again for a longer time."""


@dataclass(frozen=True, slots=True)
class Pace:
    """Time step and length of a flight, s."""

    step: float = STEP_S
    flight: float = FLIGHT_S

    @property
    def longest(self) -> float:
        """The simulated time of a step that does not settle, s."""
        return LONGER[-1] * self.flight

    @property
    def leg(self) -> float:
        """The simulated time of a straight leg and of a step of depth, s."""
        return 2.0 * self.flight


def full_bandwidth(plant: LinearPlant, fin_limit: float, error: float) -> float:
    """Return the bandwidth (rad/s) at which the estimate uses the full fin at an error (rad): a faster loop would saturate."""
    return float(np.sqrt(max(plant.stiffness[0], 0.0) + abs(plant.slow_authority[0]) * fin_limit / error))


def pace_of(plant: LinearPlant, fin_limit: float, error: float) -> Pace:
    """Return the pace of a plant whose fin is limited to +/-fin_limit rad, for steps about `error` rad."""
    bandwidth = max(full_bandwidth(plant, fin_limit, error), LEAST_RAD_S)
    times = SLOWEST_RAD_S / min(bandwidth, SLOWEST_RAD_S) * QUICKEST_RAD_S / max(bandwidth, QUICKEST_RAD_S)
    damping, stiffness, crossed, of_rate, of_fin = plant.straight
    rates = (damping, np.sqrt(np.abs(stiffness)), np.where((of_rate != 0.0) | (of_fin != 0.0), crossed, 0.0))
    fastest = max(float(np.max(np.abs(part))) for part in rates)
    most = max(LARGEST_TURN / max(fastest, LEAST_RAD_S), STEP_S)
    return Pace(STEP_S * times if times <= 1.0 else min(STEP_S * times, most), FLIGHT_S * times)


LEG_SEED = 5


def disturbance_moment(noise: Noise | None, pace: Pace) -> FloatArray:
    """Return an AR(1) moment (t,) in rad/s^2, one value for each time step of a leg; zero without a disturbance in the noise."""
    count = round(pace.leg / pace.step) + 1
    if noise is None or not noise.disturbance > 0.0:
        return np.zeros(count)
    keep = float(np.exp(-pace.step / max(noise.disturbance_time, pace.step)))
    white = np.random.default_rng(LEG_SEED).standard_normal(count) * np.sqrt(1.0 - keep**2)
    return noise.disturbance * np.array(list(accumulate(white.tolist(), lambda moment, now: keep * moment + now)))


HULL_STEPS = 2.0
"""Time step of a simulation in surge, sway and yaw over that of a plant: half of it changes the settling by less than 1 %."""
SETTLING_BAND = 0.05
FLIGHT_ERROR_SHARE = 0.01
"""Error of the predicted overshoot over the step: hulls of `tests/truth/gain_table.py` overshot by 0.2 to 0.8 % more or less than
predicted, which changes the settling by half a period where an overshoot just touches the corridor."""
FASTEST_LAG_S = 1e-6
TAIL_SHARE = 0.25
"""Last part of a response in which a remaining oscillation counts as a limit cycle."""
LIMIT_CYCLE_SHARE = 2.0 * SETTLING_BAND
"""Peak-to-peak oscillation over the step from which on there is a limit cycle: the full width of the settling corridor."""


HELD_S = 1.0
"""Duration over which a curvature is averaged, as for that of the runs."""


@dataclass(frozen=True, slots=True, repr=False)
class Steps(Brief):
    """Responses of n cases: time (t,) s, angle (t, n) rad, fin command or angle (t, n) rad, depth (t, n) m, speed (t, n) m/s."""

    time: FloatArray
    angle: FloatArray
    fin: FloatArray
    depth: FloatArray
    speed: FloatArray

    def one(self) -> Steps:
        """Return the first case only."""
        return Steps(self.time, self.angle[:, :1], self.fin[:, :1], self.depth[:, :1], self.speed[:, :1])

    def mirrored(self) -> Steps:
        """Return the responses with angle and fin of the other sign."""
        return replace(self, angle=-self.angle, fin=-self.fin)


def overshoot(values: FloatArray, size: float) -> FloatArray:
    """Return the overshoot (n,) of steps (t, n) of `size`, as a share of it; inf for a response that diverges."""
    return np.asarray(np.maximum(np.max(values / size, axis=0) - 1.0, 0.0))


def settling(time: FloatArray, values: FloatArray, size: float, band: float = SETTLING_BAND) -> FloatArray:
    """Return the time (n,) s after which steps (t, n) of `size` stay within `band` (a share of it) of it; inf if never."""
    off = np.abs(values - size) > band * abs(size)
    last = time.size - 1 - np.argmax(off[::-1], axis=0)
    return np.asarray(np.where(off.any(axis=0), np.where(last >= time.size - 1, np.inf, time[last]), 0.0))


def swing(values: FloatArray, size: float) -> FloatArray:
    """Return the peak-to-peak oscillation (n,) of steps (t, n) of `size` in their last quarter, as a share of it."""
    tail = values[-max(2, round(TAIL_SHARE * values.shape[0])) :]
    diverged: npt.NDArray[np.bool_] = np.asarray(~np.isfinite(tail).all(axis=0))
    finite = np.where(diverged[None, :], 0.0, tail)
    return np.asarray(np.where(diverged, np.inf, np.ptp(finite, axis=0) / abs(size)))


def tightest(steps: Steps) -> float:
    """Return the largest curvature (1/m) of the first case, averaged over HELD_S."""
    width = max(1, round(HELD_S / float(steps.time[1] - steps.time[0])))
    turned = np.abs(steps.angle[width:, 0] - steps.angle[:-width, 0]) / HELD_S
    return float(np.max(turned / np.maximum(steps.speed[width:, 0], LEAST_SURGE_M_S)))


def about_rest(values: FloatArray, size: float, gains: Gains) -> FloatArray:
    """Return steps (t, ..., d) of `size` shifted to where the estimate, the first draw, comes to rest.

    So an error of the trim does not count as motion, and the rest of the estimate, which is known, does. Under an integral they
    are returned as they are: the trim leaves no error, and what is left is the integral's own tail.
    """
    if gains.ki != 0.0:
        return values
    off = np.nan_to_num(steady_error(values, size), nan=0.0, posinf=0.0, neginf=0.0)
    return np.asarray(values + off - off[..., :1])


def steady_error(values: FloatArray, wanted: float) -> FloatArray:
    """Return `wanted` less the mean of the last twentieth of values (t, ...), (...)."""
    tail = max(1, values.shape[0] // 20)
    return np.asarray(wanted - values[-tail:].mean(axis=0))


@dataclass(frozen=True, slots=True)
class Flight:
    """A simulation of `seconds` s in steps of `step` s: a step at time 0 of the reference (rad), or of the depth (m).

    The depth follows the plant's path (schedule/dive_path.py), with a pitch reference within `pitch_limit` rad. `offset` (rad) is
    a fin offset in addition to the plant's trim. `push` (t,) is a disturbance moment in rad/s^2, a value for each step.
    """

    seconds: float
    step: float = STEP_S
    reference: float = 0.0
    depth: float = 0.0
    pitch_limit: float = 0.0
    offset: float = 0.0
    push: FloatArray | None = None

    def times(self, steps: float = 1.0) -> FloatArray:
        """Return the times (t,) s of the simulation in steps of `steps` times its step."""
        length = steps * self.step
        return length * np.arange(round(self.seconds / length) + 1, dtype=np.float64)


def fly(plant: LinearPlant, rows: Sequence[Row], flight: Flight) -> Steps:
    """Return the responses of every draw of a plant under the gains of rows; with `plant.hull` in surge, sway and yaw."""
    coarser = 1.0 if plant.hull is None else HULL_STEPS
    time, step, push_time = flight.times(coarser), coarser * flight.step, flight.times()
    push = np.interp(time, push_time, np.zeros(push_time.size) if flight.push is None else flight.push)
    out = np.zeros((plant.count, time.size, len(MOTION)))
    table = np.array([_gains(row) for row in rows])
    lag, fin_rate = np.maximum(plant.lag, FASTEST_LAG_S), np.minimum(plant.fin_rate, 1e6)
    delay, hulls = plant.delay / step, np.zeros((0, len(NAMES))) if plant.hull is None else np.ascontiguousarray(plant.hull)
    of_damping, of_authority, of_core, drag, fin_loss, turn_loss = (
        np.ascontiguousarray(part) for part in (*plant.powers[:, :2].T, plant.powers[:, 2:], *plant.speed_loss.T)
    )
    plants = Plants(
        plant.damping, plant.stiffness, plant.authority, plant.offset + flight.offset, np.ascontiguousarray(plant.core),
        of_damping, of_authority, of_core, np.exp(-step / lag), np.round(delay) if plant.hull is None else delay,
        fin_rate * step, drag, fin_loss, turn_loss,
    )  # fmt: skip
    dive = Dive(flight.depth, flight.pitch_limit, plant.path_lag, plant.level_pitch)
    close_loop(plants, hulls, table, flight.reference, dive, plant.speed, step, push, out)
    return Steps(time, *(np.ascontiguousarray(out[:, :, j].T) for j in MOTION))


def _gains(row: Row) -> tuple[float, ...]:
    g = row.gains
    return row.speed, g.kp, g.ki, g.kd, row.feed_forward, row.reference_gain, row.fin_limit, row.depth_gain
