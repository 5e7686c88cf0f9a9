"""Headlines from laws to gains: fit, turn-radius, schedule design, verify, export."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING

from fieldsid.cli.headlines.headline import Headline
from fieldsid.cli.headlines.typed import pasted, typed_with
from fieldsid.cli.headlines.words import named, used
from fieldsid.cli.voice import angles
from fieldsid.page import counted
from fieldsid.rounding import MANY, number, with_error
from fieldsid.trial_folder.journal import is_trial
from fieldsid.views._words import times

if TYPE_CHECKING:
    from fieldsid.models.model import Model
    from fieldsid.results.gains import Design, Exported, Patched, Verified
    from fieldsid.results.turning import FittedLaws
    from fieldsid.turning.prediction import TurnPrediction

TARGET = "ros2"
SLOWER = 60.0
"""Phase margin in degrees to ask for where less did not hold: the upper end of the textbooks' 30 to 60 (Franklin et al., 6.4)."""


def of_fit(told: FittedLaws) -> Headline:
    """Return how the authority grows with speed."""
    laws, by_name = told.laws, told.laws.by_name
    exponents = ((name, law.exponent) for name, law in by_name.items())
    powers = [f"|{name}| as u^{with_error(e.value, e.std_error)}" for name, e in exponents if e is not None]
    odd = [p.name for law in by_name.values() for p in law.points if not p.belongs]
    says = ", ".join(powers) or f"{counted(len(by_name), 'law')} over speed, too few speeds to test an exponent"
    rests = f"{counted(len(laws.points), 'point')}, {number(laws.speed_low, 3)} .. {number(laws.speed_high, 3)} m/s"
    rests += f"; does not belong: {named(list(dict.fromkeys(odd)))}" if odd else ""
    if told.file is None:
        return Headline(says, rests, typed_with("-o", f"law_{laws.axis.value}.yaml"))
    return Headline(says, rests, used(laws.axis.value, told.file))


def caveat(models: Iterable[Model], files: Sequence[Path]) -> str:
    """Return how a result begins that is made of models whose own records say that they lack something; empty where none does.

    Where a diagnosis has asked that already, it is not sent back to one.
    """
    from fieldsid.cli.headlines.models import searched
    from fieldsid.comparison.left_by import lacking

    over = lacking(models)
    if not isfinite(over):
        return ""
    first = "" if any(p.is_file() and searched(p) for p in files) else "; `sysid diagnose` first"
    left = f"{times(over)} x the noise" if over < MANY else "more than the noise"
    return f"from a model that lacks something ({left}{first}): "


def of_turn(found: TurnPrediction, models: Sequence[Path], caveat: str = "") -> Headline:
    """Return the tightest turn of both sides with its band; where the band alone is known, what tells the radius."""
    from fieldsid.turning.prediction import found_by, turn_words

    rows, tightest = found.rows, min(found.rows, key=lambda r: r.radius)
    where = f"to {tightest.side} at {number(tightest.speed, 3)} m/s"
    says = f"tightest turn {turn_words(tightest.radius, tightest.interval95, where)}, {tightest.trust}"
    methods = [r.method for r in rows]
    taken = f"taken for {methods.count('measured')} of {len(rows)} turns" if "measured" in methods else "of none of these turns"
    of = counted(len(found.measured), "measured circle")
    circles = f"{of}, {taken}" if found.measured else "no circle given by `--measured`"
    times, unit = angles().of("rad")
    rudder, speeds = f"rudder {number(times * found.rudder_max, 3)} {unit}", counted(len({r.speed for r in rows}), "speed")
    rests = f"{named([str(m) for m in models])}, {rudder}; {found_by(methods)}, {speeds}; {circles}"
    says += ": one and a half circles tell it" if tightest.band_only else ""
    return Headline(caveat + says, rests, pasted("schedule", "design", models, "-o", "gains.yaml"))


def of_design(told: Design, models: Sequence[Path], caveat: str = "") -> Headline:
    """Return the span of the gains and the least margin."""
    schedule, rows = told.schedule, told.schedule.rows
    kp = " to ".join(f"{number(r.gains.kp, 3)} at {number(r.speed, 3)} m/s" for r in dict.fromkeys((rows[0], rows[-1])))
    least = min((r.phase_margin_deg for r in rows if isfinite(r.phase_margin_deg)), default=float("inf"))
    margin = f"least phase margin {least:.0f} deg" if isfinite(least) else "no loop crosses unity"
    beyond, known = sum(not r.supported for r in rows), schedule.provenance
    drawn = f"{counted(int(known['draws']), 'draw')} of {known['draws_of']}"
    rests = f"{named([str(m) for m in models])}, {drawn}" + (f"; {beyond} of {len(rows)} rows without data" if beyond else "")
    next_ = pasted("schedule", "verify", told.file) if told.file else typed_with("-o", "gains.yaml")
    return Headline(f"{caveat}kp {kp}, {schedule.kind}; {margin}", rests, next_)


def of_verification(told: Verified, schedule: Path, models: Sequence[Path]) -> Headline:
    """Return whether the gains hold, with what is worst; where a wider margin is kept already, more data are what is lacking."""
    says, rests = f"{told.verdict}: {told.says}", told.rests_on.removeprefix("rests on ")
    if told.verdict in ("holds", "passed") and told.passed:
        out = Path(f"{schedule.stem}_{TARGET}.yaml")
        return Headline(says, rests, pasted("schedule", "export", schedule, "--to", TARGET, "-o", out))
    again = schedule.with_name(f"{schedule.stem}_slower.yaml")
    asked = (g.wanted for g in told.gates if g.name == "phase_margin_deg" and not g.passed)
    margin = max(asked, default=SLOWER)
    if isfinite(told.worst["phase_margin_deg"]) and told.worst["phase_margin_deg"] >= margin:
        to = () if is_trial(Path()) else ("-o", "plan")
        return Headline(says, rests, pasted("plan", "--axis", told.axis.value, "--model", models[0], *to))
    return Headline(says, rests, pasted("schedule", "design", models, "--phase-margin", f"{margin:g}", "-o", again))


def of_export(told: Exported, schedule: Path) -> Headline:
    """Return what was written for the vehicle, to a file or to standard output."""
    rests = "the gains as they were designed; an export verifies nothing"
    if told.file is None:
        from fieldsid.exports import pick_target

        name = f"{schedule.stem}_{told.target}{pick_target(told.target).suffix}"
        return Headline(f"{schedule} as {told.target}, on standard output", rests, typed_with("-o", name))
    report = pasted("report", *(("--force",) if Path("report.html").exists() else ()))
    return Headline(f"{schedule} written as {told.target}: {told.file}", rests, report)


def of_patch(told: Patched, schedule: Path, key: str) -> Headline:
    """Return what the gains change, or have changed, in a file that exists."""
    changes = [line for line in told.difference.splitlines() if line[:1] == "+" and line[:3] != "+++"]
    rests = f"{schedule}, its gains as they were designed; an export verifies nothing"
    if not changes:
        return Headline(f"{told.file} holds these gains at {key} already", rests, pasted("status"))
    lines = counted(len(changes), "line")
    if told.backup is None:
        return Headline(f"{lines} of {told.file} would change at {key}; nothing was changed", rests, typed_with("--write"))
    return Headline(f"{lines} of {told.file} changed at {key}; as it was: {told.backup}", rests, pasted("status"))
