"""Whether the sampling resolves the time constant T = 1/a of the vehicle; one that is too short has only an upper bound.

Where the steps of the fin last much longer than T, the rate is the gain b/a times the fin a time T earlier. T is then determined
by the delay of the motion, to two standard errors of the fit. A logged command jumped at an unknown time since the previous
sample, which adds half a step h/2 on the mean:

    T_hat - 2 s_T <= T <= T_hat + 2 s_T + h/2,    s_T = s_a / a^2

A measured fin is taken as linear between samples, though it moved at an unknown time between them. With n equal changes of the
fin, n = (sum |d|)^2 / sum d^2 of its changes d, their mean time has the error h / sqrt(12 n), whose square is added to s_T^2.

Where h > T_hat and the uncertainty is at least T_hat, a vehicle that responds instantly fits too: then only the gain and a lower
bound of the damping are known. The test is left out for a model with a lag or a hidden state, whose slowest pole is not the
hull's, and for one that does not follow the motion: a damping at its bound then has another cause, such as a clock that is off.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fieldsid.dynamics.free_run import effects_of
from fieldsid.errors import DataError
from fieldsid.fitting.predict.goodness_of_fit import GoodnessOfFit
from fieldsid.logs.run import Note
from fieldsid.models.axis import NAMES
from fieldsid.models.model import Model, Noise
from fieldsid.models.record import Record

INTERVAL_STD_ERRORS = 2.0
"""Half the width of a 95 % interval."""
MAX_UNEXPLAINED = 0.1
"""Largest rms error beyond the noise, as a share of the motion: the unknown times of commands leave 0.06 of a glider's turns."""


def sampling_findings(model: Model, records: Sequence[Record], merit: GoodnessOfFit, floor: Noise) -> tuple[Note, ...]:
    """Return the finding that the unknown time of the command between samples changes the damping by more than its error.

    merit: the model's fit to the records. Raises DataError where the sampling of no run tells the time constant from zero.
    """
    has_slower_pole = any(e.extra_states or any(c.unit == "s" for c in e.shared) for e in effects_of(model))
    if has_slower_pole or not _follows_motion(merit, floor):
        return ()
    names = NAMES[model.axis]
    damping, authority = model.values[names.damping], model.values[names.authority]
    step, is_held = min((float(np.median(r.steps)), r.fin_is_held) for r in records)
    if not damping * step > 1.0:
        return ()
    constant = 1.0 / damping
    time_error = float(np.nan_to_num(model.std_error(names.damping))) * constant**2
    fit_margin = INTERVAL_STD_ERRORS * float(np.hypot(time_error, 0.0 if is_held else step / np.sqrt(12.0 * _changes(records))))
    longest = constant + fit_margin + (0.5 * step if is_held else 0.0)
    name, run = model.shown(names.damping), ", ".join(repr(r.name) for r in records)
    apart = f"samples {step:.3g} s apart"
    uncertainty = longest - constant
    if uncertainty >= constant:
        raise DataError(
            f"the sampling of run {run} is too coarse to identify {model.axis.value}: {apart} do not tell a time constant of "
            f"{constant:.2g} s from none",
            found=f"known are the gain {names.authority}/{names.damping} = {authority / damping:.3g} 1/s, and that {name} is "
            f"above {1.0 / longest:.2g} 1/s: {_reason(step, is_held=is_held)}",
            hint=f"log fin and motion more often than every {step:.2g} s: several times within the vehicle's time constant",
        )
    if not is_held or 0.5 * step <= fit_margin:
        return ()
    return (
        Note(
            "coarse_sampling",
            f"run {run}: {apart}, and a time constant of {constant:.2g} s: {_reason(step, is_held=True)}, so {name} lies between "
            f"{1.0 / longest:.2g} and {1.0 / max(constant - fit_margin, 1e-9):.2g} 1/s; log the measured fin, or log more often",
            {"value": damping, "low": 1.0 / longest, "limit": 1.0 / step, "run": records[0].name},
        ),
    )


def _follows_motion(merit: GoodnessOfFit, floor: Noise) -> bool:
    """Whether angle or rate are followed to MAX_UNEXPLAINED of their size, the sensor's noise apart."""
    channels = ((merit.angle_rms, merit.angle_fit, floor.angle), (merit.rate_rms, merit.rate_fit, floor.rate))
    return any(
        (1.0 - fit / 100.0) ** 2 * (1.0 - (noise / rms) ** 2) <= MAX_UNEXPLAINED**2 for rms, fit, noise in channels if rms > 0.0
    )


def _changes(records: Sequence[Record]) -> float:
    """Return the effective number of equal changes of the fin: (sum |d|)^2 / sum d^2 over all runs."""
    moves = np.concatenate([np.abs(np.diff(r.fin)) for r in records])
    squares = float(moves @ moves)
    return max(float(moves.sum()) ** 2 / squares, 1.0) if squares > 0.0 else 1.0


def _reason(step: float, *, is_held: bool) -> str:
    by_command = f"a command was given at some time within the {step:.3g} s before the sample that first shows it"
    return by_command if is_held else "a vehicle that answers at once fits them too"
