"""sysid demo: all of it on a trial that it makes itself, with a hidden effect."""

from __future__ import annotations

import os
import shlex
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, nullcontext, redirect_stderr, redirect_stdout
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING

from fieldsid.cli.app import run
from fieldsid.cli.console import WIDTH, Body, emit
from fieldsid.cli.headlines.trial import headline_of_demo
from fieldsid.cli.options import FOLDER, FORCE, flag, option
from fieldsid.cli.progress import compiling
from fieldsid.cli.session import Session
from fieldsid.cli.voice import voice
from fieldsid.errors import ArtifactError, UsageError
from fieldsid.page import Page, folded, written
from fieldsid.runtime.background_tasks import BackgroundTasks

if TYPE_CHECKING:
    from fieldsid.demo.steps import Step
    from fieldsid.demo.trial import Trial
    from fieldsid.fitting.jit_warmup import Warmup
    from fieldsid.planning.design.leg import Leg
    from fieldsid.results.trial import Demo
    from fieldsid.results.trial import Step as StepResult

HIDDEN = "servo_lag"
OWN_FOLDER = "sysid-demo"

OPENING = (
    "A small vehicle waits on deck. Its dynamics hold one effect more than the textbook's model; the commands below do not know "
    "which. The first one asks what to fly."
)

SHORT_OPENING = (
    "A small vehicle waits on deck, with one effect more than the textbook's model. Each line is one command; "
    "`sysid demo --verbose` prints them with all they say."
)
BRIEF, VERBOSE, SILENT = "brief", "verbose", "silent"
"""How much of the tour is printed while it runs: a line for each command, all that they print, or nothing."""


def command(
    effect: str = option("--effect NAME", "The effect to hide: see `sysid effects list`.", default=HIDDEN),
    output: Path | None = FOLDER,
    verbose: bool = flag("--verbose -v", "Print each command with all that it says, and what it means."),
    force: bool = FORCE,
) -> Body:
    """Take a tour of all commands: a line for each with its result, or with `--verbose` all that they say and what it means.

    The program plans a maneuver, flies it and a few others with a vehicle whose dynamics hold one effect more than the
    textbook's, and works on the logs like a user who does not know. The files and figures stay in DIR, ./sysid-demo if not given.

    Example: sysid demo --effect sway_coupling -o tour
    """
    began = perf_counter()
    detail = SILENT if voice().is_json or voice().is_quiet else VERBOSE if verbose else BRIEF
    with compiling(_compile_loops) as warmup:
        tour = _tour(effect, output, began, warmup, force=force, detail=detail)
    if detail != SILENT:
        sys.stdout.write("\n")
    figures = written(figure=[f for f in tour.files if verbose and f.endswith(".png")])
    page = Page("", closing=(*figures, "`sysid --help` lists every command."))
    return emit(tour, render=page, headline=headline_of_demo(tour))


def _tour(effect: str, output: Path | None, began: float, warmup: Warmup, *, force: bool, detail: str) -> Demo:
    """Run every step of the tour in its folder and return the record of it; began: the time at which the command started."""
    from fieldsid.demo.steps import PLAN, STEPS, places
    from fieldsid.demo.trial import make_trial
    from fieldsid.demo.vehicle import hidden_vehicle
    from fieldsid.planning.output.plan_file import load_plan
    from fieldsid.results.trial import Demo, Hidden

    folder = _folder(output, force=force)
    vehicle = hidden_vehicle(effect)
    known = dict(places(folder, vehicle.axis))
    _write_text(OPENING if detail == VERBOSE else SHORT_OPENING, detail)
    with BackgroundTasks() as tasks:
        session = Session(warmup, tasks)
        done = [_run_step(1, PLAN, known, session, force=force, detail=detail)]
        (leg,) = load_plan(folder / "plan" / "plan.yaml").legs
        trial = make_trial(vehicle, folder / "trial", leg, force=force)
        if detail == VERBOSE:
            _write_text(_flights_in_words(trial, folder, leg), detail)
        for step in (s for s in STEPS if vehicle.axis in s.axes):
            if step.possible(known):
                done.append(_run_step(len(done) + 1, step, known, session, force=force, detail=detail))
                known |= step.learns(done[-1].result or {})
    return Demo(
        folder=str(folder),
        hidden=Hidden(effect, vehicle.axis, vehicle.values),
        named=tuple(known["effects"].split(",")) if "effects" in known else (),
        steps=tuple(done),
        files=tuple(sorted(str(p) for p in folder.rglob("*") if p.is_file())),
        seconds=perf_counter() - began,
    )


def _compile_loops() -> None:
    from fieldsid.schedule.flown.jit_warmup import compile_loops

    compile_loops()


def _folder(output: Path | None, *, force: bool) -> Path:
    """Return the folder to work in: the given one, or the first of sysid-demo, sysid-demo-2, ... that does not exist.

    Raises ArtifactError where the given one is not empty, unless forced.
    """
    if output is None:
        numbered = (Path(f"{OWN_FOLDER}-{i}") for i in range(2, 10_000))
        return next(p for p in (Path(OWN_FOLDER), *numbered) if not p.exists())
    if output.is_dir() and any(output.iterdir()) and not force:
        raise ArtifactError(
            f"`{output}` is not empty",
            found=f"{sum(1 for _ in output.iterdir())} entries",
            hint="add `--force`, or name another folder",
        )
    return output


def _run_step(place: int, step: Step, known: Mapping[str, str], session: Session, *, force: bool, detail: str) -> StepResult:
    """Run the command of one step of the tour, print as much of it as the detail asks for, and return its record."""
    from fieldsid.demo.steps import expanded, words_of
    from fieldsid.results.trial import Step as StepResult

    words = words_of(step.line, known)
    if detail == VERBOSE:
        sys.stdout.write(f"\n{place}. {step.title}\n$ sysid {' '.join(words)}\n\n")
        sys.stdout.flush()
    began = perf_counter()
    with nullcontext() if detail == VERBOSE else _silence():
        result = run([*expanded(words), *(["--force"] if force else [])], session)
    sys.stderr.flush()
    if isinstance(result, int):
        raise UsageError(
            f"the tour ends at its step {place}, which could not use all logs",
            found=f"`{shlex.join(['sysid', *words])}` ended with exit code {result}",
            hint="run that command to see why, or hide another effect",
        )
    brief, meaning = step.tells(result)
    if detail == BRIEF:
        said = f"{place:2d}. {step.title}{'' if step.title.endswith('?') else ':'} {brief}"
        sys.stdout.write(f"{folded(said, WIDTH, rest='    ')}\n")
        sys.stdout.flush()
    if detail == VERBOSE:
        sys.stdout.write(f"\n{folded(meaning, WIDTH, first='=> ', rest='   ')}\n")
        sys.stdout.flush()
    return StepResult("sysid " + " ".join(words), perf_counter() - began, meaning, result)


@contextmanager
def _silence() -> Iterator[None]:
    with open(os.devnull, "w", encoding="utf-8") as nowhere, redirect_stdout(nowhere), redirect_stderr(nowhere):  # noqa: PTH123
        yield


def _write_text(text: str, detail: str) -> None:
    if detail != SILENT:
        sys.stdout.write(f"\n{folded(text, WIDTH, rest='')}\n" + ("\n" if detail == BRIEF else ""))
        sys.stdout.flush()


def _flights_in_words(trial: Trial, folder: Path, leg: Leg) -> str:
    from fieldsid.demo.trial import CHECK_SPEEDS, TRAIN_SPEEDS

    others = " and ".join(f"{u:.1f}" for u in TRAIN_SPEEDS if u != leg.speed)
    judging = " and ".join(f"{u:.1f}" for u in CHECK_SPEEDS)
    return (
        f"The vehicle flies it at {leg.speed:.1f} m/s and {trial.learning} at {others} m/s, to learn from, then "
        f"{trial.judging} at {judging} m/s, to judge by. Its logs are in {folder}/trial."
    )
