"""sysid effects: list the physical effects, show one, start one of your own."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING

import typer

from fieldsid.cli.console import Body, emit
from fieldsid.cli.headlines.missing import headline_of_catalogue, headline_of_effect, headline_of_new_effect
from fieldsid.cli.headlines.typed import pasted
from fieldsid.cli.options import FORCE, argument, option
from fieldsid.cli.progress import refuse_existing
from fieldsid.cli.user_effects import OWN_EFFECTS, load_own_effects
from fieldsid.errors import UsageError
from fieldsid.models.axis import Axis
from fieldsid.page import Block, Page, Whole, paragraph, written
from fieldsid.rounding import in_unit

if TYPE_CHECKING:
    from fieldsid.models.effect import Effect, Variant
    from fieldsid.results.effects import Form

command = typer.Typer(help="List the physical effects, show one, start one of your own.\n\nExample: sysid effects show servo_lag")


@command.command("list", short_help="List every effect by stage.")
def list_(axis: Axis | None = option("--axis", "Only the effects of this plane.")) -> Body:
    """List every effect by its stage of the signal path: actuator, hydrodynamics, sensor.

    Example: sysid effects list --axis yaw
    """
    from fieldsid.effects import all_effects
    from fieldsid.results.effects import Catalogue, Described

    known = tuple(all_effects(axis).values())
    result = Catalogue(axis, tuple(map(Described, known)))
    return emit(result, render=_list_page(known), headline=headline_of_catalogue(known))


@command.command("show", short_help="Show all that is known of one effect.")
def show(name: str = argument("NAME", "Name of an effect, as in `sysid effects list`.")) -> Body:
    """Show one effect: equation, coefficients, telltale, what excites it, what it is mistaken for, source.

    Example: sysid effects show servo_lag
    """
    from fieldsid.effects import pick_effect
    from fieldsid.results.effects import Described, ShownEffect

    effect = pick_effect(name)
    return emit(ShownEffect(Described(effect)), render=_page(effect), headline=headline_of_effect(effect))


@command.command("new", short_help="Start an effect of your own.")
def new(
    name: str = argument("NAME", "Name that yours shall have: a small letter, then letters, digits, _."),
    axis: Axis = option("--axis", "The plane that it acts on.", default=Axis.YAW),
    output: Path | None = option("-o --output FILE", "YAML file to write; effects/NAME.yaml if not given."),
    force: bool = FORCE,
) -> Body:
    """Write a file for an effect of your own, to be edited: a YAML file with a moment as an expression.

    Every command that is run in the folder that `effects/` is in knows it, and a model that holds it takes it along.

    Example: sysid effects new tether_drag --axis yaw
    """
    from fieldsid.artifacts import write_text
    from fieldsid.results.effects import NewEffect

    path = output or Path(OWN_EFFECTS) / f"{name}.yaml"
    _refuse_name(name, path)
    refuse_existing(path, force=force)
    write_text(path, _template_text(name, axis, path), force=force)
    load_own_effects()  # a replaced file may have been broken: register the new one
    result = NewEffect(name, axis, str(path))
    page = Page("", closing=written(effect=result.file))
    return emit(result, render=page, headline=headline_of_new_effect(result, _command_to_show(path, name)))


def _refuse_name(name: str, path: Path) -> None:
    """Raise FieldsidError for a name that no effect can have, or that an effect of another file has already."""
    from fieldsid.effects import all_effects
    from fieldsid.effects._user_file import checked_name, name_like
    from fieldsid.models.effect import REGISTRY
    from fieldsid.registry import refusal

    effects = all_effects()
    checked_name(name, effects)
    known = effects.get(name)
    if known is not None and Path(known.origin).resolve() != path.resolve():
        what = f"there is an effect named {name!r} already"
        raise UsageError(what, found=known.origin, hint=f"call it `{name_like(name, effects)}`")
    if (why := refusal(REGISTRY, name)) is not None and not path.exists():
        raise why


def _template_text(name: str, axis: Axis, path: Path) -> str:
    """Return the template of an effect under the new name and axis; raises FieldsidError where it could not be read back."""
    from fieldsid.effects import all_effects, refuse_clash
    from fieldsid.effects._user_file import SUFFIXES, effect_of_text
    from fieldsid.templates import template_path

    if path.suffix not in SUFFIXES:
        raise UsageError(
            f"`{path}` is no YAML file", found=path.suffix or "no suffix", hint=f"write `-o {path.with_suffix('.yaml')}`"
        )
    text = template_path("effect.yaml").read_text(encoding="utf-8")
    for old, new in _substitutions(name, axis):
        text = text.replace(old, new)
    others = [e for e in all_effects().values() if e.name != name]  # `_refuse_name` has checked the name itself
    refuse_clash(effect_of_text(text, path, origin=str(path)), others)
    return text


def _command_to_show(path: Path, name: str) -> str:
    """Return the command line that shows the edited effect; a file outside `effects/` is copied there first, to be read."""
    show = pasted("effects", "show", name)
    if path.parent.resolve() == Path(OWN_EFFECTS).resolve():
        return show
    return f"mkdir -p {OWN_EFFECTS} && cp {quote(str(path))} {OWN_EFFECTS}/ && {show}"


def _substitutions(name: str, axis: Axis) -> tuple[tuple[str, str], ...]:
    """Return what to replace in the template: its name, its axis, and its coefficient by one that no other effect has."""
    return (
        ("roll_rate_drag", name),
        ("axes: [yaw]", f"axes: [{axis}]"),
        ('moment: "-k * r * abs(phi)"', f'moment: "-{name}_k * rate * abs(roll)"'),
        ("  k: {unit", f"  {name}_k: {{unit"),
    )


def _list_page(known: Iterable[Effect]) -> Page:
    from fieldsid.models.effect import Stage

    stages = {stage: tuple((e.name, "+".join(e.axes), e.says) for e in known if e.stage is stage) for stage in Stage}
    blocks = (Block(stage.capitalize(), rows, ("effect", "axes", "in plain words"), left=3) for stage, rows in stages.items())
    own = [f"{e.name} is not built in: {e.origin}" for e in known if e.definition is not None]
    return Page("", blocks=(*blocks, *paragraph(own, Whole)))


def _form_in_words(effect: Effect, form: Form, variant: Variant) -> str:
    """Return the description of a variant's form, with its axes and signals where they differ from the effect's."""
    differences = [*([] if len(form.axes) == len(effect.axes) else form.axes), *(f"needs {role}" for role in variant.needs)]
    return form.says + (f" ({', '.join(differences)})" if differences else "")


def _page(effect: Effect) -> Page:
    from fieldsid.results.effects import Described

    facts = (
        ("stage", f"{effect.stage}, {' and '.join(effect.axes)}"),
        ("equation", effect.equation),
        ("telltale", effect.telltale),
        *(
            ("or in the form", _form_in_words(effect, *both))
            for both in zip(Described(effect).forms, effect.variants, strict=True)
        ),
        ("excited by", ", ".join(effect.excited_by)),
        ("mistaken for", ", ".join(effect.mistaken_for) or "-"),
        ("log must have", ", ".join(effect.needs) or "nothing more"),
        ("source", effect.source),
        ("origin", effect.origin),
    )
    rows = tuple(
        (c.name, in_unit(c.unit), f"{c.low:g} .. {c.high:g}", c.says + (" (each run its own)" if c.per_run else ""))
        for c in effect.all_coefficients
    )
    return Page("", blocks=(Block("", facts, left=2), Block("", rows, ("coefficient", "unit", "range", "is"), left=4)))
