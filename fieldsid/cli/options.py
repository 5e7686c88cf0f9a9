"""Options that several commands share, each written once."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from fieldsid.models.axis import Axis

READ, LIMITS, WRITTEN, ANSWER = "What is read", "Limits", "What is written", "How it answers"
GROUPS = ("Arguments", "Options", READ, LIMITS, WRITTEN, ANSWER)
"""The groups of options on a command's page of help, in their order; what a command alone has may have groups of its own."""

RunFiles = Annotated[
    list[Path],
    typer.Argument(
        metavar="RUN...", help="Runs or log files: .parquet, .csv, .csv.gz, a bag; `-` reads CSV from standard input."
    ),
]
LogAndTables = Annotated[
    list[Path],
    typer.Argument(
        metavar="LOG",
        help="A log: CSV, Parquet, ROS 1 or ROS 2 bag, a folder of the tables of one run; with `--join` its tables.",
    ),
]
ModelFile = Annotated[Path, typer.Argument(metavar="MODEL", help="A model file written by `sysid identify` or `sysid extend`.")]
ModelFiles = Annotated[list[Path], typer.Argument(metavar="MODEL...", help="Model files, or one table of parameters over speed.")]
ValidateRuns = Annotated[
    list[Path] | None,
    typer.Option(
        "--validate", metavar="RUN", help="A run the fit does not see; may repeat.", show_default=False, rich_help_panel=READ
    ),
]
AxisOption = Annotated[Axis, typer.Option("--axis", help="The plane to identify.")]
ExcitedAxis = Annotated[
    Axis | None,
    typer.Option("--axis", help="The plane to identify; may be left out where the runs excite one alone.", show_default=False),
]
Join = Annotated[
    bool,
    typer.Option("--join", help="The logs are the tables of one run, each on stamps of its own.", rich_help_panel=READ),
]
MappingFile = Annotated[
    Path | None,
    typer.Option(
        "--mapping", "-m", metavar="YAML", help="Which column or topic is which signal.", show_default=False, rich_help_panel=READ
    ),
]
VehicleFile = Annotated[
    Path | None,
    typer.Option(
        "--vehicle", metavar="YAML", help="The vehicle's description and limits.", show_default=False, rich_help_panel=READ
    ),
]
EffectNames = Annotated[
    str | None,
    typer.Option("--effects", metavar="A,B", help="Effects in the model: see `sysid effects list`.", show_default=False),
]
FigureFile = Annotated[
    Path | None,
    typer.Option(
        "--figure",
        metavar="FILE",
        help="Draw a figure: .png, .svg or .pdf, by the suffix.",
        show_default=False,
        rich_help_panel=WRITTEN,
    ),
]
FromS = Annotated[
    float | None,
    typer.Option("--from", metavar="S", help="Use samples from this time on.", show_default=False, rich_help_panel=READ),
]
ToS = Annotated[
    float | None, typer.Option("--to", metavar="S", help="Use samples up to this time.", show_default=False, rich_help_panel=READ)
]
OutputDir = Annotated[
    Path | None,
    typer.Option(
        "-o", "--output", metavar="DIR", help="Folder for what is written.", show_default=False, rich_help_panel=WRITTEN
    ),
]
FigurePlace = Annotated[
    Path | None,
    typer.Option(
        "-o",
        "--output",
        metavar="PLACE",
        help="Folder for the figures, or the name of one: .png, .svg or .pdf.",
        show_default=False,
        rich_help_panel=WRITTEN,
    ),
]
OutputFile = Annotated[
    Path | None,
    typer.Option("-o", "--output", metavar="FILE", help="File to write.", show_default=False, rich_help_panel=WRITTEN),
]
Force = Annotated[bool, typer.Option("--force", help="Replace files that exist.", rich_help_panel=WRITTEN)]
JsonFlag = Annotated[bool, typer.Option("--json", help="Print one JSON object instead of text.", rich_help_panel=ANSWER)]
Figures = Annotated[
    bool, typer.Option("--figures/--no-figures", help="Draw figures next to the files that are written.", rich_help_panel=WRITTEN)
]


def names_of(text: str | None) -> tuple[str, ...]:
    """Return the names in a comma-separated list, without blanks."""
    return tuple(n.strip() for n in (text or "").split(",") if n.strip())
