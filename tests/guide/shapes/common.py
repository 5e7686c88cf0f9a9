"""What several commands' JSON objects share. A field's docstring is its description in the schema."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field

Number = float | None
"""A number, null where it is not known: a sensor that is not in the log, a speed that was not measured."""
Interval = Annotated[list[Number], Field(min_length=2, max_length=2)]
"""Lower and upper end."""
AxisName = Literal["yaw", "pitch"]
Side = Literal["port", "starboard"]


class Shape(BaseModel):
    """A JSON object: keys that are always there, and those with a default, which may be left out."""

    model_config = ConfigDict(use_attribute_docstrings=True, strict=True, protected_namespaces=())


def schema_field(name: str) -> Any:
    """Return the field of an object's own name and version."""
    return Field(alias="schema", description=f"Always `{name}`: the name and version of this object.")


class Headline(Shape):
    """The first lines that a reader gets."""

    says: str
    """The verdict with its number."""
    rests_on: str
    """What it rests on."""
    next: str
    """The command that comes next, ready to paste; empty where nothing is left to do."""


class Result(Shape):
    """What a command came to."""

    headline: Headline
    """The first lines of the same result as text."""


class Remark(Shape):
    """A finding: what is wrong or worth knowing, with its code."""

    code: str
    """A name that stays the same from version to version, such as `ignored_delay`."""
    message: str
    """The sentence that the command prints."""


class Skipped(Shape):
    """A log that a command could not use."""

    run: str
    """Its name."""
    file: str
    """The file."""
    what: str
    """What is wrong with it."""
    found: str
    """What was found."""
    hint: str
    """What to do."""


class RemarkWithData(Remark):
    """A finding with its numbers."""

    data: dict[str, Any]
    """What the sentence rests on: values, limits, the hint's option."""


class NoiseFloor(Shape):
    """Noise of the sensors, from the third differences of the signals and of what a model leaves."""

    angle_rad: Number
    """Standard deviation of the angle, in rad."""
    rate_rad_s: Number
    """Standard deviation of the rate, in rad/s."""


class Errors(Shape):
    """Free-run error: root mean square of measured minus simulated."""

    angle_rms_rad: Number
    """Of the angle, in rad."""
    rate_rms_rad_s: Number
    """Of the rate, in rad/s."""


class Pair(Shape):
    """Errors on the runs that were fitted and on runs that were not."""

    train: Errors
    """On the runs the model was fitted to."""
    validation: Errors
    """On runs the fit did not see; null inside where there are none."""


class Where(Shape):
    """A condition of the run under which the error is large."""

    condition: str
    """In words: `phase: onset`, `side: port`, `rate: above 0.14 rad/s`."""
    share_of_error: float
    """Share of the squared error that falls on it, 0 to 1."""
    rms_ratio: float
    """Error under it over that of the whole run."""
    t_start_s: float
    """Start of its worst unbroken stretch."""
    t_end_s: float
    """End of that stretch."""
