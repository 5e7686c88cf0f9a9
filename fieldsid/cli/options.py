"""The options of the commands: the fields of the one record that a command takes; of a command with few, its parameters.

What several commands share is written once, as a record that theirs inherit, or as an option that their fields take. The fields
of a record come before those of what inherits it, and of several inherited ones those of the last come first.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from inspect import Parameter, Signature, signature
from pathlib import Path
from typing import Any, TypeVar, dataclass_transform, get_type_hints

import typer

from fieldsid.angles import FIN, parse_angle

O = TypeVar("O")
R = TypeVar("R")
Text = str | None
Paths = list[Path] | None
Parse = tuple[Callable[..., Any], *tuple[Any, ...]]
READ, LIMITS, WRITTEN, ANSWER = "What is read", "Limits", "What is written", "How it answers"
GROUPS = ("Arguments", "Options", READ, LIMITS, WRITTEN, ANSWER)
"""Groups of options on a command's page of help, in their order; a command may add groups for the options that only it has."""


@dataclass_transform(frozen_default=True, kw_only_default=True)
class Options:
    """The options of a command: each class that inherits this one is a frozen dataclass."""

    def __init_subclass__(cls) -> None:
        dataclass(frozen=True, kw_only=True)(cls)


def takes(record: type[O]) -> Callable[[Callable[[O], R]], Callable[..., R]]:
    """Return a decorator that gives a command a parameter for each field of the record of options that it takes."""
    types = get_type_hints(record)
    spread = [Parameter(name, Parameter.KEYWORD_ONLY, default=getattr(record, name), annotation=t) for name, t in types.items()]

    def decorator(run: Callable[[O], R]) -> Callable[..., R]:
        def command(**given: Any) -> R:
            return run(record(**given))

        command.__doc__, command.__annotations__ = run.__doc__, types
        command.__signature__ = Signature(spread)  # type: ignore[attr-defined]
        return command

    return decorator


def arguments_of(function: Callable[..., Any], given: object, **other: Any) -> dict[str, Any]:
    """Return the arguments of a function of the Python face: the options of the same names that were given, and others."""
    taken = {name: getattr(given, name, None) for name in signature(function).parameters}
    return {name: value for name, value in taken.items() if value is not None} | other


def argument(metavar: str, says: str, default: Any = ...) -> Any:
    """Return an argument; metavar: its placeholder on the page of help, says: its description."""
    return typer.Argument(default, metavar=metavar, help=says)


def option(
    names: str, says: str, group: str | None = None, *, default: Any = None, parse: Parse | None = None, **bounds: float
) -> Any:
    """Return an option; names: its names and the placeholder of its value, `-o --output DIR`; says: its description.

    default: its value where it is not given, `...` where it must be. parse: the function that returns the value of its text, and
    further arguments of that after text and name. bounds: `min` and `max`.
    """
    words = names.split()
    named = [w for w in words if w.startswith("-")]
    how: dict[str, Any] = {"metavar": next((w for w in words if w not in named), None), "rich_help_panel": group, **bounds}
    if parse is not None:
        how["parser"] = lambda text: parse[0](text, named[-1], *parse[1:])
    return typer.Option(default, *named, help=says, **how)


def flag(names: str, says: str, group: str | None = None, *, default: bool = False) -> Any:
    """Return an option that takes no value."""
    return option(names, says, group, default=default)


FOLDER = option("-o --output DIR", "Folder for what is written.", WRITTEN)
FORCE = flag("--force", "Replace files that exist.", WRITTEN)
FIGURE = option("--figure FILE", "Draw a figure: .png, .svg or .pdf, by the suffix.", WRITTEN)
FIGURES = flag("--figures/--no-figures", "Draw figures next to the files that are written.", WRITTEN, default=True)
FILE = option("-o --output FILE", "File to write.", WRITTEN)
JOIN = flag("--join", "The logs are the tables of one run, each on stamps of its own.", READ)
AXIS = option("--axis", "The plane to identify.", default=...)
BANDWIDTH = option("--lambda RAD_S", "Bandwidth of the state-variable filter.", default=4.0, min=0.01)
EXCITED_AXIS = option("--axis", "The plane to identify; may be left out where the runs excite one alone.")
END = option("--to S", "Use samples up to this time.", READ)
FIN_MAX = option(
    "--fin-max ANGLE", "Largest fin angle, `15deg`; the vehicle's if not given, else the models' largest.", LIMITS,
    parse=(parse_angle, FIN),
)  # fmt: skip
FORGETTING = option("--forgetting", "Forgetting factor of svf_rls; 1 forgets nothing.", default=1.0, min=0.5, max=1.0)
LAW = option("--law NAME=c0[,c1]", "A law of your own, c0 + c1 u^2, as `b2=-0.23,-0.33`.")
MAPPING = option("--mapping -m YAML", "Which column or topic is which signal.", READ)
METHOD = option("--method NAME", "auto, output_error, pem, svf_ls, svf_rls or srivc.", default="auto")
MSG_PATH = option("--msg-path DIR", "Folder of .msg files for types the bag does not define.")
SPEEDS = option("--speeds LIST", "Speeds in m/s, `1.0,1.6` or `0.5:2.5:0.1`; the models' if not given.")
START = option("--from S", "Use samples from this time on.", READ)
VEHICLE = option("--vehicle YAML", "The vehicle's description and limits.", READ)


class Runs(Options):
    """A command on runs."""

    runs: list[Path] = argument("RUN...", "Runs or log files: .parquet, .csv, .csv.gz, a bag; `-` reads CSV from standard input.")


class OneModel(Options):
    """A command on one model."""

    model: Path = argument("MODEL", "A model file written by `sysid identify` or `sysid extend`.")


class Models(Options):
    """A command on models of one axis."""

    models: list[Path] = argument("MODEL...", "Model files, or one table of parameters over speed.")


class Mapped(Options):
    """A command that reads logs."""

    mapping: Path | None = MAPPING


class Part(Options):
    """A command that reads a part of each log."""

    start: float | None = START
    end: float | None = END
    mapping: Path | None = MAPPING

    @property
    def reading(self) -> dict[str, Any]:
        """How the logs are read, as `read_runs` takes it."""
        return {"mapping": self.mapping, "start": self.start, "end": self.end}


class Judged(Options):
    """A command whose fits are judged by runs that they do not see."""

    validate: Paths = option("--validate RUN", "A run the fit does not see; may repeat.", READ)


class OfVehicle(Options):
    """A command for which the vehicle has limits."""

    vehicle: Path | None = VEHICLE


class ToFolder(Options):
    """A command that writes files and figures to a folder, or to another place."""

    output: Path | None = FOLDER
    figures: bool = FIGURES
    force: bool = FORCE

    @property
    def drawn_to(self) -> Path | None:
        """Where figures are drawn, None where none are."""
        return self.output if self.figures else None


class ToFile(Options):
    """A command that writes a file."""

    output: Path | None = FILE
    force: bool = FORCE
