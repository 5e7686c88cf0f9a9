"""sysid import: a clean Run: SI, one frame, one clock, quality notes."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from fieldsid.cli.options import Force, FromS, Join, MappingFile, MsgPath, ToS, VehicleFile, argument, flag, option

if TYPE_CHECKING:
    from fieldsid.logs.importing import Importer


def command(
    logs: Annotated[list[Path], argument("LOG...", "Logs: tables, bags, MATLAB, MOOS, PX4, ArduPilot, gliders.")],
    output: Annotated[Path, option("-o --output", "DIR|FILE", "Folder for the runs, or the file of a single one.")],
    join: Join = False,
    mapping: MappingFile = None,
    channel: Annotated[
        list[str] | None, option("--channel", "SIGNAL=COLUMN:UNIT", "Map one signal; counts more than the mapping; may repeat.")
    ] = None,
    msg_path: MsgPath = None,
    vehicle: VehicleFile = None,
    from_s: FromS = None,
    to_s: ToS = None,
    max_gap: Annotated[float, option("--max-gap", "S", "Longest gap of a main signal, or 5 of its own steps.", min=0.0)] = 2.0,
    salvage: Annotated[
        bool, flag("--salvage", "Take what is left of a damaged log: cut gzip, bad cells, time out of order.")
    ] = False,
    whole: Annotated[
        bool, flag("--whole", "Keep what is not under way: on deck, at the surface, idle; one run for each log.")
    ] = False,
    format_: Annotated[str, option("--format", "parquet|csv|csv.gz", "Kind of file in the folder.")] = "parquet",
    force: Force = False,
) -> Mapping[str, Any]:
    """Turn logs into Runs: SI and radians, NED and forward-starboard-down, one clock, gaps left as gaps.

    What is not under way is left out, and said; several stretches of one log are runs of their own.

    Example: sysid import run7.mcap --mapping mapping.yaml -o runs/
    """
    from fieldsid.artifacts import check_output
    from fieldsid.cli.console import emit, one_of_each_kind, tracked, warn
    from fieldsid.cli.inputs import mapping_of, one_run, say_how_read
    from fieldsid.cli.skipped_logs import Skips
    from fieldsid.cli.voice import voice
    from fieldsid.face.arguments import vehicle_of
    from fieldsid.logs.convert.assemble import part_between
    from fieldsid.logs.importing import Importer
    from fieldsid.logs.several.run_names import refuse_twice
    from fieldsid.logs.several.sifting import attempt, sifted
    from fieldsid.page import Block, Page
    from fieldsid.results.logs import Import

    joined: list[Path] = []
    if join:
        logs, joined = logs[:1], one_run("import", logs, join=True)[1:]
    importer = Importer(
        mapping_of(mapping), tuple(channel or ()), msg_path, part_between(from_s, to_s), max_gap, salvage, whole, tuple(joined)
    )
    limits = vehicle_of(vehicle).signal_limits
    is_usual = not force and importer == Importer(importer.mapping)
    imported = _already_imported(importer, logs, output, format_, mapping) if is_usual else []
    logs = [log for log in logs if log not in imported]
    targets = dict(zip(logs, importer.targets(logs, output, format_, force=force), strict=True))
    skips = Skips()
    shown = tracked(logs, "reading")
    outcomes = (attempt(lambda log_and_bar: importer.read(log_and_bar[0], limits, log_and_bar[1]), pair) for pair in shown)
    read = sifted(logs, outcomes, skips.skip) if logs else []
    refuse_twice([run for _, runs in read for run in runs], [log for log, runs in read for _ in runs])
    say_how_read([run for _, runs in read for run in runs], several=len(logs) > 1, also=("ignored_columns",))
    placed = [pair for log, runs in read for pair in zip(runs, importer.places(targets[log], len(runs)), strict=True)]
    for _, place in placed:
        check_output(place, force=force)
    done = [importer.write(run, place, force=force) for run, place in placed]
    result = Import(runs=tuple(done), already_imported=tuple(map(str, imported)), skipped_runs=tuple(skips.records))
    from fieldsid.cli.headlines.logs import headline_of_import
    from fieldsid.logs.segments import plane_of

    notes = one_of_each_kind(((n.code, n.data.get("signal")), item.run.name, n) for item in done for n in item.warnings)
    headline = headline_of_import(result, plane_of([d.run for d in done]))
    rows = tuple((d.file, str(d.samples), f"{d.duration_s:.2f}", f"{d.rate_hz:.4g}", str(len(d.signals))) for d in done)
    page = Page("", blocks=(Block("", rows, ("run", "samples", "s", "Hz", "signals")),))
    body = emit(result, render=page, headline=headline, notes=notes)
    if voice().is_json:  # a run is used for a long time: its warnings go to stderr in JSON mode too
        warn(notes)
    return skips.end(body, len(done))


def _already_imported(importer: Importer, logs: list[Path], output: Path, form: str, mapping: Path | None) -> list[Path]:
    """Return the logs whose runs exist and were made from the same bytes of the log and of its mapping; say so on stderr."""
    from fieldsid.cli.console import say
    from fieldsid.records.named_inputs import sha256_of_named
    from fieldsid.trial_folder.state import run_head

    def is_imported(log: Path, target: Path) -> bool:
        place = target if target.exists() else importer.places(target, 2)[0]
        head = run_head(place) if place.name.endswith(".parquet") and place.is_file() else None
        made_of = {e["path"]: e["sha256"] for e in (head or {}).get("inputs") or ()}
        given = {str(log), *([str(mapping)] if mapping is not None else [])}
        return given <= made_of.keys() and all(sha256_of_named(Path(p)) == known for p, known in made_of.items())

    pairs = zip(logs, importer.targets(logs, output, form, force=True), strict=True)
    found = [log for log, target in pairs if is_imported(log, target)]
    if found:
        say(f"already imported: {', '.join(map(str, found))}")
    return found
