"""sysid live: the recursive estimate as the vehicle flies, and "enough data, come up"."""

from __future__ import annotations

import sys
import time as clock
from collections.abc import Callable, Iterator, Mapping
from contextlib import closing, contextmanager
from dataclasses import dataclass
from math import inf, isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fieldsid.cli import options
from fieldsid.cli.console import Body, emit, gated, out, say
from fieldsid.cli.live.feed import Feed
from fieldsid.cli.options import argument, flag, option
from fieldsid.cli.voice import voice
from fieldsid.errors import UsageError
from fieldsid.models.axis import Axis

if TYPE_CHECKING:
    from rich.console import Console

    from fieldsid.cli.live.background_analysis import BackgroundAnalysis
    from fieldsid.online.identifier import OnlineIdentifier
    from fieldsid.online.progress import Goal, Watch

SOURCE, GOAL, SECOND_PROCESS = "Where the samples come from", "What is to be reached", "What a second process works out"
"""Groups of the options that only this command has, on its page of help."""


SAVE_EVERY_S = 1.0


class Options(options.Options):
    """What `sysid live` takes."""

    axis: Axis = options.AXIS
    log: Path | None = argument("LOG", "A log to replay or follow; `-` reads JSON lines from standard input.", None)
    speed: float = option(
        "--speed FACTOR", "How many times as fast as logged to replay; 0 does not wait.", SOURCE, default=1.0, min=0.0
    )
    follow: bool = flag("--follow -f", "Go on as the log grows: CSV, MCAP, a bag's folder.", SOURCE)
    udp: int | None = option("--udp PORT", "Take JSON lines as UDP on this machine.", SOURCE, min=1, max=65535)
    idle: float | None = option("--idle S", "End when nothing has come for so long.", SOURCE, min=0.1)
    plan: Path | None = option("--plan YAML", "The accuracy to reach is what this plan promised.", GOAL)
    want: str | None = option("--want A=5%,...", "The accuracy to reach; 5 % of each but the trim.", GOAL)
    state: Path | None = option("--state FILE", "Go on from this file, if there; saved every second.")
    every: float = option("--every S", "Seconds of the log between two looks.", default=1.0, min=0.1)
    until_enough: bool = flag("--until-enough", "End at enough data; exit code 1 where that is not reached.", GOAL)
    gains: bool = flag("--gains", "Design gains for the speed that is flown, once settled.", SECOND_PROCESS)
    schedule: Path | None = option("--schedule YAML", "The gains loaded, and what they were designed for.", SECOND_PROCESS)
    depth: bool = flag("--depth", "With the depth loop above pitch.", SECOND_PROCESS)
    diagnose: bool = flag("--diagnose", "Diagnose what was flown whenever a maneuver ends.", SECOND_PROCESS)
    vehicle: Path | None = options.VEHICLE
    bandwidth: float = options.BANDWIDTH
    forgetting: float = options.FORGETTING
    mapping: Path | None = options.MAPPING


@options.takes(Options)
def command(given: Options) -> Body:
    """Identify while the vehicle flies, sample by sample, and say when there is enough data.

    Replays a log, follows one that grows, or takes JSON lines: `{"time_s": 1.25, "rudder_deg": 5, "yaw_deg": 91}`.
    `--json` prints one object a look, a line each. With `--state` a program that was killed goes on where it was. A jump of the
    fin's authority, as by a payload or a linkage that slipped, is told, and the estimate begins anew. `--gains` designs as
    `schedule design` does and says which of the loaded gains to change; `--diagnose` says what `diagnose` does, and what to fly
    next.

    Example: sysid live run7.csv --axis yaw --speed 10 --plan plan.yaml
    """
    _check_source(given)
    goals, goals_from = _goals(given)
    from fieldsid.online.progress import Watch

    factor, idle_s = given.speed if given.speed > 0.0 else inf, inf if given.idle is None else given.idle
    feed = Feed(given.axis, given.log, factor, given.follow, given.udp, idle_s, given.mapping)
    analysis = _analysis(feed, given)
    watch = Watch(goals(float("nan")))
    identifier, known_until = _identifier(feed, watch, given)
    live = _Live(feed, identifier, watch, goals, goals_from, given.state, analysis)
    body: Body = {}
    with _display() as show:
        try:
            for body in live.looks(given.every, known_until):
                show(body)
                if given.until_enough and body["verdict"] == "enough":
                    break
        except KeyboardInterrupt:
            if not body:
                raise
        finally:
            if analysis is not None:
                analysis.close()
            live.save()
    if not voice().is_json:
        _end(body)
    return gated(body, failed=given.until_enough and body["verdict"] != "enough")


def _check_source(given: Options) -> None:
    if (given.log is None) == (given.udp is None):
        raise UsageError(
            "give either a log or `--udp PORT`",
            found="both" if given.log is not None else "neither",
            hint="`sysid live run7.csv --axis yaw`, or `sysid live - --axis yaw` for lines on standard input",
        )
    if given.follow and (given.log is None or str(given.log) == "-"):
        found = "`--udp`" if given.log is None else "`-`"
        raise UsageError("`--follow` needs a log", found=found, hint="name the log, or leave it out")


def _goals(given: Options) -> tuple[Callable[[float], Mapping[str, Goal]], str]:
    """Return the goals at a speed in m/s, and where they are from."""
    from fieldsid.online.goals import planned_goals, requested_goals
    from fieldsid.online.progress import DEFAULT_ACCURACY, default_goals

    axis, plan, want = given.axis, given.plan, given.want
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


def _analysis(feed: Feed, given: Options) -> BackgroundAnalysis | None:
    """Return what designs gains and diagnoses in other processes; None where neither is asked for."""
    designs = given.gains or given.schedule is not None
    if not designs and not given.diagnose:
        return None
    from fieldsid.cli.live.background_analysis import BackgroundAnalysis, wanted_at

    feed.keeps = True
    waits = feed.is_log and not feed.follow and not isfinite(feed.factor)
    wanted = wanted_at(feed.axis, given.schedule, given.vehicle, given.depth) if designs else None
    return BackgroundAnalysis(feed.axis, feed.flown, wanted, diagnoses=given.diagnose, waits=waits)


def _identifier(feed: Feed, watch: Watch, given: Options) -> tuple[OnlineIdentifier, float]:
    """Return the identifier, from its state file where there is one, and the time (s) up to which it has used the source.

    The time is -inf where it has used nothing of this source.
    """
    from fieldsid.online.identifier import OnlineIdentifier
    from fieldsid.online.state_file import load_state

    state = given.state
    if state is None or not state.exists():
        return OnlineIdentifier(feed.axis, bandwidth=given.bandwidth, forgetting=given.forgetting), -inf
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
    """A live identification: its samples, estimate, goals by speed and their source, state file and background analysis."""

    feed: Feed
    identifier: OnlineIdentifier
    watch: Watch
    goals: Callable[[float], Mapping[str, Goal]]
    goals_from: str
    state: Path | None
    analysis: BackgroundAnalysis | None

    def looks(self, every: float, after: float) -> Iterator[Body]:
        """Yield a look after every so many seconds of the log and one at its end; save the state every SAVE_EVERY_S seconds.

        after: the time in s up to which samples are passed over.
        """
        due, saved, fresh, unreadable = -inf, clock.monotonic(), True, 0
        with closing(self.feed.samples(after)) as samples:  # type: ignore[type-var]
            for sample in samples:
                if sample is None:
                    continue
                self.identifier.update(*sample[:5], fin_is_held=sample.fin_is_held, fin_line=sample.fin_line)
                self.watch.excitation.hear(sample.time, sample.fin, sample.rate)
                fresh = True
                if self.analysis is not None:
                    self.analysis.add(sample)
                if sample.time >= due or sample.time < due - 2.0 * every:
                    due = sample.time + every
                    yield self.look()
                    fresh, unreadable = False, self.feed.unreadable
                if clock.monotonic() - saved >= SAVE_EVERY_S:
                    self.save()
                    saved = clock.monotonic()
        if fresh or self.feed.unreadable > unreadable or self.analysis is not None:
            yield self.look(ended=True)

    def look(self, *, ended: bool = False) -> Body:
        """Return the JSON body of the estimate as it is now; ended: the source has ended."""
        from fieldsid.online.look import look_body

        now = self.identifier.estimate()
        self.watch.goals = dict(self.goals(now.speed))
        progress = self.watch.look(now)
        next_command = self.feed.next_command(usable=not progress.contradiction)
        details: dict[str, Any] = {"source": self.feed.name, "goals_from": self.goals_from, "unreadable": self.feed.unreadable}
        if self.analysis is not None:
            self.analysis.update(now, progress, ended=ended)
            details |= {"gains": self.analysis.gains, "diagnosed": self.analysis.diagnosed}
        return look_body(now, progress, then=next_command, **details)

    def save(self) -> None:
        """Write the state to its file, where one is named."""
        from fieldsid.online.state_file import save_state

        if self.state is not None:
            save_state(self.state, self.identifier, self.watch, self.feed.name)


@contextmanager
def _display() -> Iterator[Callable[[Body], None]]:
    """Yield a function that shows a look: a line of JSON, a screen on a terminal, else a line of text; nothing with `--quiet`."""
    from fieldsid.cli.live.screen import event_lines, line, screen

    if voice().is_json:
        import json

        def print_json(body: Body) -> None:
            sys.stdout.write(json.dumps(body, allow_nan=False) + "\n")
            sys.stdout.flush()

        yield print_json
        return
    console = out()
    if voice().is_quiet:
        yield lambda _body: None
        return
    if not console.is_terminal:
        printed: list[str] = []

        def print_line(body: Body) -> None:
            console.print(line(body), soft_wrap=True)
            for text in event_lines(body):
                if text not in printed:
                    console.print(f"{'':12}{text}", soft_wrap=True)
            printed[:] = event_lines(body)

        yield print_line
        return
    from rich.live import Live

    with Live(console=console, auto_refresh=False, transient=True) as live:
        yield lambda body: live.update(screen(body), refresh=True)


def _end(body: Body) -> None:
    from fieldsid.cli.live.screen import Parameters, event_lines, headline_of

    def render(to: Console) -> None:
        to.print(Parameters(body))
        for text in event_lines(body):
            to.print(text, soft_wrap=True)

    if body:
        emit(body, render=render, headline=headline_of(body))
