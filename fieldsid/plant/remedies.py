"""Hints for the errors of a turn or a straight run that is impossible, worked out from the models and their logs."""

from __future__ import annotations

from collections.abc import Collection
from math import ceil, degrees
from shlex import quote

from fieldsid.angles import FIN
from fieldsid.dynamics.free_run import LIMITING_EFFECT
from fieldsid.errors import UsageError
from fieldsid.models.axis import NAMES
from fieldsid.plant.parameter_source import ParameterSource, logs_of
from fieldsid.records.check import LARGEST_FIN_RAD
from fieldsid.records.named_inputs import inputs_of


def fin_limit_hint(option: str, needed: float, source: ParameterSource) -> str:
    """Return the hint for a fin limit below `needed` rad: the models' largest fin angle if it suffices, else the needed one.

    A fin offset beyond any stall angle is no trim: the hint is then to check the identified parameters.
    """
    flown = ceil(1e4 * source.largest_fin) / 1e4
    if source.largest_fin > needed:
        return f"the models' runs had the fin at up to {flown:.4g} rad: `{option} {flown:.4g}`"
    if needed <= FIN:
        return f"trim the fin: a limit has to be above {needed:.4g} rad, {degrees(needed):.1f} deg"
    names, logs = NAMES[source.axis], logs_of(source.paths) if source.models else ()
    runs = " ".join(quote(str(now or named)) for named, now, _ in logs)
    if not source.models:
        return f"no fin is trimmed that far: check unit and sign of `{names.trim}` and `{names.authority}` in the table"
    return (
        f"no fin is trimmed that far: {names.trim} and {names.authority} are not told apart by these runs, or something else "
        f"turns the vehicle: `sysid diagnose {runs or 'RUN...'} --axis {source.axis.value}`"
    )


def refuse_fin_limit(what: str, given: float) -> None:
    """Raise UsageError for a fin limit in rad that is not above zero or exceeds LARGEST_FIN_RAD."""
    if not 0.0 < given <= LARGEST_FIN_RAD:
        raise UsageError(
            f"{what} lies above 0 and at most at 90 deg",
            found=f"--fin-max {given:g}",
            hint=f"{given:.4g} rad is {degrees(given):.4g} deg; write it like `--fin-max 15deg`",
        )


def limiting_damping_hint(source: ParameterSource, speed: float, effects: Collection[str] = ()) -> str:
    """Return the hint for a model whose yaw rate has no bound at a speed in m/s: add a damping that grows with the rate."""
    if LIMITING_EFFECT in effects:
        return "fly a maneuver with longer turns, and identify again"
    if not (source.models and source.paths) or source.is_fit_file:  # no file of a model to extend
        return f"identify with the damping that holds it: `sysid identify RUN... --axis yaw --effects {LIMITING_EFFECT}`"
    path = source.paths[source.near(speed)[0][0]]
    runs = " ".join(quote(str(p)) for p in inputs_of(path)) or "RUN..."
    return f"add the damping that holds it: `sysid extend {quote(str(path))} {runs} --add {LIMITING_EFFECT}`"
