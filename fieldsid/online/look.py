"""One report of a live estimate: the line that `sysid live --json` prints, and the sentence that gives its verdict."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import isfinite, nan, pi
from typing import TYPE_CHECKING, Annotated, Any, Literal

from fieldsid.artifacts import plain
from fieldsid.models.axis import NAMES, Axis
from fieldsid.online.authority_jump import Jump
from fieldsid.online.estimate import OnlineEstimate
from fieldsid.online.progress import LOOK_BACK_S, ParameterProgress, Progress, Verdict
from fieldsid.records.keys import INLINE, Interval, Key, Number, Result, body_of

if TYPE_CHECKING:
    from fieldsid.schedule.search.of_one_model import GainsOfOne

LONGEST_GUESS_S = 3600.0
"""Longest time to the goal that is reported: the progress of a few seconds does not predict hours."""


@dataclass(frozen=True, slots=True)
class Excitation:
    """How the vehicle was moved in the last 10 s."""

    fin_rms_rad: Annotated[Number, Key("Root mean square of the fin about its mean, in rad.")]
    rate_rms_rad_s: Annotated[Number, Key("Of the rate, in rad/s.")]


@dataclass(frozen=True, slots=True)
class ParameterNow:
    """One parameter now."""

    progress: Annotated[ParameterProgress, INLINE]
    interval95: Annotated[Interval, Key("Its 95 % interval.")]
    unit: Annotated[str, Key("Its unit.")]


@dataclass(frozen=True, slots=True, kw_only=True)
class LiveGains:
    """Gains of now by the design of `schedule design`, with `--gains`."""

    time: Annotated[Number, Key("Time of the estimate they are of.", "time_s")]
    verdict: Annotated[
        Literal["use", "keep", "change", "refused"],
        Key("`keep` and `change` are of the gains loaded, `use` where none are; `refused` until the estimate has settled."),
    ]
    says: Annotated[str, Key("The gains with their errors beside those loaded, or why there are none.")]
    method: Annotated[
        str, Key("How the model that they are for was found: `live`, or once a maneuver has ended the method of `identify`.")
    ] = "live"
    speed: Annotated[Number, Key("The speed they are for: that of the last 10 s.", "speed_m_s")] = nan
    row: Annotated[Mapping[str, Any] | None, Key("Gains, margins and answer, as a row of a schedule.")] = None
    std_errors: Annotated[Mapping[str, float] | None, Key("Standard errors of kp, ki, kd and of the feed-forward in rad.")] = None
    loaded: Annotated[Mapping[str, Any] | None, Key("The row of the schedule that is loaded, at this speed.")] = None
    loaded_phase_margin_deg: Annotated[Number, Key("Its phase margin with the estimate: the least over 95 % of the draws.")] = nan


@dataclass(frozen=True, slots=True, kw_only=True)
class LiveDiagnosis:
    """What `diagnose` says of what was flown when the last maneuver had ended, with `--diagnose`."""

    time: Annotated[Number, Key("The end of what was diagnosed.", "time_s")]
    verdict: Annotated[str, Key("Its verdict; `refused` where it could not be diagnosed.")]
    says: Annotated[str, Key("Its first line.")]
    effects: Annotated[tuple[str, ...] | None, Key("What is missing.")] = None
    left: Annotated[Mapping[str, Any] | None, Key("What is left: `ratio` is the error over the noise.")] = None
    base: Annotated[Mapping[str, Any] | None, Key("The error without them.")] = None
    final: Annotated[Mapping[str, Any] | None, Key("The error with them.")] = None
    noise_floor: Annotated[Mapping[str, Any] | None, Key("The sensors' noise.")] = None
    next_maneuver: Annotated[
        Mapping[str, Any] | None, Key("What to fly before coming up; null where nothing is to be told apart.")
    ] = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Look(Result):
    """One look at the estimate of a vehicle under way."""

    SCHEMA = "fieldsid/live/1"

    axis: Annotated[Axis, Key("The plane.")]
    source: Annotated[str, Key("Where the samples come from.")]
    time_s: Annotated[Number, Key("Stamp of the newest sample.")]
    verdict: Annotated[
        Verdict,
        Key(
            "`enough`: every goal is reached and has settled; `moving`: reached, not settled; `not_excited`: the fin is still; "
            "`contradicts`: angle and rate are not each other's."
        ),
    ]
    said: Annotated[str, Key("The verdict in a sentence.")]
    share: Annotated[float, Key("Share of the information that the goal takes which is in, of the parameter that limits.")]
    limited_by: Annotated[str, Key("That parameter.")]
    left_s: Annotated[Number, Key("Seconds to the goal at the pace of the last 10 s; null where unknown.")]
    goals_from: Annotated[str, Key("Where the goals are from.")]
    speed_m_s: Annotated[Number, Key("Mean surge.")]
    samples: Annotated[int, Key("Rows that joined the estimate.")]
    excitation: Annotated[Excitation, Key("How the vehicle was moved.")]
    parameters: Annotated[Mapping[str, ParameterNow], Key("By name.")]
    authority_jump: Annotated[Jump | None, Key("The last jump of the fin's authority; null where there was none.")]
    gains: Annotated[LiveGains | None, Key("Gains of now; null without `--gains`.")]
    diagnosed: Annotated[
        LiveDiagnosis | None,
        Key("A diagnosis of what was flown; null without `--diagnose`, or before the first maneuver has ended."),
    ]
    counts: Annotated[
        Mapping[str, int],
        Key("What was met: missing, repeated, late samples, gaps, restarts, spikes, lines that could not be read."),
    ]
    next: Annotated[str, Key("The command that comes next; empty where the source is no log.")]


def live_gains(now: OnlineEstimate, found: GainsOfOne, method: str = "live") -> LiveGains:
    """Return the record of gains at the time and speed of an estimate; `method` is that which estimated their model."""
    return LiveGains(
        time=now.time,
        verdict=found.verdict,
        says=found.says,
        method=method,
        speed=now.speed_now,
        row=body_of(found.row),
        std_errors=found.std_errors,
        loaded=None if found.loaded is None else body_of(found.loaded),
        loaded_phase_margin_deg=found.loaded_phase_margin_deg,
    )


def look_body(
    now: OnlineEstimate,
    progress: Progress,
    *,
    source: str,
    goals_from: str,
    unreadable: int,
    then: str,
    gains: LiveGains | None = None,
    diagnosed: LiveDiagnosis | None = None,
) -> dict[str, Any]:
    """Return a report as nested plain values, with the gains and the diagnosis computed in other processes; NaN as None."""
    bands, units = now.intervals95, units_of(now.axis)
    look = Look(
        axis=now.axis,
        source=source,
        time_s=now.time,
        verdict=progress.verdict,
        said=verdict_sentence(progress),
        share=progress.share,
        limited_by=progress.limited_by,
        left_s=progress.left_s,
        goals_from=goals_from,
        speed_m_s=now.speed,
        samples=now.used,
        excitation=Excitation(progress.fin_rms, progress.rate_rms),
        parameters={p.name: ParameterNow(p, bands[p.name], units[p.name]) for p in progress.parameters},
        authority_jump=now.jump,
        gains=gains,
        diagnosed=diagnosed,
        counts={**now.counts, "unreadable": unreadable},
        next=then,
    )
    out: dict[str, Any] = plain(look)
    return out


def units_of(axis: Axis) -> Mapping[str, str]:
    """Return the units of an axis' base parameters."""
    names = NAMES[axis]
    stiff = {} if names.stiffness is None else {names.stiffness: "1/s^2"}
    return {names.damping: "1/s", **stiff, names.authority: "1/s^2", names.trim: "rad/s^2"}


def verdict_sentence(progress: Progress) -> str:
    """Return the verdict in one sentence, its number first."""
    wanted = [p for p in progress.parameters if isfinite(p.goal)]
    share = f"{100.0 * progress.share:.0f} % of the data"
    match progress.verdict:
        case "starting":
            return "0 % of the data: no estimate yet"
        case "contradicts":
            return f"0 % of the data can be used: {progress.contradiction}"
        case "enough":
            known = ", ".join(_accuracy_in_words(p) for p in wanted)
            return f"enough data, come up: {known}; settled for {LOOK_BACK_S:.0f} s"
        case "moving":
            still = ", ".join(p.name for p in wanted if not p.is_settled)
            return f"{share}, but {still} still moving: go on for {LOOK_BACK_S:.0f} s"
        case "not_excited":
            return f"{share}, and the fin is still ({progress.fin_rms * 180.0 / pi:.1f} deg rms): move it; {_limiting(progress)}"
    left = progress.left_s
    pace = f", about {left:.0f} s more as it is flown now" if isfinite(left) and left < LONGEST_GUESS_S else ""
    return f"{share}{pace}: {_limiting(progress)}"


def _limiting(progress: Progress) -> str:
    (p,) = (p for p in progress.parameters if p.name == progress.limited_by)
    return (
        f"{_accuracy_in_words(p)}, wanted {_error_in_words(p.goal, p.value)}"
        if isfinite(p.std_error)
        else f"nothing is known of {p.name} yet"
    )


def _accuracy_in_words(p: ParameterProgress) -> str:
    return f"{p.name} to {_error_in_words(p.std_error, p.value)}"


def _error_in_words(error: float, value: float) -> str:
    """Return an error in per cent of a value, in the unit of the value where that may be zero."""
    if not isfinite(error):
        return "nothing yet"
    return f"{100.0 * error / abs(value):.1f} %" if value and error < 0.5 * abs(value) else f"+/- {error:.2g}"
