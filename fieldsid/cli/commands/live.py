"""sysid live: the recursive estimate as the vehicle flies, and "enough data, come up"."""

from __future__ import annotations

import sys
import time as clock
from collections.abc import Callable, Iterator, Mapping
from contextlib import closing, contextmanager
from dataclasses import dataclass
from math import inf, isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from fieldsid.cli.console import emit, out, say
from fieldsid.cli.exit_codes import GATE_FAILED
from fieldsid.cli.live.feed import Feed
from fieldsid.cli.options import AxisOption, Bandwidth, MappingFile, VehicleFile, argument, flag, option
from fieldsid.cli.voice import voice
from fieldsid.errors import UsageError

if TYPE_CHECKING:
    from rich.console import Console

    from fieldsid.cli.live.beside import Beside
    from fieldsid.online.identifier import OnlineIdentifier
    from fieldsid.online.progress import Goal, Watch

SOURCE, GOAL, BESIDE = "Where the samples come from", "What is to be reached", "What a second process works out"
"""The groups of its own options on the page of help."""


SAVE_EVERY_S = 1.0


def command(
    axis: AxisOption,
    log: Annotated[Path | None, argument("LOG", "A log to replay or follow; `-` reads JSON lines from standard input.")] = None,
    speed: Annotated[
        float, option("--speed", "FACTOR", "How many times as fast as logged to replay; 0 does not wait.", SOURCE, min=0.0)
    ] = 1.0,
    follow: Annotated[bool, flag("--follow -f", "Go on as the log grows: CSV, MCAP, a bag's folder.", SOURCE)] = False,
    udp: Annotated[
        int | None, option("--udp", "PORT", "Take JSON lines as UDP on this machine.", SOURCE, min=1, max=65535)
    ] = None,
    idle: Annotated[float | None, option("--idle", "S", "End when nothing has come for so long.", SOURCE, min=0.1)] = None,
    plan: Annotated[Path | None, option("--plan", "YAML", "The accuracy to reach is what this plan promised.", GOAL)] = None,
    want: Annotated[str | None, option("--want", "A=5%,...", "The accuracy to reach; 5 % of each but the trim.", GOAL)] = None,
    state: Annotated[Path | None, option("--state", "FILE", "Go on from this file, if there; saved every second.")] = None,
    every: Annotated[float, option("--every", "S", "Seconds of the log between two looks.", min=0.1)] = 1.0,
    until_enough: Annotated[
        bool, flag("--until-enough", "End at enough data; exit code 1 where that is not reached.", GOAL)
    ] = False,
    gains: Annotated[bool, flag("--gains", "Design gains for the speed that is flown, once settled.", BESIDE)] = False,
    schedule: Annotated[
        Path | None, option("--schedule", "YAML", "The gains loaded, and what they were designed for.", BESIDE)
    ] = None,
    depth: Annotated[bool, flag("--depth", "With the depth loop above pitch.", BESIDE)] = False,
    diagnose: Annotated[bool, flag("--diagnose", "Diagnose what was flown whenever a maneuver ends.", BESIDE)] = False,
    vehicle: VehicleFile = None,
    bandwidth: Bandwidth = 4.0,
    forgetting: Annotated[float, option("--forgetting", "", "Forgetting factor; 1 forgets nothing.", min=0.5, max=1.0)] = 1.0,
    mapping: MappingFile = None,
) -> Mapping[str, Any]:
    """Identify while the vehicle flies, sample by sample, and say when there is enough data.

    Replays a log, follows one that grows, or takes JSON lines: `{"time_s": 1.25, "rudder_deg": 5, "yaw_deg": 91}`.
    `--json` prints one object a look, a line each. With `--state` a program that was killed goes on where it was. A jump of the
    fin's authority, as by a payload or a linkage that slipped, is told, and the estimate begins anew. `--gains` designs as
    `schedule design` does and says which of the loaded gains to change; `--diagnose` says what `diagnose` does, and what to fly
    next.

    Example: sysid live run7.csv --axis yaw --speed 10 --plan plan.yaml
    """
    _check_source(log, udp, follow=follow)
    feed = Feed(axis, log, speed if speed > 0.0 else inf, follow, udp, inf if idle is None else idle, mapping)
    goals, goals_from = _goals(axis, plan, want)
    beside = _beside(feed, (schedule, vehicle, depth) if gains or schedule else None, diagnose=diagnose)
    from fieldsid.online.progress import Watch

    watch = Watch(goals(float("nan")))
    identifier, skipped = _begun(feed, state, watch, bandwidth, forgetting)
    live = _Live(feed, identifier, watch, goals, goals_from, state, beside)
    body: Mapping[str, Any] = {}
    with _shown() as show:
        try:
            for body in live.looks(every, skipped):
                show(body)
                if until_enough and body["verdict"] == "enough":
                    break
        except KeyboardInterrupt:
            if not body:
                raise
        finally:
            if beside is not None:
                beside.close()
            live.save()
    if not voice().is_json:
        _end(body)
    if until_enough and body["verdict"] != "enough":
        raise typer.Exit(GATE_FAILED)
    return body


def _check_source(log: Path | None, udp: int | None, *, follow: bool) -> None:
    if (log is None) == (udp is None):
        raise UsageError(
            "give either a log or `--udp PORT`",
            found="both" if log is not None else "neither",
            hint="`sysid live run7.csv --axis yaw`, or `sysid live - --axis yaw` for lines on standard input",
        )
    if follow and (log is None or str(log) == "-"):
        raise UsageError(
            "`--follow` needs a log", found="`--udp`" if log is None else "`-`", hint="name the log, or leave it out"
        )


def _goals(axis: AxisOption, plan: Path | None, want: str | None) -> tuple[Callable[[float], Mapping[str, Goal]], str]:
    """Return the goals at a speed in m/s, and where they are from."""
    from fieldsid.online.goals import planned_goals, requested_goals
    from fieldsid.online.progress import DEFAULT_ACCURACY, default_goals

    if plan is not None and want is not None:
        raise UsageError("`--plan` and `--want` both say what is to be reached", found=want, hint="leave one of them out")
    if plan is not None:
        from fieldsid.planning.output.plan_file import load_plan

        promised = load_plan(plan)
        planned_goals(promised, axis, float("nan"))
        return (lambda speed: planned_goals(promised, axis, speed)), f"`{plan}`"
    if want is not None:
        asked = requested_goals(axis, want)
        return (lambda _speed: asked), "`--want`"
    return (lambda _speed: default_goals(axis)), f"{100.0 * DEFAULT_ACCURACY:.0f} % of each value"


def _beside(feed: Feed, gains: tuple[Path | None, Path | None, bool] | None, *, diagnose: bool) -> Beside | None:
    """Return what works beside the estimate: gains of a schedule, a vehicle, with depth or not, and a diagnosis."""
    if gains is None and not diagnose:
        return None
    from fieldsid.cli.live.beside import Beside, wanted_at

    feed.keeps = True
    waits = feed.is_log and not feed.follow and not isfinite(feed.factor)
    wanted = None if gains is None else wanted_at(feed.axis, *gains)
    return Beside(feed.axis, feed.flown, wanted, diagnoses=diagnose, waits=waits)


def _begun(feed: Feed, state: Path | None, watch: Watch, bandwidth: float, forgetting: float) -> tuple[OnlineIdentifier, float]:
    """Return the identifier, from its state where there is one, and the time up to which the source is known to it."""
    from fieldsid.online.identifier import OnlineIdentifier
    from fieldsid.online.state_file import load_state

    if state is None or not state.exists():
        return OnlineIdentifier(feed.axis, bandwidth=bandwidth, forgetting=forgetting), -inf
    identifier, source = load_state(state, feed.axis, watch)
    say(f"going on from `{state}`: {identifier.estimate().used} samples up to {identifier.time:.1f} s of `{source}`")
    if feed.is_log and source == feed.name and isfinite(identifier.time):
        return identifier, identifier.time
    watch.forget()
    if source != feed.name:
        identifier.begin_again()
    return identifier, -inf


@dataclass(frozen=True, slots=True)
class _Live:
    """What is under way: samples, estimate, goals at a speed and their source, the file of its state, the second process."""

    feed: Feed
    identifier: OnlineIdentifier
    watch: Watch
    goals: Callable[[float], Mapping[str, Goal]]
    goals_from: str
    state: Path | None
    beside: Beside | None

    def looks(self, every: float, after: float) -> Iterator[Mapping[str, Any]]:
        """Yield a look every so many seconds of the log, one when it ends, and save the state as time goes on."""
        due, saved, fresh, unreadable = -inf, clock.monotonic(), True, 0
        with closing(self.feed.samples(after)) as samples:  # type: ignore[type-var]
            for sample in samples:
                if sample is None:
                    continue
                self.identifier.update(*sample[:5], fin_is_held=sample.fin_is_held, fin_line=sample.fin_line)
                self.watch.excitation.hear(sample.time, sample.fin, sample.rate)
                fresh = True
                if self.beside is not None:
                    self.beside.hear(sample)
                if sample.time >= due or sample.time < due - 2.0 * every:
                    due = sample.time + every
                    yield self.look()
                    fresh, unreadable = False, self.feed.unreadable
                if clock.monotonic() - saved >= SAVE_EVERY_S:
                    self.save()
                    saved = clock.monotonic()
        if fresh or self.feed.unreadable > unreadable or self.beside is not None:
            yield self.look(ended=True)

    def look(self, *, ended: bool = False) -> Mapping[str, Any]:
        """Return what there is to say now."""
        from fieldsid.online.look import look_body

        now = self.identifier.estimate()
        self.watch.goals = dict(self.goals(now.speed))
        progress = self.watch.look(now)
        then = self.feed.then(usable=not progress.contradiction)
        told: dict[str, Any] = {"source": self.feed.name, "goals_from": self.goals_from, "unreadable": self.feed.unreadable}
        if self.beside is not None:
            self.beside.look(now, progress, ended=ended)
            told |= {"gains": self.beside.gains, "diagnosed": self.beside.diagnosed}
        return look_body(now, progress, then=then, **told)

    def save(self) -> None:
        """Write the state, where it is to be kept."""
        from fieldsid.online.state_file import save_state

        if self.state is not None:
            save_state(self.state, self.identifier, self.watch, self.feed.name)


@contextmanager
def _shown() -> Iterator[Callable[[Mapping[str, Any]], None]]:
    """Yield what shows a look: a line of JSON, a screen on a terminal, else a line of text; nothing where it is to be quiet."""
    from fieldsid.cli.live.screen import line, screen, told_of

    if voice().is_json:
        import json

        def print_json(body: Mapping[str, Any]) -> None:
            sys.stdout.write(json.dumps(body, allow_nan=False) + "\n")
            sys.stdout.flush()

        yield print_json
        return
    console = out()
    if voice().is_quiet:
        yield lambda _body: None
        return
    if not console.is_terminal:
        told: list[str] = []

        def print_line(body: Mapping[str, Any]) -> None:
            console.print(line(body), soft_wrap=True)
            for text in told_of(body):
                if text not in told:
                    console.print(f"{'':12}{text}", soft_wrap=True)
            told[:] = told_of(body)

        yield print_line
        return
    from rich.live import Live

    with Live(console=console, auto_refresh=False, transient=True) as live:
        yield lambda body: live.update(screen(body), refresh=True)


def _end(body: Mapping[str, Any]) -> None:
    from fieldsid.cli.live.screen import Parameters, headline_of, told_of

    def render(to: Console) -> None:
        to.print(Parameters(body))
        for text in told_of(body):
            to.print(text, soft_wrap=True)

    if body:
        emit(body, render=render, headline=headline_of(body))
