"""The catalogue of effects, the tour and the guide."""

from __future__ import annotations

from typing import Any, Literal

from guide.shapes.common import AxisName, Result, Shape, schema_field


class Coefficient(Shape):
    """One number of an effect."""

    name: str
    """Its name."""
    unit: str
    """Its unit."""
    low: float
    """Lower bound."""
    high: float
    """Upper bound."""
    start: float
    """Start value."""
    per_run: bool
    """Whether every run has its own."""
    says: str
    """What it is."""


class Form(Shape):
    """A shape of an effect that is not the textbook's."""

    says: str
    """What is different."""
    axes: list[AxisName]
    """The planes it is tried in."""
    needs: list[str]
    """Signals the log must have."""
    coefficients: list[Coefficient]
    """The numbers it takes besides."""


class Effect(Shape):
    """One physical effect."""

    name: str
    """Its name."""
    says: str
    """What it is, in plain words."""
    stage: Literal["actuator", "hydrodynamics", "sensor"]
    """Where in the signal path it acts."""
    axes: list[AxisName]
    """The planes it acts in."""
    equation: str
    """Its equation."""
    coefficients: list[Coefficient]
    """Its numbers."""
    forms: list[Form]
    """Other shapes of it."""
    needs: list[str]
    """Signals the log must have: surge, thrust, roll, depth."""
    extra_states: list[str]
    """States it adds to the model."""
    telltale: str
    """What its absence leaves in the residual."""
    excited_by: list[str]
    """Maneuvers that show it, the best first."""
    mistaken_for: list[str]
    """Effects it may be mistaken for."""
    source: str
    """Where the equation comes from."""
    origin: str
    """`built in`, or the file of a user's own."""


class ShownEffect(Result, Effect):
    """One physical effect, as `sysid effects show` gives it."""

    schema_: Literal["fieldsid/effect/1"] = schema_field("fieldsid/effect/1")


class Effects(Result):
    """The catalogue of effects."""

    schema_: Literal["fieldsid/effects/1"] = schema_field("fieldsid/effects/1")
    axis: AxisName | None
    """The plane asked for; null for both."""
    effects: list[Effect]
    """Every effect."""


class NewEffect(Result):
    """The file of an effect of one's own."""

    schema_: Literal["fieldsid/new-effect/1"] = schema_field("fieldsid/new-effect/1")
    name: str
    """Its name."""
    axis: AxisName
    """The plane it acts on."""
    file: str
    """The file that was written."""


class Hidden(Shape):
    """What the tour hides in its vehicle."""

    effect: str
    """The effect."""
    axis: AxisName
    """The plane."""
    values: dict[str, float]
    """The vehicle's true numbers."""


class Step(Shape):
    """One step of the tour."""

    command: str
    """The command line."""
    seconds: float
    """How long it took."""
    means: str
    """What its result means."""
    result: dict[str, Any] | None
    """The command's own JSON object."""


class Demo(Result):
    """The tour."""

    schema_: Literal["fieldsid/demo/1"] = schema_field("fieldsid/demo/1")
    folder: str
    """Where the files are."""
    hidden: Hidden
    """What was hidden."""
    named: list[str]
    """What diagnose named."""
    steps: list[Step]
    """The steps."""
    files: list[str]
    """The files that were written."""
    seconds: float
    """How long it took."""


class Title(Shape):
    """A topic of the guide."""

    topic: str
    """Its name, as `sysid guide` takes it."""
    title: str
    """Its title."""


class Contents(Shape):
    """The topics of the guide."""

    schema_: Literal["fieldsid/guide/1"] = schema_field("fieldsid/guide/1")
    topics: list[Title]
    """In the order of reading."""


class Topic(Title):
    """One page of the guide."""

    schema_: Literal["fieldsid/guide/1"] = schema_field("fieldsid/guide/1")
    file: str
    """The file that holds it."""
    text: str
    """Its text."""
