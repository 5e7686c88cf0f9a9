"""Options that several commands share, each written once."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from fieldsid.models.axis import Axis

READ, LIMITS, WRITTEN, ANSWER = "What is read", "Limits", "What is written", "How it answers"
GROUPS = ("Arguments", "Options", READ, LIMITS, WRITTEN, ANSWER)
"""Groups of options on a command's page of help, in their order; a command may add groups for the options that only it has."""


def argument(metavar: str, says: str) -> Any:
    """Return an argument; metavar: its placeholder on the page of help, says: its description."""
    return typer.Argument(metavar=metavar, help=says)


def option(names: str, metavar: str, says: str, group: str | None = None, **bounds: float) -> Any:
    """Return an option; metavar: the placeholder of its value, says: its description, bounds: `min` and `max` of its value."""
    return typer.Option(*names.split(), metavar=metavar or None, help=says, rich_help_panel=group, **bounds)  # type: ignore[arg-type]


def flag(names: str, says: str, group: str | None = None) -> Any:
    """Return an option that takes no value."""
    return option(names, "", says, group)


RunFiles = Annotated[
    list[Path], argument("RUN...", "Runs or log files: .parquet, .csv, .csv.gz, a bag; `-` reads CSV from standard input.")
]
LogAndTables = Annotated[
    list[Path],
    argument("LOG", "A log: CSV, Parquet, ROS 1 or ROS 2 bag, a folder of the tables of one run; with `--join` its tables."),
]
ModelFile = Annotated[Path, argument("MODEL", "A model file written by `sysid identify` or `sysid extend`.")]
ModelFiles = Annotated[list[Path], argument("MODEL...", "Model files, or one table of parameters over speed.")]
Text = str | None
Speeds = Annotated[Text, option("--speeds", "LIST", "Speeds in m/s, `1.0,1.6` or `0.5:2.5:0.1`; the models' if not given.")]
FinMax = Annotated[
    Text,
    option("--fin-max", "ANGLE", "Largest fin angle, `15deg`; the vehicle's if not given, else the models' largest.", LIMITS),
]
Forgetting = Annotated[float, option("--forgetting", "", "Forgetting factor of svf_rls; 1 forgets nothing.", min=0.5, max=1.0)]
ValidateRuns = Annotated[list[Path] | None, option("--validate", "RUN", "A run the fit does not see; may repeat.", READ)]
AxisOption = Annotated[Axis, option("--axis", "", "The plane to identify.")]
ExcitedAxis = Annotated[
    Axis | None, option("--axis", "", "The plane to identify; may be left out where the runs excite one alone.")
]
Join = Annotated[bool, flag("--join", "The logs are the tables of one run, each on stamps of its own.", READ)]
MappingFile = Annotated[Path | None, option("--mapping -m", "YAML", "Which column or topic is which signal.", READ)]
VehicleFile = Annotated[Path | None, option("--vehicle", "YAML", "The vehicle's description and limits.", READ)]
Method = Annotated[str, option("--method", "NAME", "auto, output_error, pem, svf_ls, svf_rls or srivc.")]
Bandwidth = Annotated[float, option("--lambda", "RAD_S", "Bandwidth of the state-variable filter.", min=0.01)]
OwnLaw = Annotated[list[str] | None, option("--law", "NAME=c0[,c1]", "A law of your own, c0 + c1 u^2, as `b2=-0.23,-0.33`.")]
MsgPath = Annotated[Path | None, option("--msg-path", "DIR", "Folder of .msg files for types the bag does not define.")]
EffectNames = Annotated[str | None, option("--effects", "A,B", "Effects in the model: see `sysid effects list`.")]
FigureFile = Annotated[Path | None, option("--figure", "FILE", "Draw a figure: .png, .svg or .pdf, by the suffix.", WRITTEN)]
FromS = Annotated[float | None, option("--from", "S", "Use samples from this time on.", READ)]
ToS = Annotated[float | None, option("--to", "S", "Use samples up to this time.", READ)]
OutputDir = Annotated[Path | None, option("-o --output", "DIR", "Folder for what is written.", WRITTEN)]
FigurePlace = Annotated[
    Path | None, option("-o --output", "PLACE", "Folder for the figures, or the name of one: .png, .svg or .pdf.", WRITTEN)
]
OutputFile = Annotated[Path | None, option("-o --output", "FILE", "File to write.", WRITTEN)]
Force = Annotated[bool, flag("--force", "Replace files that exist.", WRITTEN)]
Figures = Annotated[bool, flag("--figures/--no-figures", "Draw figures next to the files that are written.", WRITTEN)]
