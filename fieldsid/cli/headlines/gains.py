"""Headlines from laws to gains: fit, turn-radius, schedule design, verify, export."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from math import degrees, inf, isfinite
from pathlib import Path
from typing import TYPE_CHECKING

from fieldsid.cli.headlines.headline import Headline
from fieldsid.cli.headlines.typed import pasted, typed_with
from fieldsid.cli.headlines.words import first_names, next_use
from fieldsid.cli.voice import angles
from fieldsid.display import line_of
from fieldsid.page import counted
from fieldsid.rounding import MANY, number
from fieldsid.schedule.wish import QUICKEST, STEP_ANGLE_RAD
from fieldsid.trial_folder.journal import is_trial
from fieldsid.views._words import times

if TYPE_CHECKING:
    from fieldsid.models.model import Model
    from fieldsid.results.gains import Design, Exported, Verified
    from fieldsid.results.turning import FittedLaws
    from fieldsid.schedule.record import Schedule
    from fieldsid.turning.prediction import TurnPrediction

TARGET = "ros2"
WIDE_MARGIN = 60.0
"""Phase margin (deg) to design for after a smaller one has failed: the upper end of 30 to 60 (Franklin et al., 6.4)."""


def headline_of_fit(result: FittedLaws) -> Headline:
    """Return the exponent of speed by which each authority grows, and the points that do not fit its law."""
    laws, by_name = result.laws, result.laws.by_name
    outliers = [p.name for law in by_name.values() for p in law.points if not p.belongs]
    says = line_of(laws)
    rests = f"{counted(len(laws.points), 'point')}, {number(laws.speed_low, 3)} .. {number(laws.speed_high, 3)} m/s"
    rests += f"; does not belong: {first_names(list(dict.fromkeys(outliers)))}" if outliers else ""
    kept = result.file and next_use(laws.axis.value, result.file)
    return Headline(says, rests, kept or typed_with("-o", f"law_{laws.axis.value}.yaml"))


def caveat(models: Iterable[Model], files: Sequence[Path]) -> str:
    """Return a caveat for a result of models that leave more than the noise by their own records; empty where none does.

    It recommends `sysid diagnose`, unless a diagnosis was made of one of the files already.
    """
    from fieldsid.cli.headlines.models import is_diagnosed
    from fieldsid.comparison.left_by import lacking

    over = lacking(models)
    if not isfinite(over):
        return ""
    first = "" if any(p.is_file() and is_diagnosed(p) for p in files) else "; `sysid diagnose` first"
    left = f"{times(over)} x the noise" if over < MANY else "more than the noise"
    return f"from a model that lacks something ({left}{first}): "


def caveat_of_loops(models: Sequence[Model], files: Sequence[Path]) -> str:
    """Return the caveat of gains: what their models lack, and what no loop was flown with between fin and motion."""
    from fieldsid.schedule.linear_plant import not_counted

    parts = ", ".join(f"{effect}'s {' and '.join(names)}" for effect, names in not_counted(models).items())
    return caveat(models, files) + (f"flown without {parts}: " if parts else "")


def headline_of_turn(found: TurnPrediction, models: Sequence[Path], caveat: str = "") -> Headline:
    """Return the tightest turn of both sides with its 95 % band; where only the band is known, how to measure the radius."""
    from fieldsid.turning.prediction import found_by

    rows, tightest = found.rows, min(found.rows, key=lambda r: r.radius)
    methods = [r.method for r in rows]
    use = f"taken for {methods.count('measured')} of {len(rows)} turns" if "measured" in methods else "of none of these turns"
    of = counted(len(found.measured), "measured circle")
    circles = f"{of}, {use}" if found.measured else "no circle given by `--measured`"
    factor, unit = angles().of("rad")
    rudder, speeds = f"rudder {number(factor * found.rudder_max, 3)} {unit}", counted(len({r.speed for r in rows}), "speed")
    rests = f"{first_names([str(m) for m in models])}, {rudder}; {found_by(methods)}, {speeds}; {circles}"
    says = f"{caveat}{line_of(found)}" + (": one and a half circles tell it" if tightest.band_only else "")
    return Headline(says, rests, pasted("schedule", "design", models, "-o", "gains.yaml"))


def headline_of_design(result: Design, models: Sequence[Path], caveat: str = "") -> Headline:
    """Return the range of the gain kp over speed, and the least phase margin."""
    schedule, rows = result.schedule, result.schedule.rows
    beyond, known = sum(not r.supported for r in rows), schedule.provenance
    drawn = f"{counted(int(known['draws']), 'draw')} of {known['draws_of']}"
    without_data = f"; {beyond} of {len(rows)} rows without data" if beyond else ""
    rests = f"{first_names([str(m) for m in models])}, {drawn}{without_data}"
    next_ = pasted("schedule", "verify", result.file) if result.file else typed_with("-o", "gains.yaml")
    return Headline(caveat + line_of(schedule), rests, next_)


def headline_of_verification(
    result: Verified, schedule: Path, known: Schedule, models: Sequence[Path], caveat: str = ""
) -> Headline:
    """Return the verdict on the gains; those that fail need rows between, more data where their margin is wide, else margin."""
    says, rests = f"{caveat}{result.verdict}: {result.says}", result.rests_on.removeprefix("rests on ")
    if result.verdict in ("holds", "passed") and result.passed:
        out = Path(f"{schedule.stem}_{TARGET}.yaml")
        return Headline(says, rests, pasted("schedule", "export", schedule, "--to", TARGET, "-o", out))
    by_size = ([c for c in result.checked.scheduled if c.steps[i].settling == inf] for i in range(3))
    unsettled = next((checks for checks in by_size if checks), [])  # of the smallest step that fails, as in the verdict
    if unsettled and not any(c.knot for c in unsettled):
        speeds = ",".join(number(u, 3) for u in sorted(c.speed for c in result.checked.scheduled if c.knot or c in unsettled))
        closer = schedule.with_name(f"{schedule.stem}_closer.yaml")
        return Headline(
            says, rests, pasted("schedule", "design", models, *_designed_with(known), "--speeds", speeds, "-o", closer)
        )
    redesigned = schedule.with_name(f"{schedule.stem}_slower.yaml")
    required = (g.wanted for g in result.gates if g.name == "phase_margin_deg" and not g.passed)
    margin = max(required, default=WIDE_MARGIN)
    if isfinite(result.worst["phase_margin_deg"]) and result.worst["phase_margin_deg"] >= margin:
        to = () if is_trial(Path()) else ("-o", "plan")
        return Headline(says, rests, pasted("plan", "--axis", result.axis.value, "--model", models[0], *to))
    wider = ("--phase-margin", f"{margin:g}", "-o", redesigned)
    return Headline(says, rests, pasted("schedule", "design", models, *_designed_with(known), *wider))


def _designed_with(schedule: Schedule) -> list[str]:
    """Return the options of a design that differ from the defaults, without those of rows and phase margin."""
    wish, step = schedule.wish, schedule.wish.step_of(schedule.axis)
    stated = {
        "--controller": wish.kind,  # the default depends on the models
        "--step": None if step == STEP_ANGLE_RAD[schedule.axis] else f"{degrees(step):.3g}deg",
        "--settling": None if wish.settling is None else f"{wish.settling:g}s" if wish.settling > QUICKEST else "quickest",
        "--bandwidth": None if wish.bandwidth is None else f"{wish.bandwidth:g}rad/s",
        "--overshoot": None if wish.overshoot is None else f"{100.0 * wish.overshoot:g}%",
        "--fin-use": None if wish.fin_use is None else f"{100.0 * wish.fin_use:g}%",
        "--fin-max": None if is_trial(Path()) else f"{max(schedule.column('fin_limit_rad')):.6g}",
    }
    depth = ["--depth"] if schedule.depth else []
    return depth + [word for option, value in stated.items() if value is not None for word in (option, value)]


def headline_of_export(result: Exported, schedule: Path) -> Headline:
    """Return what was written for the vehicle, to a file or to standard output."""
    rests = "the gains as they were designed; an export verifies nothing"
    if result.file is None:
        from fieldsid.exports import pick_target

        name = f"{schedule.stem}_{result.target}{pick_target(result.target).suffix}"
        return Headline(f"{schedule} as {result.target}, on standard output", rests, typed_with("-o", name))
    report = pasted("report", *(("--force",) if Path("report.html").exists() else ()))
    return Headline(f"{schedule} written as {result.target}: {result.file}", rests, report)


def headline_of_patch(result: Exported, schedule: Path, key: str) -> Headline:
    """Return how many lines of an existing file the gains change, or have changed."""
    changes = [line for line in result.difference.splitlines() if line[:1] == "+" and line[:3] != "+++"]
    rests = f"{schedule}, its gains as they were designed; an export verifies nothing"
    if not changes:
        return Headline(f"{result.file} holds these gains at {key} already", rests, pasted("status"))
    lines = counted(len(changes), "line")
    if result.backup is None:
        return Headline(f"{lines} of {result.file} would change at {key}; nothing was changed", rests, typed_with("--write"))
    return Headline(f"{lines} of {result.file} changed at {key}; as it was: {result.backup}", rests, pasted("status"))
