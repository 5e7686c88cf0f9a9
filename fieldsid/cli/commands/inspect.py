"""sysid inspect: what is in a log, a proposed mapping, the import doctor's findings."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from fieldsid.cli import options
from fieldsid.cli.console import emit, tracked
from fieldsid.page import Block, Page, Whole, paragraph

if TYPE_CHECKING:
    from fieldsid.logs.inspection import Inspection
    from fieldsid.results.logs import Inspected


class Options(options.Options):
    """What `sysid inspect` takes."""

    logs: list[Path] = options.argument(
        "LOG", "A log: CSV, Parquet, ROS 1 or ROS 2 bag, a folder of the tables of one run; with `--join` its tables."
    )
    join: bool = options.JOIN
    mapping: Path | None = options.MAPPING
    msg_path: Path | None = options.MSG_PATH
    write_mapping: Path | None = options.option("--write-mapping FILE", "Write the mapping, for `sysid import --mapping`.")
    force: bool = options.FORCE


@options.takes(Options)
def command(given: Options) -> None:
    """Say what is in a log, which mapping it may need, and what would spoil an identification.

    Example: sysid inspect run7.mcap --write-mapping mapping.yaml
    """
    from fieldsid.cli.headlines.logs import headline_of_inspection
    from fieldsid.cli.inputs import one_run
    from fieldsid.logs.inspection import inspect_log, write_proposal
    from fieldsid.results.logs import inspected

    log, *joined = one_run("inspect", given.logs, join=given.join)
    for path, on_share in tracked([log], "reading"):
        found = inspect_log(path, mapping=given.mapping, msg_path=given.msg_path, joined=joined, progress=on_share)
    written = None if given.write_mapping is None else write_proposal(found, given.write_mapping, force=given.force)
    result = inspected(found, written)
    headline = headline_of_inspection(result, given.mapping)
    emit(result, render=_page(found, result), headline=headline)


def _page(found: Inspection, result: Inspected) -> Page:
    from fieldsid.cli.headlines.logs import PROOF

    channels = tuple((c.name, c.type, str(c.count), c.rate, c.holds) for c in result.shown)
    more = f"and {result.more_channels} more channels" if result.more_channels else ""
    kind = "canonical names, none is needed" if found.needs_none else "proposed"
    parts = (
        (f"mapping ({kind})", found.yaml().rstrip().split("\n")),
        ("why these", [f"- {n.message}" for n in found.notes if n.code == PROOF]),
        ("findings", [f"- {n.message} [{n.code}]" for n in found.notes if n.code != PROOF] or ["- none"]),
    )
    said = (s for title, lines in parts if lines for s in paragraph([title, *lines], Whole if lines is parts[0][1] else str))
    heads = ("channel", "type", "samples", "Hz", "holds")
    return Page("", blocks=(Block("", channels, heads, left=2), more, *said))
