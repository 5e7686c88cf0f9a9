"""A Run: the converted log of one test run, in SI units and radians, in NED and forward-starboard-down axes, on one clock.

Signals have the canonical column names, the only names inside the package. A sample that a sensor did not measure is NaN; gaps
are not filled.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
import numpy.typing as npt

from fieldsid.display import Brief, Plotted, view_of
from fieldsid.errors import DataError
from fieldsid.numerics.arrays import FloatArray
from fieldsid.records.keys import Key

if TYPE_CHECKING:
    from pandas import DataFrame


SIGNALS: Mapping[str, str] = MappingProxyType(
    {
        "yaw_rad": "rad",
        "yaw_rate_rad_s": "rad/s",
        "pitch_rad": "rad",
        "pitch_rate_rad_s": "rad/s",
        "roll_rad": "rad",
        "roll_rate_rad_s": "rad/s",
        "depth_m": "m",
        "surge_m_s": "m/s",
        "sway_m_s": "m/s",
        "heave_m_s": "m/s",
        "x_m": "m",
        "y_m": "m",
        "rudder_rad": "rad",
        "elevator_rad": "rad",
        "rudder_measured_rad": "rad",
        "elevator_measured_rad": "rad",
        "thrust": "",
        "thrust_ratio": "1",
        "propeller_rpm": "1/min",
        "yaw_goal_rad": "rad",
        "pitch_goal_rad": "rad",
    }
)
"""Canonical signal names and their units; `thrust` may be in any unit."""
RATE_OF: Mapping[str, str] = MappingProxyType(
    {"yaw_rad": "yaw_rate_rad_s", "pitch_rad": "pitch_rate_rad_s", "roll_rad": "roll_rate_rad_s"}
)
"""The rate of each angle."""
ANGLES = tuple(RATE_OF)
ANGLES_AND_RATES = tuple(signal for pair in RATE_OF.items() for signal in pair)
"""Each angle and its rate, in the order in which they are chosen where nothing else decides."""
FINS = ("rudder_rad", "elevator_rad", "rudder_measured_rad", "elevator_measured_rad")
"""The commanded and the measured fin angles."""
MEASURED_FIN: Mapping[str, str] = MappingProxyType(dict(zip(FINS[:2], FINS[2:], strict=True)))
"""The measured angle of each commanded one."""
MOTORS = ("thrust", "thrust_ratio", "propeller_rpm")
"""The signals of the propulsion, commanded or measured; no estimate depends on their scale."""
PART = "["
"""The character after the signal in the name of an entry of a sum, as in `rudder_rad[0]`."""
STEP_LINES: Mapping[str, tuple[str, str]] = MappingProxyType(
    {fin: (f"{fin[:-4]}_from_rad", f"{fin[:-4]}_to_rad") for fin in FINS}
)
"""For each fin, the signals of its step lines: the fin angle at the start and at the end of the step that begins at a sample.

They exist where the fin moves between the samples of the run. The straight line from start to end has the mean and the first
moment of the fin angle in that step (`logs/convert/clock.py`).
"""
LINES = frozenset(name for pair in STEP_LINES.values() for name in pair)
COLUMNS: Mapping[str, str] = MappingProxyType({**SIGNALS, **dict.fromkeys(sorted(LINES), "rad")})
"""All names of a run's signals and their units."""
GOALS = frozenset({"yaw_goal_rad", "pitch_goal_rad"})
"""The setpoints of an autopilot's angles."""
COMMANDS = frozenset({"rudder_rad", "elevator_rad", *MOTORS}) | GOALS
"""Commanded signals, which are constant until their next sample (zero-order hold)."""
MEASURED = frozenset(SIGNALS) - COMMANDS
"""Signals measured by sensors."""


def signal_of(name: str) -> str:
    """Return the signal to which a source belongs; the entries of a sum are named `rudder_rad[0]`, `rudder_rad[1]` and so on."""
    return name.partition(PART)[0]


@dataclass(frozen=True, slots=True, repr=False)
class Note(Brief):
    """One remark on the quality of a log or a fit: a code, a sentence, and the number behind it."""

    code: Annotated[str, Key("A name that stays the same from version to version, such as `ignored_delay`.")]
    message: Annotated[str, Key("The sentence that the command prints.")]
    data: Annotated[Mapping[str, Any], Key("What the sentence rests on: values, limits, the hint's option.")] = field(
        default_factory=dict
    )


def origin_of(notes: Iterable[Note]) -> float:
    """Return the log's time at time 0 of the run, in s; it depends on the fields read, which start at different messages."""
    return next((n.data["origin_ns"] / 1e9 for n in notes if n.code == "time_origin"), 0.0)


SIMULATED = "simulated"
"""Code of the note of a run that was simulated by a model."""
READ_WITH = "mapping"
"""Code of the note that names the mapping file, under `path`."""
READ_AS = "read_as"
"""Code of the note that lists how a log without a mapping was read."""
EXPLAINING = frozenset({"time_origin", "clock", READ_WITH, READ_AS, "ignored_columns", "joined"})
"""Codes of the notes that explain rather than warn."""
OF_LIMITS = ("saturated", "fin_limit")
"""Codes of the notes that depend on the fin limits; they are made again, with the present limits, when an imported run is
read."""


@dataclass(frozen=True, slots=True, repr=False)
class Run(Plotted):
    """One log: time (n,) in s strictly increasing, and signals (n,) by canonical name, NaN where missing."""

    name: str
    time: FloatArray
    signals: Mapping[str, FloatArray]
    source: Path | None = None
    notes: tuple[Note, ...] = ()

    def __post_init__(self) -> None:
        time = frozen(self.time)
        signals = {k: frozen(v) for k, v in self.signals.items()}
        if time.ndim != 1 or any(v.shape != time.shape for v in signals.values()):
            raise DataError(f"run {self.name!r}: every signal must have the shape of time", found=f"time {time.shape}")
        if time.size > 1 and not bool(np.all(np.diff(time) > 0)):
            raise DataError(f"run {self.name!r}: time does not increase", hint="import the log again with `sysid import`")
        object.__setattr__(self, "time", time)
        object.__setattr__(self, "signals", MappingProxyType(signals))

    def __len__(self) -> int:
        return int(self.time.size)

    @classmethod
    def from_frame(cls, frame: DataFrame, name: str = "") -> Run:
        """Return the run of a pandas table of canonical columns; raises MappingError and LogError as reading a file does.

        The time is a column or the index. `fieldsid.load` takes a mapping as well.
        """
        run: Run = view_of(cls).read(frame, name)
        return run

    def has(self, name: str) -> bool:
        """Return whether the run has at least one finite sample of a signal."""
        values = self.signals.get(name)
        return values is not None and bool(np.isfinite(values).any())

    def __getitem__(self, name: str) -> FloatArray:
        """Return a signal (n,); raises DataError, which lists the signals of the run, where it is missing."""
        if name not in self.signals:
            raise DataError(
                f"run {self.name!r} has no signal `{name}`",
                found=", ".join(sorted(self.signals)) or "no signals",
                hint="map it on import, where the log has it",
            )
        return self.signals[name]

    def between(self, start_s: float, end_s: float) -> Run:
        """Return the part with start_s <= time <= end_s; raises DataError when nothing is left."""
        keep = (self.time >= start_s - 1e-9) & (self.time <= end_s + 1e-9)
        if keep.sum() < 2:
            raise DataError(
                f"run {self.name!r} has no samples between {start_s:g} and {end_s:g} s",
                found=f"time runs from {self.time[0]:g} to {self.time[-1]:g} s" if self.time.size else "an empty log",
                hint="change `--from` and `--to`",
            )
        return Run(self.name, self.time[keep], {k: v[keep] for k, v in self.signals.items()}, self.source, self.notes)


def frozen(values: npt.ArrayLike) -> FloatArray:
    """Return a read-only float64 copy or view of an array."""
    array = np.ascontiguousarray(values, dtype=np.float64)
    if array.flags.writeable:
        array = array.copy() if array is values else array
        array.setflags(write=False)
    return array
