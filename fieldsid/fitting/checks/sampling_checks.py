"""Does the sampling show the vehicle's own time constant? One shorter than what a log leaves open is only bounded from above.

For a fin that is shown for long beside the time constant T = 1/a, a vehicle's rate is its gain b/a times the fin a time T before.
The samples tell T by when the motion follows, and the log leaves open by two standard errors of that fit and, for a command,
whose jump was made at some time since the sample before, by half a step h/2 on the mean:

    T_hat - 2 s_T <= T <= T_hat + 2 s_T + h/2,    s_T = s_a / a^2

A measured fin is straight between samples, where it in truth moved at some time between them: with n changes of the fin that are
alike, (sum |d|)^2 / sum d^2 of its changes d, their mean time is off by h / sqrt(12 n), and s_T^2 larger by the square of that.

Where h > T_hat, and what is open is no less than T_hat itself, a vehicle that answers at once fits too: the gain is known, the
damping from below alone. A model with a lag or a hidden state has slower poles than that of the hull, and is not asked.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fieldsid.dynamics.free_run import effects_of
from fieldsid.errors import DataError
from fieldsid.logs.run import Note
from fieldsid.models.axis import NAMES
from fieldsid.models.model import Model
from fieldsid.models.record import Record

INTERVAL_STD_ERRORS = 2.0
"""Half the width of a 95 % interval."""


def sampling_findings(model: Model, records: Sequence[Record]) -> tuple[Note, ...]:
    """Return the finding that the command's time between samples moves the damping by more than its error.

    Raises DataError where the samples of none of the runs tell the time constant from none at all.
    """
    if any(e.extra_states or any(c.unit == "s" for c in e.shared) for e in effects_of(model)):
        return ()
    names = NAMES[model.axis]
    damping, authority = model.values[names.damping], model.values[names.authority]
    step, is_held = min((float(np.median(r.steps)), r.fin_is_held) for r in records)
    if not damping * step > 1.0:
        return ()
    constant = 1.0 / damping
    of_time = float(np.nan_to_num(model.std_error(names.damping))) * constant**2
    of_fit = INTERVAL_STD_ERRORS * float(np.hypot(of_time, 0.0 if is_held else step / np.sqrt(12.0 * _changes(records))))
    longest = constant + of_fit + (0.5 * step if is_held else 0.0)
    name, run = model.shown(names.damping), ", ".join(repr(r.name) for r in records)
    apart = f"samples {step:.3g} s apart"
    open_s = longest - constant
    if open_s >= constant:
        raise DataError(
            f"the sampling of run {run} is too coarse to identify {model.axis.value}: {apart} do not tell a time constant of "
            f"{constant:.2g} s from none",
            found=f"known are the gain {names.authority}/{names.damping} = {authority / damping:.3g} 1/s, and that {name} is "
            f"above {1.0 / longest:.2g} 1/s: {_open(step, is_held=is_held)}",
            hint=f"log fin and motion more often than every {step:.2g} s: several times within the vehicle's time constant",
        )
    if not is_held or 0.5 * step <= of_fit:
        return ()
    return (
        Note(
            "coarse_sampling",
            f"run {run}: {apart}, and a time constant of {constant:.2g} s: {_open(step, is_held=True)}, so {name} lies between "
            f"{1.0 / longest:.2g} and {1.0 / max(constant - of_fit, 1e-9):.2g} 1/s; log the measured fin, or log more often",
            {"value": damping, "low": 1.0 / longest, "limit": 1.0 / step, "run": records[0].name},
        ),
    )


def _changes(records: Sequence[Record]) -> float:
    """Return how many changes of the fin, all alike, would tell as much as those of some runs."""
    moves = np.concatenate([np.abs(np.diff(r.fin)) for r in records])
    squares = float(moves @ moves)
    return max(float(moves.sum()) ** 2 / squares, 1.0) if squares > 0.0 else 1.0


def _open(step: float, *, is_held: bool) -> str:
    made = f"a command was given at some time within the {step:.3g} s before the sample that first shows it"
    return made if is_held else "a vehicle that answers at once fits them too"
