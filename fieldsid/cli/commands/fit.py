"""sysid fit: b2 and d2 against u^2, damping and trim against speed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from fieldsid.cli.console import emit, table
from fieldsid.cli.options import Figures, Force, JsonFlag, ModelFiles, OutputFile, flag
from fieldsid.cli.progress import refuse_existing
from fieldsid.cli.session import tasks_of

if TYPE_CHECKING:
    from rich.console import Console

    from fieldsid.plant.laws.axis_laws import Laws
    from fieldsid.plant.laws.parameter_law import ParameterLaw, PointCheck

Unweighted = Annotated[bool, flag("--unweighted", "Let every point count alike, standard errors or not.")]
WORDS = {"through_zero": "through zero", "power": "power law"}


def command(
    context: typer.Context,
    models: ModelFiles,
    unweighted: Unweighted = False,
    output: OutputFile = None,
    figures: Figures = True,
    force: Force = False,
    as_json: JsonFlag = False,
) -> Mapping[str, Any]:
    """Fit the laws that carry a model from one speed to the next: authority against u^2, damping and trim against u.

    Takes model files of one axis, or one CSV table with speed_m_s and any of a22,b2,C0,c22,c23,d2,Cb (`<name>_std_error` where
    known; `-` is standard input). With `-o FILE` the laws are written for `turn-radius` and `schedule`, the models with their
    effects and errors inside, and a figure next to them.

    Example: sysid fit models/*.yaml -o law.yaml
    """
    from fieldsid.cli.headlines.gains import of_fit
    from fieldsid.cli.inputs import models_among
    from fieldsid.errors import UsageError
    from fieldsid.plant.laws.axis_laws import law_notes, save_laws
    from fieldsid.plant.parameter_source import load_parameter_source
    from fieldsid.records.keys import body_of
    from fieldsid.results.turning import FittedLaws

    refuse_existing(output, output.with_suffix(".png") if output is not None and figures else None, force=force)
    models = models_among(models)
    source = load_parameter_source(models)
    if source.is_fit_file:
        raise UsageError("this is a fit file already", found=str(models[0]), hint="give models or a table")
    laws = source.fitted(weighted=not unweighted)
    written = drawn = None
    if output is not None:
        there = [p for p in source.paths if p.is_file()]
        written = str(save_laws(laws, output, models=there if source.models else (), inputs=there, force=force))
        drawn = str(_draw(laws, output.with_suffix(".png"), context, force=force)) if figures else None
    body = body_of(FittedLaws(laws=laws, file=written, figure=drawn))
    notes = (*source.notes, *law_notes(laws))
    return emit(body, as_json=as_json, render=lambda to: _render(to, laws, body), headline=of_fit(body), notes=notes)


def _draw(laws: Laws, path: Path, context: typer.Context, *, force: bool) -> Path:
    from fieldsid.figures.canvas import save
    from fieldsid.figures.law import figure

    return save(figure(laws), path, force=force, tasks=tasks_of(context))


def _render(to: Console, laws: Laws, body: Mapping[str, Any]) -> None:
    from fieldsid.rounding import number

    for law in laws.by_name.values():
        rows = [
            (
                WORDS.get(c.kind, c.kind) + (" *" if c.kind == law.chosen else ""),
                _formula(law, i),
                number(c.rms, 3),
                "-" if c.kind == "constant" else _share(c.r2),
            )
            for i, c in enumerate(law.candidates)
        ]
        of = f"|{law.name}|" if law.exponent else law.name
        how = "weighted" if law.std_errors is not None else "unweighted"
        to.print(table(f"{of} ({how})", ("law", "", "rms", "R^2"), rows, left=2))
        if law.exponent:
            first = law.candidates[0]
            if first.kind == "affine":
                to.print(f"slope {first.coefficients[1]:.4f}, intercept {first.coefficients[0]:.4f}")
            to.print(f"exponent: {law.exponent.says}")
        to.print()
    _render_left_out(to, laws.authority)
    to.print("* taken by the next commands")
    for key in ("file", "figure"):
        if body[key]:
            to.print(f"{key}: {body[key]}", soft_wrap=True)


def _render_left_out(to: Console, law: ParameterLaw) -> None:
    from fieldsid.rounding import number

    if not law.points:
        return
    rows = [
        (
            p.name,
            number(p.speed, 3),
            number(p.value),
            number(p.predicted_without),
            number(p.leading_coefficient_without),
            f"{p.studentised:+.1f}" if isfinite(p.limit) else "-",
            "" if p.belongs else "does not belong",
        )
        for p in law.points
    ]
    to.print(table(f"leave one out, |{law.name}|", ("point", "m/s", "value", "without it", "slope", "off", ""), rows))
    to.print(f"off: how far from the law of the others, in standard errors; {_odd(law.points)}")
    to.print()


def _odd(points: Sequence[PointCheck]) -> str:
    """Return from how far off a point does not belong, and what that limit means."""
    limit = points[0].limit
    if not isfinite(limit):
        return f"{len(points)} points are too few to say which does not belong"
    return f"one of {len(points)} points is beyond +/-{limit:.1f} by chance in 1 law of 20, there it does not belong"


def _formula(law: ParameterLaw, index: int) -> str:
    """Return `0.2278 + 0.3270 u^2`."""
    from fieldsid.rounding import number, with_error

    line = law.candidates[index]
    errors = [float(v) ** 0.5 for v in line.covariance.diagonal()]
    if not line.powers:
        low, high = (number(v) for v in (float(2.718281828459045 ** line.coefficients[0]), float(line.coefficients[1])))
        return f"{low} u^({with_error(float(line.coefficients[1]), errors[1])})" if line.dof > 0 else f"{low} u^{high}"
    names = {0.0: "", 1.0: " u", 2.0: " u^2"}
    parts = [f"({with_error(float(c), e)}){names[p]}" for c, e, p in zip(line.coefficients, errors, line.powers, strict=True)]
    return " + ".join(parts)


def _share(r2: float) -> str:
    return "-" if r2 != r2 else f"{r2:.3f}"  # noqa: PLR0124 - NaN is not itself
