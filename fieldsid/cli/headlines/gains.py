"""Headlines from laws to gains: fit, turn-radius, schedule design, verify, export."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING

from fieldsid.cli.headlines.headline import Headline
from fieldsid.cli.headlines.typed import pasted, typed_with
from fieldsid.cli.headlines.words import Body, named
from fieldsid.cli.voice import angles
from fieldsid.page import counted
from fieldsid.rounding import MANY, number, with_error
from fieldsid.trial_folder.journal import is_trial
from fieldsid.views._words import times

if TYPE_CHECKING:
    from fieldsid.models.model import Model

TARGET = "ros2"
SLOWER = 60.0
"""Phase margin in degrees to ask for where less did not hold: the upper end of the textbooks' 30 to 60 (Franklin et al., 6.4)."""


def of_fit(body: Body) -> Headline:
    """Return how the authority grows with speed."""
    laws, points = body["laws"], body["points"]
    powers = [
        f"|{name}| as u^{with_error(law['exponent']['value'], law['exponent']['std_error'])}"
        for name, law in laws.items()
        if law["exponent"]
    ]
    odd = [p["name"] for law in laws.values() for p in law["leave_one_out"] if not p["belongs"]]
    says = ", ".join(powers) or f"{counted(len(laws), 'law')} over speed, too few speeds to test an exponent"
    rests = f"{counted(len(points), 'point')}, {number(body['speed_low_m_s'], 3)} .. {number(body['speed_high_m_s'], 3)} m/s"
    rests += f"; does not belong: {named(list(dict.fromkeys(odd)))}" if odd else ""
    if body["file"] is None:
        return Headline(says, rests, typed_with("-o", f"law_{body['axis']}.yaml"))
    if body["axis"] == "yaw":
        return Headline(says, rests, pasted("turn-radius", body["file"]))
    return Headline(says, rests, pasted("schedule", "design", body["file"], "-o", "gains.yaml"))


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


def of_turn(body: Body, models: Sequence[Path], caveat: str = "") -> Headline:
    """Return the tightest turn of both sides with its band; where the band alone is known, what tells the radius."""
    from fieldsid.turning.known_radius import turn_words
    from fieldsid.turning.prediction import found_by

    rows = body["rows"]
    tightest = min(rows, key=lambda r: float(r["radius_m"]))
    where = f"to {tightest['side']} at {number(tightest['speed_m_s'], 3)} m/s"
    says = f"tightest turn {turn_words(float(tightest['radius_m']), tightest['interval95'], where)}, {tightest['trust']}"
    speeds = sorted({float(r["speed_m_s"]) for r in rows})
    methods = [str(r["method"]) for r in rows]
    taken = f"taken for {methods.count('measured')} of {len(rows)} turns" if "measured" in methods else "of none of these turns"
    of = counted(len(body["measured"]), "measured circle")
    circles = f"{of}, {taken}" if body["measured"] else "no circle given by `--measured`"
    times, unit = angles().of("rad")
    rudder = f"rudder {number(times * body['rudder_max_rad'], 3)} {unit}"
    rests = f"{named([str(m) for m in models])}, {rudder}; {found_by(methods)}, {counted(len(speeds), 'speed')}; {circles}"
    says += ": one and a half circles tell it" if tightest["band_only"] else ""
    return Headline(caveat + says, rests, pasted("schedule", "design", models, "-o", "gains.yaml"))


def of_design(body: Body, models: Sequence[Path], caveat: str = "") -> Headline:
    """Return the span of the gains and the least margin."""
    rows = body["rows"]
    first, last = rows[0], rows[-1]
    margins = [float(r["phase_margin_deg"]) for r in rows if r["phase_margin_deg"] is not None]
    kp = f"kp {number(first['kp'], 3)} at {number(first['speed_m_s'], 3)} m/s"
    if len(rows) > 1:
        kp += f" to {number(last['kp'], 3)} at {number(last['speed_m_s'], 3)} m/s"
    least = min((m for m in margins if isfinite(m)), default=float("inf"))
    says = f"{kp}, {body['controller']}; " + (
        f"least phase margin {least:.0f} deg" if isfinite(least) else "no loop crosses unity"
    )
    beyond = sum(not r["supported"] for r in rows)
    drawn = f"{counted(int(body['provenance']['draws']), 'draw')} of {body['provenance']['draws_of']}"
    rests = f"{named([str(m) for m in models])}, {drawn}" + (f"; {beyond} of {len(rows)} rows without data" if beyond else "")
    next_ = pasted("schedule", "verify", body["file"]) if body["file"] else typed_with("-o", "gains.yaml")
    return Headline(caveat + says, rests, next_)


def of_verification(body: Body, schedule: Path, models: Sequence[Path]) -> Headline:
    """Return whether the gains hold, with what is worst; where a wider margin is kept already, more data are what is lacking."""
    says, rests = f"{body['verdict']}: {body['says']}", str(body["rests_on"]).removeprefix("rests on ")
    if body["verdict"] in ("holds", "passed") and body["passed"]:
        out = Path(f"{schedule.stem}_{TARGET}.yaml")
        return Headline(says, rests, pasted("schedule", "export", schedule, "--to", TARGET, "-o", out))
    again = schedule.with_name(f"{schedule.stem}_slower.yaml")
    asked = (float(g["wanted"]) for g in body["gates"] if g["gate"] == "phase_margin_deg" and not g["passed"])
    margin, kept = max(asked, default=SLOWER), body["worst"]["phase_margin_deg"]
    if kept is not None and kept >= margin:
        to = () if is_trial(Path()) else ("-o", "plan")
        return Headline(says, rests, pasted("plan", "--axis", body["axis"], "--model", models[0], *to))
    return Headline(says, rests, pasted("schedule", "design", models, "--phase-margin", f"{margin:g}", "-o", again))


def of_export(body: Body, schedule: Path) -> Headline:
    """Return what was written for the vehicle, to a file or to standard output."""
    rests = "the gains as they were designed; an export verifies nothing"
    if body["file"] is None:
        return Headline(
            f"{schedule} as {body['target']}, on standard output", rests, typed_with("-o", _named_after(schedule, body))
        )
    report = pasted("report", *(("--force",) if Path("report.html").exists() else ()))
    return Headline(f"{schedule} written as {body['target']}: {body['file']}", rests, report)


def of_patch(body: Body, schedule: Path, key: str) -> Headline:
    """Return what the gains change, or have changed, in a file that exists."""
    changes = [line for line in str(body["difference"]).splitlines() if line[:1] == "+" and line[:3] != "+++"]
    rests = f"{schedule}, its gains as they were designed; an export verifies nothing"
    if not changes:
        return Headline(f"{body['file']} holds these gains at {key} already", rests, pasted("status"))
    lines = counted(len(changes), "line")
    if body["backup"] is None:
        return Headline(f"{lines} of {body['file']} would change at {key}; nothing was changed", rests, typed_with("--write"))
    return Headline(f"{lines} of {body['file']} changed at {key}; as it was: {body['backup']}", rests, pasted("status"))


def _named_after(schedule: Path, body: Body) -> str:
    from fieldsid.exports import pick_target

    return f"{schedule.stem}_{body['target']}{pick_target(str(body['target'])).suffix}"
