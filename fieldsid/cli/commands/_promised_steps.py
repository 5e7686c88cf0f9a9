"""`sysid compare GAINS RUN...`: the steps that were flown with a schedule against the bounds that its verification predicts."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING

from fieldsid.cli.console import Body, emit
from fieldsid.cli.headlines.headline import Headline
from fieldsid.cli.headlines.typed import pasted
from fieldsid.cli.voice import angles
from fieldsid.logs.several.sifting import attempt, sifted
from fieldsid.page import Block, Page, counted

if TYPE_CHECKING:
    from fieldsid.change.promise import KeptStep


def compare_steps(gains: Path, runs: Sequence[Path], reading: Body) -> Body:
    """Compare each step flown in the runs with the bounds that `schedule verify` gives, print that and return the JSON body.

    reading: the keyword arguments of `read_runs` (mapping, start, end). A run without a usable step is skipped; raises DataError
    where none has one.
    """
    from fieldsid.change.promise import kept_steps
    from fieldsid.cli.inputs import read_runs
    from fieldsid.cli.skipped_logs import Skips
    from fieldsid.face.arguments import designed_from, runs_of_models
    from fieldsid.plant.parameter_source import load_parameter_source
    from fieldsid.results.comparisons import AsPromised
    from fieldsid.schedule.record import load_schedule
    from fieldsid.schedule.verify import plants_behind

    schedule, skips = load_schedule(gains), Skips()
    source = load_parameter_source(designed_from(schedule, str(gains)))
    logs = read_runs(runs, models=source.paths, refused=skips.skip, **reading)
    plants = plants_behind(schedule, source, runs_of_models(source))
    compared = sifted(logs, (attempt(partial(kept_steps, schedule, plants), run) for run in logs), skips.skip)
    steps = [step for _, found in compared for step in found]
    result = AsPromised(gains=str(gains), axis=schedule.axis, steps=tuple(steps), skipped_runs=tuple(skips.records))
    headline = _headline(gains, source.paths, runs, steps)
    return skips.end(emit(result, render=_page(steps), headline=headline), len(compared))


def _headline(gains: Path, models: Sequence[Path], runs: Sequence[Path], steps: Sequence[KeptStep]) -> Headline:
    from fieldsid.change.promise import worst_of

    worst, (_, unit) = worst_of(steps), angles().of("rad")
    broken = [s for s in steps if s.broken]
    overshoot, settled, steady = _cells(worst)
    how = f"overshoot {overshoot} %, settled in {settled}, steady error {steady} {unit}"
    if broken:
        says = f"not as promised in {', '.join(worst.broken)}, {len(broken)} of {counted(len(steps), 'step')}: {worst.run} at "
        says += f"{worst.start:.1f} s, {how}"
        next_ = pasted("compare", models[0], runs)
    else:
        says, next_ = f"as promised, {counted(len(steps), 'step')}: the worst has {how}", pasted("report")
    return Headline(says, f"{gains}; in brackets what 95 % of the draws of its models stay within", next_)


def _cells(step: KeptStep) -> tuple[str, str, str]:
    """Return overshoot (%), settling and steady error of a step, in brackets the most that was promised."""
    flown, most, times = step.flown, step.promised, angles().of("rad")[0]
    return (
        f"{100 * flown.overshoot:.0f} ({100 * most.overshoot_most:.0f})",
        f"{_seconds(flown.settling)} ({_seconds(most.settling_most)})",
        f"{times * abs(flown.steady_error):.2g} ({times * most.off:.2g})",
    )


def _seconds(value: float) -> str:
    return f"{value:.1f} s" if isfinite(value) else "never"


def _page(steps: Sequence[KeptStep]) -> Page:
    times, unit = angles().of("rad")
    rows = tuple(
        (
            s.run,
            f"{s.start:.1f}",
            f"{s.speed:.2f}",
            f"{times * s.size:.3g}",
            *_cells(s),
            ", ".join(s.broken) or "as promised",
        )
        for s in steps
    )
    heads = ("run", "s", "m/s", f"step, {unit}", "overshoot, %", "settled", f"steady, {unit}", "")
    return Page("", blocks=(Block("flown, in brackets at most promised", rows, heads),))
