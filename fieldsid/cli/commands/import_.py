"""sysid import: a clean Run: SI, one frame, one clock, quality notes."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from fieldsid.cli import options
from fieldsid.cli.console import Body, emit, one_of_each_kind, say, tracked, warn
from fieldsid.cli.options import argument, flag, option
from fieldsid.cli.voice import voice

if TYPE_CHECKING:
    from fieldsid.cli.skipped_logs import Skips
    from fieldsid.logs.importing import Importer
    from fieldsid.logs.run import Run


class Options(options.Options):
    """What `sysid import` takes."""

    logs: list[Path] = argument("LOG...", "Logs: tables, bags, MATLAB, MOOS, PX4, ArduPilot, gliders.")
    output: Path = option("-o --output DIR|FILE", "Folder for the runs, or the file of a single one.", default=...)
    join: bool = options.JOIN
    mapping: Path | None = options.MAPPING
    channel: list[str] | None = option(
        "--channel SIGNAL=COLUMN:UNIT", "Map one signal; counts more than the mapping; may repeat."
    )
    msg_path: Path | None = options.MSG_PATH
    vehicle: Path | None = options.VEHICLE
    start: float | None = options.START
    end: float | None = options.END
    max_gap: float = option("--max-gap S", "Longest gap of a main signal, or 5 of its own steps.", default=2.0, min=0.0)
    salvage: bool = flag("--salvage", "Take what is left of a damaged log: cut gzip, bad cells, time out of order.")
    whole: bool = flag("--whole", "Keep what is not under way: on deck, at the surface, idle; one run for each log.")
    format_: str = option("--format parquet|csv|csv.gz", "Kind of file in the folder.", default="parquet")
    force: bool = options.FORCE


@options.takes(Options)
def command(given: Options) -> Body:
    """Turn logs into Runs: SI and radians, NED and forward-starboard-down, one clock, gaps left as gaps.

    What is not under way is left out, and said; several stretches of one log are runs of their own.

    Example: sysid import run7.mcap --mapping mapping.yaml -o runs/
    """
    from fieldsid.artifacts import check_output
    from fieldsid.cli.headlines.logs import headline_of_import
    from fieldsid.cli.skipped_logs import Skips
    from fieldsid.logs.importing import Importer
    from fieldsid.logs.segments import plane_of
    from fieldsid.page import Block, Page
    from fieldsid.results.logs import Import

    importer, logs = _importer(given)
    is_usual = not given.force and importer == Importer(importer.mapping)
    imported = _already_imported(importer, logs, given) if is_usual else []
    logs, skips = [log for log in logs if log not in imported], Skips()
    targets = dict(zip(logs, importer.targets(logs, given.output, given.format_, force=given.force), strict=True))
    read = _read(importer, logs, given.vehicle, skips)
    placed = [pair for log, runs in read for pair in zip(runs, importer.places(targets[log], len(runs)), strict=True)]
    for _, place in placed:
        check_output(place, force=given.force)
    done = [importer.write(run, place, force=given.force) for run, place in placed]
    result = Import(runs=tuple(done), already_imported=tuple(map(str, imported)), skipped_runs=tuple(skips.records))
    notes = one_of_each_kind(((n.code, n.data.get("signal")), item.run.name, n) for item in done for n in item.warnings)
    headline = headline_of_import(result, plane_of([d.run for d in done]))
    rows = tuple((d.file, str(d.samples), f"{d.duration_s:.2f}", f"{d.rate_hz:.4g}", str(len(d.signals))) for d in done)
    page = Page("", blocks=(Block("", rows, ("run", "samples", "s", "Hz", "signals")),))
    body = emit(result, render=page, headline=headline, notes=notes)
    if voice().is_json:  # a run is used for a long time: its warnings go to stderr in JSON mode too
        warn(notes)
    return skips.end(body, len(done))


def _importer(given: Options) -> tuple[Importer, list[Path]]:
    """Return how the logs are read, and the logs without the further tables of a run that are joined to the first."""
    from fieldsid.cli.inputs import mapping_of, one_run
    from fieldsid.logs.convert.assemble import part_between
    from fieldsid.logs.importing import Importer

    logs = one_run("import", given.logs, join=True)[:1] if given.join else given.logs
    part, joined = part_between(given.start, given.end), tuple(given.logs[1:]) if given.join else ()
    mapping, channels = mapping_of(given.mapping), tuple(given.channel or ())
    return Importer(mapping, channels, given.msg_path, part, given.max_gap, given.salvage, given.whole, joined), logs


def _read(importer: Importer, logs: Sequence[Path], vehicle: Path | None, skips: Skips) -> list[tuple[Path, list[Run]]]:
    """Return each log with its runs, without those that cannot be read; say on stderr how they were read."""
    from fieldsid.cli.inputs import say_how_read
    from fieldsid.face.arguments import vehicle_of
    from fieldsid.logs.several.run_names import refuse_twice
    from fieldsid.logs.several.sifting import attempt, sifted

    limits, shown = vehicle_of(vehicle).signal_limits, tracked(logs, "reading")
    outcomes = (attempt(lambda log_and_bar: importer.read(log_and_bar[0], limits, log_and_bar[1]), pair) for pair in shown)
    read = sifted(logs, outcomes, skips.skip) if logs else []
    runs = [run for _, found in read for run in found]
    refuse_twice(runs, [log for log, found in read for _ in found])
    say_how_read(runs, several=len(logs) > 1, also=("ignored_columns",))
    return read


def _already_imported(importer: Importer, logs: Sequence[Path], given: Options) -> list[Path]:
    """Return the logs whose runs exist and were made from the same bytes of the log and of its mapping; say so on stderr."""
    from fieldsid.records.named_inputs import sha256_of_named
    from fieldsid.trial_folder.state import run_head

    def is_imported(log: Path, target: Path) -> bool:
        place = target if target.exists() else importer.places(target, 2)[0]
        head = run_head(place) if place.name.endswith(".parquet") and place.is_file() else None
        made_of = {e["path"]: e["sha256"] for e in (head or {}).get("inputs") or ()}
        read = {str(log), *([str(given.mapping)] if given.mapping is not None else [])}
        return read <= made_of.keys() and all(sha256_of_named(Path(p)) == known for p, known in made_of.items())

    pairs = zip(logs, importer.targets(logs, given.output, given.format_, force=True), strict=True)
    found = [log for log, target in pairs if is_imported(log, target)]
    if found:
        say(f"already imported: {', '.join(map(str, found))}")
    return found
