"""The path of a dive: the depth that a pitch leads to, from the runs in which depth, pitch and speed were measured.

    z' = -u g,   g' = (u/l) (theta - b/u^2 - g)
with g the angle of the path, which follows the pitch theta as the hull's heave settles, in the time l/u, and b/u^2 the pitch that
level flight takes: a weight or a buoyancy is carried by a lift that grows with u^2. At a speed u the depth is linear in b:
    z = z0 + b t/u - int u [theta through 1/(1 + s l/u)] dt
Source: Etkin and Reid 1996, section 4.9 (steady) and chapter 7 (the path follows the attitude with the lag of the incidence).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fieldsid.errors import DataError
from fieldsid.fitting.regression.state_variable_filter import filtered
from fieldsid.logs.doctor.pair_findings import goes_against_depth, goes_with_depth
from fieldsid.logs.run import Run
from fieldsid.numerics.arrays import BoolArray, FloatArray
from fieldsid.plant.yaw_plant import LEAST_SURGE_M_S

SIGNALS = ("depth_m", "pitch_rad", "surge_m_s")
LENGTHS_M = np.concatenate([[0.0], np.geomspace(0.1, 100.0, 61)])
"""The lengths l that are compared, m: those of hulls from a hand-held vehicle to a submarine, neighbours 12 % apart."""


@dataclass(frozen=True, slots=True)
class DivePath:
    """The length l (m) in which the path follows the pitch, and the lift b (m^2/s^2) that level flight takes.

    `measured` says whether runs showed them; else the path is taken as the pitch.
    """

    length: float = 0.0
    lift: float = 0.0
    measured: bool = False

    def lag(self, speed: float) -> float:
        """Return the time (s) in which the path follows the pitch at a speed (m/s)."""
        return self.length / speed

    def level_pitch(self, speed: float) -> float:
        """Return the pitch (rad) of level flight at a speed (m/s)."""
        return self.lift / speed**2


PATH_OF_PITCH = DivePath()


def dive_path_of(runs: Sequence[Run]) -> DivePath:
    """Return the path that the depths of the runs fit best; that of the pitch where no run has a depth that goes with its pitch.

    Raises DataError where the depth of a run goes against its pitch: a depth loop would run away.
    """
    for run in runs:
        if goes_against_depth(run):
            raise DataError(
                f"run {run.name!r} dives where its pitch says that it rises: a depth loop of its models would run away",
                found="`depth_m` goes against `surge_m_s` and `pitch_rad`: nose up is positive, and depth downwards",
                hint="set `sign: -1` at depth_m or pitch_rad, import the log and identify again; or leave out `--depth`",
            )
    dives = [_dive_of(run) for run in runs if goes_with_depth(run)]
    if not dives:
        return PATH_OF_PITCH
    _, lift, length = min(_fitted(dives, length) for length in LENGTHS_M.tolist())
    return DivePath(length, lift, measured=True)


@dataclass(frozen=True, slots=True)
class _Dive:
    """A run: times (n,) s, pitch (n,) rad and surge (n,) m/s at each, the depth (n,) m where `known`, the median speed m/s."""

    time: FloatArray
    pitch: FloatArray
    surge: FloatArray
    depth: FloatArray
    known: BoolArray
    speed: float


def _dive_of(run: Run) -> _Dive:
    depth, pitch, surge = (run[s] for s in SIGNALS)
    angle, speed = (np.interp(run.time, run.time[np.isfinite(v)], v[np.isfinite(v)]) for v in (pitch, surge))
    return _Dive(run.time, angle, speed, depth, np.isfinite(depth), max(float(np.median(speed)), LEAST_SURGE_M_S))


def _fitted(dives: Sequence[_Dive], length: float) -> tuple[float, float, float]:
    """Return the sum of squares (m^2) that a length (m) leaves, the lift (m^2/s^2) that leaves it, and the length."""
    parts = [_about_mean(dive, length) for dive in dives]
    left, over = (np.concatenate(part) for part in zip(*parts, strict=True))
    lift = float(over @ left / (over @ over))
    return float(np.sum((left - lift * over) ** 2)), lift, length


def _about_mean(dive: _Dive, length: float) -> tuple[FloatArray, FloatArray]:
    """Return the depth less that by the pitch alone, and what a unit of lift adds to it, (m,) each about its mean."""
    steps, angle = np.diff(dive.time), dive.pitch
    if length > 0.0:
        pace = dive.speed / length
        from_rest = filtered(steps, dive.pitch[:-1], dive.pitch[1:], pace)[:, 0]
        angle = pace * from_rest + dive.pitch[0] * np.exp(-pace * (dive.time - dive.time[0]))
    rising = dive.surge * np.sin(angle)
    risen = np.concatenate([[0.0], np.cumsum(0.5 * (rising[:-1] + rising[1:]) * steps)])
    left, over = (dive.depth + risen)[dive.known], (dive.time / dive.speed)[dive.known]
    return left - left.mean(), over - over.mean()
