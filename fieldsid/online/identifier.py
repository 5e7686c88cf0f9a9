"""The identifier to run on a vehicle: one sample in, parameters with intervals out, in constant memory.

    online = OnlineIdentifier("yaw")
    online.update(time_s, rudder_rad, yaw_rad, yaw_rate_rad_s)
    online.estimate().values                       # {"a22": ..., "b2": ..., "C0": ...}
    online.gains(watch.look(online.estimate()))    # of now, by the design of `sysid schedule design`

The filter is that of `--method svf_rls`, and so is the estimate by instrumental variables, here in constant memory: it has the
bias of neither a disturbance nor the noise of the sensors, and its standard errors allow for coloured residuals. It needs
NumPy and SciPy only: a sample takes 12 us with numba and 31 us without. An estimate takes 1.5 ms; the test for a jump of
authority takes 3 ms once a second.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import astuple
from math import inf, isfinite, nan
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from fieldsid.errors import DataError
from fieldsid.fitting.regression.recursive_ls import INITIAL_VARIANCE, MAX_VARIANCE_SHARE
from fieldsid.logs.doctor.angle_and_rate import contradiction
from fieldsid.logs.run import Run
from fieldsid.models.axis import NAMES, Axis
from fieldsid.numerics.arrays import FloatArray
from fieldsid.online.authority_jump import AuthorityJump, Jump
from fieldsid.online.estimate import OnlineEstimate
from fieldsid.online.progress import LOOK_BACK_S, Progress
from fieldsid.online.sample_filter import SampleFilter, check_times
from fieldsid.records.saved_state import restored, state_of

if TYPE_CHECKING:
    from fieldsid.schedule.search.of_one_model import GainsOfOne, Wanted

WINDOW = 1024
JUDGED_EVERY = WINDOW // 4
"""Samples that are stored, and samples between two tests of whether angle and rate of them contradict each other."""
WAIT_FOR_RATE_S = 1.0
"""Time after which a vehicle that has sent no rate is taken to have no rate sensor."""
VERSION = 8
"""Version of the saved state."""


def refuse_unsettled(now: OnlineEstimate, progress: Progress) -> None:
    """Raise DataError where no gains can be designed for an estimate: it has not settled, or its surge is unknown."""
    if progress.contradiction:
        raise DataError("angle and rate contradict each other", found=progress.contradiction, hint="turn the sign of one")
    moving = [p.name for p in progress.parameters if p.name != NAMES[now.axis].trim and not p.is_settled]
    if moving or not now.covariance:
        hint = f"go on for {LOOK_BACK_S:.0f} s, with the fin moved"
        raise DataError("no gains yet: the estimate has not settled", found=", ".join(moving) or "no estimate", hint=hint)
    if not isfinite(now.speed_now):
        raise DataError("no gains: they are for a speed", found="no surge in the samples", hint="send `surge_m_s` with them")


def gains_now(now: OnlineEstimate, progress: Progress, wanted: Wanted | None = None) -> GainsOfOne:
    """Return the gains for an estimate at the speed of its last seconds, by the `wanted` design.

    Without `wanted` the loop is designed as fast as the largest fin flown allows. Raises DataError as `refuse_unsettled` does,
    ModelError where no gains stabilise the loop.
    """
    refuse_unsettled(now, progress)
    from fieldsid.schedule.search.of_one_model import gains_of_one, usual

    return gains_of_one(now.model, now.speed_now, wanted or usual(now.fin_most, by_rate=now.by_rate))


class OnlineIdentifier:
    """Recursive estimation of yaw or pitch parameters; its memory does not grow with the length of the flight.

    `bandwidth` is the filter's lambda in rad/s, `forgetting` the factor beta in (0, 1]. `by_rate` says whether the regression
    uses the measured rate or the angle alone; with None it uses the rate where one arrives within a second. Raises DataError for
    settings out of bounds.
    """

    STATE = ("_first_time", "_window", "_seen", "_speed_sum", "_speeds", "_authority", "_fin_most", "_is_held")

    def __init__(
        self,
        axis: Axis | str,
        *,
        bandwidth: float = 4.0,
        forgetting: float = 1.0,
        by_rate: bool | None = None,
    ) -> None:
        if not 0.0 < forgetting <= 1.0 or not 0.01 <= bandwidth <= 1000.0:
            raise DataError(
                "forgetting must be in (0, 1] and the bandwidth in 0.01 .. 1000 rad/s",
                found=f"forgetting {forgetting:g}, bandwidth {bandwidth:g}",
                hint="start with the defaults: 1 and 4",
            )
        self.axis = Axis(axis)
        self._settings: dict[str, Any] = {"bandwidth": bandwidth, "forgetting": forgetting}
        self._stiff = NAMES[self.axis].stiffness is not None
        self._filter: SampleFilter | None = None
        self._by_rate = by_rate
        self._first_time = nan
        self._window = np.full((WINDOW, 5), nan)
        self._authority = AuthorityJump(stiff=self._stiff)
        self._jump: Jump | None = None
        self._fin_most, self._is_held = 0.0, True
        self._contradiction: str | None = None
        self._seen = 0
        self._speed_sum, self._speeds = 0.0, 0

    def update(
        self,
        time: float,
        fin: float,
        angle: float = nan,
        rate: float = nan,
        speed: float = nan,
        *,
        fin_is_held: bool = True,
        fin_line: tuple[float, float] | None = None,
    ) -> bool:
        """Take one sample and return whether a regression row joined the estimate.

        `time` is in s, `angle` in rad (a heading may wrap), `rate` in rad/s, `speed` the surge in m/s, `fin` in rad. NaN stands
        for a value that was not measured. The fin is a command that holds from this time on; without `fin_is_held` it is a
        measurement, linear since the last sample. `fin_line` are the start and end (rad) of the line that has the mean and first
        moment of the fin since the last sample, where these are known. Samples whose time does not increase are ignored; after a
        gap or a restart of the clock the estimate continues.
        """
        time, fin, angle, rate = float(time), float(fin), float(angle), float(rate)
        fed = self._filter_for(time, angle, rate)
        if fed is None:
            return False
        if isfinite(speed):
            self._speed_sum, self._speeds = self._speed_sum + float(speed), self._speeds + 1
        before = fed.counts["repeated"] + fed.counts["late"]
        used = fed.push(time, fin, angle, rate, is_held=fin_is_held, line=fin_line)
        if fed.counts["repeated"] + fed.counts["late"] == before and isfinite(time):
            self._store_sample(time, angle, rate, fin, float(speed))
        self._is_held = fin_is_held
        if used and (jump := self._authority.add(fed.row_time, fed.row, float(speed))) is not None:
            self._restart_at(jump)
        return used

    @property
    def time(self) -> float:
        """Stamp of the newest sample in s, NaN before the first."""
        return nan if self._filter is None else self._filter.time

    def begin_again(self) -> None:
        """Restart the filter and keep the estimate: the next sample does not follow the last one, as in another log."""
        if self._filter is not None:
            self._filter.begin_again()

    def estimate(self) -> OnlineEstimate:
        """Return the estimate at the newest sample."""
        names = NAMES[self.axis].base
        if self._filter is None:
            empty = dict.fromkeys(names, nan)
            return OnlineEstimate(self.axis, nan, empty, dict(empty), 0, nan, {})
        fed, keep = self._filter, [0, 1, 2, 3] if self._stiff else [0, 2, 3]
        found = fed.lagged.estimate(fed.packed[:4]) if fed.counts["used"] > 2 * len(keep) else None
        values, covariance = found or (np.full(4, nan), None)
        errors = np.sqrt(np.diag(covariance)) if covariance is not None else np.full(len(keep), nan)
        # a parameter without excitation keeps its start value and start variance P; the covariance by residuals would be zero
        excited = fed.packed[[4, 8, 11, 13]][keep] <= MAX_VARIANCE_SHARE * INITIAL_VARIANCE
        known = np.where(excited, values[keep], nan)
        errors = np.where(excited & (errors > 0.0), errors, nan)
        counts = {**fed.counts, "spikes": fed.angle_gate.spikes + fed.rate_gate.spikes}
        used = counts.pop("used")
        return OnlineEstimate(
            self.axis,
            fed.time,
            dict(zip(names, known.tolist(), strict=True)),
            dict(zip(names, errors.tolist(), strict=True)),
            used,
            self._speed_sum / self._speeds if self._speeds else nan,
            counts,
            self._find_contradiction(),
            () if covariance is None else tuple(map(tuple, covariance.tolist())),
            self._speed_now(),
            self._fin_most,
            bool(self._by_rate),
            self._jump,
        )

    def gains(self, progress: Progress, wanted: Wanted | None = None) -> GainsOfOne:
        """Return the gains at the speed of the last seconds, given the present progress of a `Watch`; see `gains_now`."""
        return gains_now(self.estimate(), progress, wanted)

    def state(self) -> dict[str, Any]:
        """Return the state as plain values; an identifier made of it by `from_state` continues with identical numbers."""
        own: dict[str, Any] = state_of(self)
        own |= {"version": VERSION, "axis": self.axis.value, "settings": self._settings, "by_rate": self._by_rate}
        own["jump"] = None if self._jump is None else state_of(astuple(self._jump))
        own["filter"] = state_of(self._filter)
        return own

    @classmethod
    def from_state(cls, state: Mapping[str, Any]) -> Self:
        """Return the identifier of a state; raises DataError where the state is not valid or of another version.

        The caller has checked the shape of the state; here its parts must be consistent and give an estimate.
        """
        try:
            if state["version"] != VERSION:
                raise DataError("the state is of another version", found=str(state["version"]), hint="start without it")
            made = cls(state["axis"], by_rate=state["by_rate"], **state["settings"])
            restored(made, state)
            made._jump = None if state["jump"] is None else Jump(*map(float, state["jump"]))
            if state["filter"] is not None:
                check_times(state["filter"])
                made._filter = restored(made._new_filter(), state["filter"])
            made._check_estimate()
        except (KeyError, TypeError, ValueError, IndexError, AttributeError, ArithmeticError) as error:
            raise DataError("this is no state of an online estimate", found=f"{type(error).__name__}: {error}") from error
        return made

    def _check_estimate(self) -> None:
        """Raise ValueError or ArithmeticError where a restored state gives no estimate."""
        if self._seen and not np.isfinite(self._recent()[-self._seen :, 0]).all():
            raise ValueError("samples without a time")
        with np.errstate(all="ignore"):
            self.estimate()

    def _filter_for(self, time: float, angle: float, rate: float) -> SampleFilter | None:
        """Return the filter, None before the first sample that shows which signals are measured."""
        if self._filter is not None:
            return self._filter
        if not isfinite(time) or not (isfinite(angle) or isfinite(rate)):
            return None
        if self._by_rate is None:
            self._first_time = time if not isfinite(self._first_time) or time < self._first_time else self._first_time
            if not isfinite(rate) and time - self._first_time < WAIT_FOR_RATE_S:
                return None
            self._by_rate = isfinite(rate)
        self._filter = self._new_filter()
        return self._filter

    def _new_filter(self) -> SampleFilter:
        return SampleFilter(stiff=self._stiff, by_rate=bool(self._by_rate), **self._settings)

    def _restart_at(self, jump: Jump) -> None:
        """Restart the estimate at a jump, from the stored samples since then, as if none had come before."""
        old, self._jump = self._filter, jump
        self._filter = fed = self._new_filter()
        recent = self._recent()
        recent = recent[recent[:, 0] >= jump.time]
        for time, angle, rate, fin, _ in recent.tolist():
            fed.push(time, fin, angle, rate, is_held=self._is_held)
        if old is not None:
            fed.continue_from(old)
        speeds = recent[np.isfinite(recent[:, 4]), 4]
        self._speed_sum, self._speeds = float(speeds.sum()), speeds.size

    def _speed_now(self) -> float:
        """Return the mean surge (m/s) of the last seconds, the mean of all samples where they have none."""
        recent = self._window[self._window[:, 0] > self.time - LOOK_BACK_S, 4]
        recent = recent[np.isfinite(recent)]
        return float(recent.mean()) if recent.size else self._speed_sum / self._speeds if self._speeds else nan

    def _store_sample(self, time: float, angle: float, rate: float, fin: float, speed: float) -> None:
        """Store a sample; whether angle and rate contradict each other is judged anew once in JUDGED_EVERY samples."""
        self._fin_most = max(self._fin_most, abs(fin)) if isfinite(fin) else self._fin_most
        unwrapped = self._filter.newest_angle if self._filter is not None and isfinite(angle) else nan
        self._window[self._seen % WINDOW] = time, unwrapped, rate, fin, speed
        self._seen += 1
        if self._seen % JUDGED_EVERY == 0:
            self._contradiction = None

    def _recent(self) -> FloatArray:
        """Return time, angle, rate, fin and surge of the last samples, (WINDOW, 5), NaN before the first."""
        return np.roll(self._window, -(self._seen % WINDOW), axis=0)

    def _find_contradiction(self) -> str:
        """Return how angle and rate contradict each other, or are mistaken for the fin; tested once in JUDGED_EVERY samples."""
        if self._contradiction is None and self._seen >= JUDGED_EVERY:
            time, angle, rate, fin, _ = self._recent()[-self._seen :].T
            restart = int(np.flatnonzero(np.diff(time, prepend=inf) <= 0.0)[-1])  # where its clock last started again
            names, part = NAMES[self.axis], slice(restart, None)
            run = Run("live", time[part], {names.angle: angle[part], names.rate: rate[part], names.fin: fin[part]})
            both = run.has(names.angle) and run.has(names.rate)
            self._contradiction = contradiction(run, names.angle, names.rate) if both else ""
        return self._contradiction or ""
