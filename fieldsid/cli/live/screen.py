"""The display of `sysid live`: a screen that is redrawn on a terminal, and a line for each look elsewhere."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import isfinite, nan, pi
from typing import Any

from rich.console import Console, ConsoleOptions, Group, RenderableType, RenderResult
from rich.measure import Measurement
from rich.progress_bar import ProgressBar
from rich.table import Table

from fieldsid.cli.console import FAR, words
from fieldsid.cli.headlines.headline import Headline
from fieldsid.cli.voice import angles
from fieldsid.rounding import with_error

STYLE = {
    "starting": "dim",
    "contradicts": "bold red",
    "collecting": "cyan",
    "not_excited": "yellow",
    "moving": "cyan",
    "enough": "bold green",
}
BAR = 20


def screen(body: Mapping[str, Any]) -> RenderableType:
    """Return the screen of one look: the verdict, parameters with 95 % bands, events, excitation, counts of odd samples."""
    head = words(body["said"], STYLE[body["verdict"]])
    events = [words(text) for text in event_lines(body)]
    return Group(
        head, words(f"rests on {rests_on(body)}", "dim"), "", Parameters(body), "", *events, _meters(body), _odd_samples(body)
    )


def event_lines(body: Mapping[str, Any]) -> list[str]:
    """Return a line each for a jump of the fin's authority, for the designed gains and for the diagnosis, where there are any."""
    jump, gains, found = body["authority_jump"], body["gains"], body["diagnosed"]
    lines = []
    if jump is not None:
        factor = with_error(jump["factor"], jump["std_error"])
        lines.append(
            f"the fin's authority is {factor} times what it was, since about {jump['since_s']:.0f} s: estimated anew from there"
        )
    if gains is not None:
        at = "" if gains["verdict"] == "refused" else f"gains at {gains['time_s']:.0f} s for {gains['speed_m_s']:.2f} m/s: "
        lines.append(f"{at}{gains['says']}{_gains_in_words(gains)}")
    if found is not None:
        fly = found.get("next_maneuver")
        then = f"; before coming up fly {fly['maneuver']}, {fly['why']}" if fly else ""
        until = "" if found["verdict"] == "refused" else f"flown up to {found['time_s']:.0f} s: "
        lines.append(f"{until}{found['says']}{then}")
    return lines


def _gains_in_words(gains: Mapping[str, Any]) -> str:
    """Return the phase margin and settling time of the designed gains, and the phase margin with the loaded ones."""
    if gains["verdict"] == "refused":
        return ""
    row, loaded = gains["row"], gains["loaded_phase_margin_deg"]
    margin = "no phase crossing" if row["phase_margin_deg"] is None else f"phase margin {row['phase_margin_deg']:.0f} deg"
    before = f", {loaded:.0f} deg with the loaded" if loaded is not None else ""
    settles = "" if row["settling_s"] is None else f", settles in {row['settling_s']:.1f} s"
    return f" ({margin}{before}{settles}; bound by {row['binds']})"


def line(body: Mapping[str, Any]) -> str:
    """Return one look as a line: time, verdict, share of the goal, values with standard errors."""
    known = (
        f"{name} {with_error(p['value'], p['std_error'])}" for name, p in body["parameters"].items() if p["std_error"] is not None
    )
    return (
        f"{body['time_s'] or 0.0:8.1f} s  {body['verdict']:<11} {100.0 * body['share']:3.0f} %  {'  '.join(known)}{_unread(body)}"
    )


def rests_on(body: Mapping[str, Any]) -> str:
    """Return what a verdict rests on: axis, number of samples, speed and the source of the goals."""
    speed = "" if body["speed_m_s"] is None else f" at {body['speed_m_s']:.2f} m/s"
    return f"{body['axis']}, {body['samples']} samples{speed}; goals: {body['goals_from']}{_unread(body)}"


def _unread(body: Mapping[str, Any]) -> str:
    count = body["counts"]["unreadable"]
    return f"; {count} line{'s' * (count > 1)} could not be read" if count else ""


def headline_of(body: Mapping[str, Any]) -> Headline:
    """Return the first lines of the last look."""
    return Headline(body["said"], rests_on(body), body["next"])


@dataclass(frozen=True, slots=True)
class Parameters:
    """The table of the parameters; without the 95 % band where the terminal is too narrow: the standard error implies it."""

    body: Mapping[str, Any]

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        whole = _parameters(self.body, with_band=True)
        wide = Measurement.get(console, options.update(max_width=FAR), whole).maximum
        yield whole if wide <= options.max_width else _parameters(self.body, with_band=False)


def _parameters(body: Mapping[str, Any], *, with_band: bool) -> Table:
    made = Table(box=None, pad_edge=False, padding=(0, 2, 0, 0))
    for name in ("", "value", "unit", *(("95 % band",) if with_band else ()), "error", "wanted", ""):
        made.add_column(name, justify="right" if name else "left", header_style="dim", no_wrap=True)
    for name, p in body["parameters"].items():
        (factor, unit), wanted = angles().of(p["unit"]), p["goal_std_error"]
        value = None if p["value"] is None else factor * p["value"]
        wanted = _error(None if wanted is None else abs(factor) * wanted, value)
        if p["std_error"] is None:
            made.add_row(name, "-", unit, *(("-",) if with_band else ()), "-", wanted, "")
            continue
        shown, _, band = angles().estimate(p["value"], p["std_error"], p["interval95"], p["unit"])
        state = words("settled", "green") if p["settled"] else words("moving", "yellow")
        bands = (band,) if with_band else ()
        made.add_row(name, shown, unit, *bands, _error(factor * p["std_error"], value), wanted, state)
    return made


def _error(error: float | None, value: float | None) -> str:
    """Return a standard error in per cent of its value; absolute where the value may be zero; a dash where there is none."""
    if error is None:
        return "-"
    if value and error < 0.5 * abs(value):
        return f"{100.0 * error / abs(value):.1f} %"
    return f"{error:.1g}"


def _meters(body: Mapping[str, Any]) -> Table:
    grid = Table.grid(padding=(0, 2, 0, 0))
    share = body["share"]
    grid.add_row("data", ProgressBar(total=1.0, completed=share, width=BAR), f"{100.0 * share:.0f} % of what the goal takes")
    moved, turning = (body["excitation"][k] for k in ("fin_rms_rad", "rate_rms_rad_s"))
    fin = nan if moved is None else moved
    says = (
        "not known yet" if not isfinite(fin) else f"fin {_degrees(moved)} deg rms, rate {_degrees(turning)} deg/s rms, last 10 s"
    )
    grid.add_row(
        "excitation", ProgressBar(total=FULL_FIN_RAD, completed=min(fin if isfinite(fin) else 0.0, FULL_FIN_RAD), width=BAR), says
    )
    return grid


FULL_FIN_RAD = 10.0 * pi / 180.0
"""Root mean square of the fin angle at which the meter of the excitation is full: square pulses of 10 deg."""


def _degrees(value: float | None) -> str:
    return "-" if value is None else f"{value * 180.0 / pi:.1f}"


def _odd_samples(body: Mapping[str, Any]) -> RenderableType:
    """Return the counts of the odd samples met so far, such as gaps and spikes."""
    found = [f"{count} {name}" for name, count in body["counts"].items() if count]
    return words("met: " + ", ".join(found) if found else "", "dim")
