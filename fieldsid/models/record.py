"""One run on one axis, in the form that the compiled core takes: samples, masks, fin path and smoothed helper signals."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import MappingProxyType

import numpy as np
import numpy.typing as npt

from fieldsid.display import Brief
from fieldsid.errors import DataError, EffectError
from fieldsid.logs.convert.faults.spikes import spikes_of
from fieldsid.logs.doctor.angle_and_rate import refuse_contradiction
from fieldsid.logs.doctor.fin_findings import refuse_no_angle
from fieldsid.logs.doctor.holes import JITTER, hole_notes, is_usual, unbroken
from fieldsid.logs.run import STEP_LINES, Note, Run
from fieldsid.logs.segments import no_fin
from fieldsid.models.axis import NAMES, Axis
from fieldsid.models.fin_path import FinPath
from fieldsid.models.helpers.surge import causes_of, smoothed_surge
from fieldsid.numerics.arrays import FloatArray
from fieldsid.numerics.gcv_smoother import Smoother, gcv_smooth
from fieldsid.rounding import number_against

SPEED_LIMITS_M_S = (0.05, 50.0)
"""Plausible median surge speeds: below the first no fin steers, above the second the log has another unit."""
ROLES: Mapping[str, str] = MappingProxyType({"surge": "surge_m_s", "thrust": "thrust", "roll": "roll_rad", "depth": "depth_m"})
THRUST_COLUMNS = ("thrust", "thrust_ratio", "propeller_rpm")
"""Columns that can serve as the thrust, the nearest to a force first; a model's coefficients are per unit of the column used."""
SHORTEST_TIME_CONSTANT_S = MappingProxyType({"surge": 0.35, "depth": 0.35})
"""Smallest time constant of the smoother by role, in s: a hull's inertia keeps its speed and depth from changing faster."""


@dataclass(frozen=True, slots=True, repr=False)
class Record(Brief):
    """Samples (n,) of one run on one axis.

    `fin` is either the fin command, a zero-order hold over each interval (`fin_is_held`), or the measured fin angle, a
    first-order hold. `fin_line` is the course of the fin between samples, where the log has that (`logs/convert/clock.py`). The
    outputs are `angle`, `rate` and `cross`, the sway (yaw) or heave (pitch) in m/s, as measured; `angle_ok`, `rate_ok` and
    `cross_ok` mark the measured samples that are no spikes; an output is zero where it was not measured. `signals` holds the
    inputs by role (surge, thrust, roll, depth), smoothed and without gaps; no output enters them. `thrust_column` is the column
    that the thrust was read from, empty where there is none. `speed` is the median of the smoothed surge in m/s, or NaN.
    """

    name: str
    axis: Axis
    time: FloatArray
    fin: FloatArray
    fin_is_held: bool
    fin_is_measured: bool
    angle: FloatArray
    rate: FloatArray
    angle_ok: npt.NDArray[np.bool_]
    rate_ok: npt.NDArray[np.bool_]
    cross: FloatArray
    cross_ok: npt.NDArray[np.bool_]
    signals: Mapping[str, FloatArray]
    speed: float
    thrust_column: str = ""
    command_lead: FloatArray | None = None
    """Time from the moment each command was given to the sample that first shows it, (n,) s, at most one step to either side."""
    fin_line: FloatArray | None = None
    """Fin angle at the start and the end of the interval that each sample begins, (2, n) rad, NaN where it is not known."""
    refused: Mapping[str, str] = field(default_factory=dict)
    """Why signals that the log has are not used, by role."""
    goal: FloatArray | None = None
    """The autopilot's reference for the angle, (n,) rad, where the log has it."""
    smoothers: Mapping[str, Smoother] = field(default_factory=dict)
    """How the inputs that have noise were smoothed, by role."""
    steps: FloatArray = field(init=False)
    """Length of each interval, (n-1,) s."""
    longest: float = field(init=False)
    """The longest interval, in s."""
    nominal_steps: FloatArray = field(init=False)
    """Length of each interval without the jitter of the clock, (n-1,) s: the median step replaces steps near it. For the Kalman
    filters, which are fast where the step does not change and need it only for the correlation of the noise."""
    both: FloatArray = field(init=False)
    """Angle and rate, (2, n)."""
    ok: npt.NDArray[np.bool_] = field(init=False)
    """Where angle and rate were measured, (2, n)."""
    is_whole: bool = field(init=False)
    """Whether angle and rate were measured at every sample."""
    missing_fraction: FloatArray | None = field(init=False)
    """Share of the samples in each interval that are missing from the log, (n-1,), None where none is missing."""
    commanded: FinPath = field(init=False)
    """The fin as logged, as a path over the intervals."""

    def __post_init__(self) -> None:
        steps = np.diff(self.time)
        usual = float(np.median(steps)) if steps.size else 0.0
        object.__setattr__(self, "steps", steps)
        object.__setattr__(self, "longest", float(steps.max()) if steps.size else 0.0)
        regular = np.abs(steps - usual) < JITTER * usual
        object.__setattr__(self, "nominal_steps", np.where(regular, usual, steps))
        object.__setattr__(self, "both", np.stack([self.angle, self.rate]))
        object.__setattr__(self, "ok", np.stack([self.angle_ok, self.rate_ok]))
        object.__setattr__(self, "is_whole", bool(self.ok.all()))
        object.__setattr__(self, "missing_fraction", _missing_fraction(steps, regular, usual) if self.fin_is_held else None)
        object.__setattr__(self, "commanded", self._path(self.fin, self.command_lead, self.fin_line))

    def __len__(self) -> int:
        return int(self.time.size)

    def path_with_lead(self, early: FloatArray) -> FinPath:
        """Return the path of the fin if each command was given `early` (n,) s before the sample that first shows it."""
        return self._path(self.fin, early)

    def with_fin(self, fin: FloatArray) -> Record:
        """Return the record with another fin, (n,) rad, and nothing else changed."""
        return self._with(fin=fin, fin_line=None, commanded=self._path(fin, self.command_lead))

    def with_command_lead(self, early: FloatArray) -> Record:
        """Return the record whose commands were given `early` (n,) s before the samples that first show them."""
        return self._with(command_lead=early, commanded=self._path(self.fin, early))

    def at_speed(self, speed: float) -> Record:
        """Return the record with another `speed` in m/s; the record itself where `speed` is its own or not finite."""
        return self if speed == self.speed or not np.isfinite(speed) else self._with(speed=speed)

    def _path(self, fin: FloatArray, early: FloatArray | None, line: FloatArray | None = None) -> FinPath:
        if line is not None:
            start, end = np.where(np.isfinite(line[:, :-1]), line[:, :-1], (fin[:-1], fin[:-1] if self.fin_is_held else fin[1:]))
            return FinPath(start, end, fin[:-1], fin[1:])
        if not self.fin_is_held:
            return FinPath(fin[:-1], fin[1:])
        if early is None:
            missing = self.missing_fraction
            return FinPath(fin[:-1], fin[:-1] if missing is None else fin[:-1] + np.diff(fin) * missing)
        return _stepped_path(fin, np.clip(early[1:] / self.steps, 0.0, 1.0), np.clip(-early[:-1] / self.steps, 0.0, 1.0))

    def _with(self, **changes: object) -> Record:
        """Return a copy with some attributes changed and no derived one computed again: a third of the time of `replace`."""
        other = object.__new__(type(self))
        for name in self.__slots__:
            object.__setattr__(other, name, changes[name] if name in changes else getattr(self, name))
        return other

    def why_without(self, role: str) -> str:
        """Return why the record has no helper signal of a role, as the last clause of a sentence on what needs it."""
        return f"and {self.refused[role]}" if role in self.refused else "which the log lacks"

    def __getitem__(self, role: str) -> FloatArray:
        """Return a helper signal (n,); raises EffectError when the log has none."""
        if role not in self.signals:
            raise EffectError(
                f"run {self.name!r} has no {role} signal, which the model was fitted with",
                found=", ".join(sorted(self.signals)) or "none",
                hint="map the signal on import, where the log has it, or identify without the effect that needs it",
            )
        return self.signals[role]


def _missing_fraction(steps: FloatArray, regular: npt.NDArray[np.bool_], usual: float) -> FloatArray | None:
    """Return the share of the samples in each interval that are missing, (n-1,), None where none is or the step is irregular.

    `usual` is the median step, `regular` marks the steps near it. The command at the missing samples lies between the commands
    at the interval's ends: half way on average, whether it changed smoothly or jumped at an unknown time.
    """
    if not is_usual(regular):
        return None
    count = np.rint(steps / usual)
    return None if (count <= 1.0).all() else 1.0 - 1.0 / np.maximum(count, 1.0)


def _stepped_path(fin: FloatArray, early: FloatArray, late: FloatArray) -> FinPath:
    """Return the path of a zero-order-hold command (n,) that changes inside the intervals: lines of exact mean.

    The next command already acts in the last share `early` (n-1,) of an interval, the command before still acts in its first
    share `late` (n-1,). The lines stay between the smallest and the largest command of the interval.
    """
    change = np.diff(fin)
    previous_change = np.concatenate([[0.0], change[:-1]])
    mean = fin[:-1] + change * early - previous_change * late
    half = change * np.minimum(early, 1.0 - early) + previous_change * np.minimum(late, 1.0 - late)
    first = np.where(late > 0.0, fin[:-1] - previous_change, fin[:-1])
    last = np.where(early > 0.0, fin[1:], fin[:-1])
    return FinPath(mean - half, mean + half, first, last)


def part_of(record: Record, part: slice) -> Record:
    """Return successive samples of a record, with the `speed` of the whole record."""
    early = None if record.command_lead is None else record.command_lead[part]
    goal = None if record.goal is None else record.goal[part]
    line = None if record.fin_line is None else record.fin_line[:, part]
    required = ("time", "fin", "angle", "rate", "cross", "angle_ok", "rate_ok", "cross_ok")
    arrays = {name: getattr(record, name)[part] for name in required}
    return replace(
        record,
        **arrays,
        command_lead=early,
        fin_line=line,
        goal=goal,
        signals=MappingProxyType({k: v[part] for k, v in record.signals.items()}),
    )


def record_of(run: Run, axis: Axis, *, fin: str = "auto") -> Record:
    """Return the record of a run on an axis.

    fin: "auto" takes the measured fin where the log has one, else the command; "command" and "measured" take that column only.
    The run is cut at a gap of the log in which the fin moved, see `logs/doctor/holes.py`. Raises DataError when the fin is
    missing, when both angle and rate are missing, or when angle and rate contradict each other.
    """
    names = NAMES[axis]
    column = _fin_column(run, axis, fin)
    measured = column == names.fin_measured
    if not run.has(column):
        raise no_fin(run, axis.value, column)
    refuse_no_angle(run, column)
    run = unbroken(run, column)
    if not run.has(names.angle) and not run.has(names.rate):
        raise DataError(
            f"run {run.name!r} has neither `{names.angle}` nor `{names.rate}`",
            found=", ".join(k for k in run.signals if run.has(k)),
            hint="map one of them on import, where the log has it",
        )
    refuse_contradiction(run, names.angle, names.rate)
    angle, angle_ok = _measured(run, names.angle)
    rate, rate_ok = _measured(run, names.rate)
    cross, cross_ok = _measured_cross(run, names.cross)
    if axis is Axis.YAW and angle_ok.any():
        angle = angle.copy()
        angle[angle_ok] = np.unwrap(angle[angle_ok])
    angle_ok, rate_ok = _without_spikes(angle, angle_ok), _without_spikes(rate, rate_ok)
    cross_ok = _without_spikes(cross, cross_ok)
    fin_angle = _without_gaps(run.signals[column])
    thrust_column = next((c for c in THRUST_COLUMNS if run.has(c)), "")
    columns = {**ROLES, "thrust": thrust_column}
    smoothed = {
        role: gcv_smooth(run.time, run.signals[c], fastest_s=SHORTEST_TIME_CONSTANT_S.get(role, 0.0))
        for role, c in columns.items()
        if run.has(c) and role != "surge"
    }
    if knows_speed(run):
        causes, fastest_s = (
            causes_of(smoothed["thrust"][0] if thrust_column else None, fin_angle),
            SHORTEST_TIME_CONSTANT_S["surge"],
        )
        smoothed["surge"] = smoothed_surge(run.time, run.signals[ROLES["surge"]], causes, fastest_s=fastest_s)
    signals = {role: values for role, (values, _) in smoothed.items()}
    return Record(
        name=run.name,
        axis=axis,
        time=run.time,
        fin=fin_angle,
        fin_is_held=not measured,
        fin_is_measured=measured,
        angle=angle,
        rate=rate,
        angle_ok=angle_ok,
        rate_ok=rate_ok,
        cross=np.where(cross_ok, cross, 0.0),
        cross_ok=cross_ok,
        signals=MappingProxyType(signals),
        smoothers=MappingProxyType({role: by for role, (_, by) in smoothed.items() if by is not None}),
        refused=MappingProxyType({"surge": why} if (why := speed_refused(run)) else {}),
        thrust_column=thrust_column,
        fin_line=np.stack([run[line] for line in STEP_LINES[column]]) if run.has(STEP_LINES[column][0]) else None,
        goal=_without_gaps(run.signals[names.goal]) if run.has(names.goal) else None,
        # of the smoothed surge: where the speed alternates between two levels, noise would decide which of them the median takes
        speed=float(np.median(signals["surge"])) if "surge" in signals else float("nan"),
    )


def _fin_column(run: Run, axis: Axis, fin: str = "auto") -> str:
    names = NAMES[axis]
    return names.fin_measured if fin == "measured" or (fin == "auto" and run.has(names.fin_measured)) else names.fin


def fin_holes(run: Run, axis: Axis) -> tuple[Note, ...]:
    """Return notes on the gaps in the fin's log and what they mean for a fit, for the column that `record_of` takes."""
    column = _fin_column(run, axis)
    return hole_notes(run, column) if run.has(column) else ()


def knows_speed(run: Run) -> bool:
    """Whether a run has a plausible surge speed; a sensor that is not fitted is logged as zero."""
    return run.has(ROLES["surge"]) and speed_beyond(run) is None


def speed_beyond(run: Run) -> tuple[float, float] | None:
    """Return the median (m/s) of a run's surge and the limit (m/s) that it violates; None within the limits or without surge."""
    if not run.has(ROLES["surge"]):
        return None
    middle, (low, high) = float(np.nanmedian(run[ROLES["surge"]])), SPEED_LIMITS_M_S
    return None if low < middle < high else (middle, high if middle >= high else low)


def speed_refused(run: Run) -> str:
    """Return why a run's surge is not used as its speed, in words; empty where it is used or not logged."""
    beyond = speed_beyond(run)
    if beyond is None:
        return ""
    middle, limit = beyond
    side = "above the {:g} m/s of any vehicle in water" if middle >= limit else "below the {:g} m/s of one under way"
    return f"surge_m_s is {number_against(middle, limit)} m/s in the middle, {side.format(limit)}"


def _measured(run: Run, name: str) -> tuple[FloatArray, npt.NDArray[np.bool_]]:
    values = run.signals.get(name)
    if values is None:
        return np.zeros(len(run)), np.zeros(len(run), dtype=bool)
    ok = np.isfinite(values)
    return np.where(ok, values, 0.0), ok


def _measured_cross(run: Run, name: str) -> tuple[FloatArray, npt.NDArray[np.bool_]]:
    """Return the cross speed and where it was measured: nowhere if it is constant, as a sensor that is not fitted is logged."""
    values, ok = _measured(run, name)
    is_fitted = bool(ok.any()) and float(np.ptp(values[ok])) > 0.0
    return (values, ok) if is_fitted else (np.zeros(len(run)), np.zeros(len(run), dtype=bool))


def _without_spikes(values: FloatArray, ok: npt.NDArray[np.bool_]) -> npt.NDArray[np.bool_]:
    """Return the mask `ok` without a sensor's spikes, a few of which would dominate a sum of squares."""
    out = ok.copy()
    out[np.flatnonzero(ok)[spikes_of(values[ok]).places]] = False
    return out


def left_out(runs: Sequence[Run], axis: Axis) -> tuple[Note, ...]:
    """Return notes on the data that a fit on an axis does not use: spikes, and samples at a gap that hides a move of the fin."""
    fitted = (NAMES[axis].angle, NAMES[axis].rate)
    notes = [(r.name, n) for r in runs for n in r.notes if n.code == "spikes" and n.data["signal"] in fitted]
    spikes = (Note(n.code, f"{name}: {n.message}", {**n.data, "run": name}) for name, n in notes)
    return (*spikes, *(n for r in runs for n in fin_holes(r, axis)))


def _without_gaps(values: FloatArray) -> FloatArray:
    """Return a command with the value before each gap (NaN) held over it; the first value fills a gap at the start."""
    ok = np.isfinite(values)
    index = np.maximum.accumulate(np.where(ok, np.arange(values.size), -1))
    first = int(np.argmax(ok))
    return np.asarray(values[np.where(index < 0, first, index)])
