"""The laws of one axis: each parameter against speed, and what the exponent's test says."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import exp, isfinite, isnan
from typing import TYPE_CHECKING, Any

from fieldsid.display import Figures, Frames, View
from fieldsid.figures.sketch import sketch
from fieldsid.page import Block, Page, counted, cut
from fieldsid.rounding import number, with_error
from fieldsid.views._words import table, warned

if TYPE_CHECKING:
    from fieldsid.plant.laws.axis_laws import Laws
    from fieldsid.plant.laws.parameter_law import ParameterLaw, PointCheck

WORDS = {"through_zero": "through zero", "power": "power law"}


def line(laws: Laws) -> str:
    """Return the exponent of speed by which each authority grows."""
    exponents = ((name, law.exponent) for name, law in laws.by_name.items())
    powers = [f"|{name}| as u^{with_error(e.value, e.std_error)}" for name, e in exponents if e is not None]
    return ", ".join(powers) or f"{counted(len(laws.by_name), 'law')} over speed, too few speeds to test an exponent"


def page(laws: Laws) -> Page:
    """Return the law taken of each parameter, its value at each point, and the exponent."""
    from fieldsid.plant.laws.axis_laws import law_notes

    notes = warned((*laws.notes, *law_notes(laws)))
    return Page(f"Laws of the {laws.axis.value} axis against speed", notes, tuple(blocks_of(laws)))


def blocks_of(laws: Laws) -> Iterator[Block | str]:
    """Yield the candidates for each parameter, the exponent of the authority, and how it does without each point."""
    for law in laws.by_name.values():
        rows = tuple(
            (
                WORDS.get(c.kind, c.kind) + (" *" if c.kind == law.chosen else ""),
                _formula(law, i),
                number(c.rms, 3),
                "-" if c.kind == "constant" or isnan(c.r2) else f"{c.r2:.3f}",
            )
            for i, c in enumerate(law.candidates)
        )
        of = f"|{law.name}|" if law.exponent else law.name
        how = "weighted" if law.std_errors is not None else "unweighted"
        yield Block(f"{of} ({how})", rows, ("law", "", "rms", "R^2"), left=2)
        if law.exponent:
            first = law.candidates[0]
            if first.kind == "affine":
                yield f"slope {first.coefficients[1]:.4f}, intercept {first.coefficients[0]:.4f}"
            yield f"exponent: {law.exponent.says}"
    yield from _left_out(laws.authority)
    yield "\n* taken by the next commands"


def _left_out(law: ParameterLaw) -> Iterator[Block | str]:
    rows = tuple(
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
    )
    yield Block(f"leave one out, |{law.name}|", rows, ("point", "m/s", "value", "without it", "slope", "off", ""))
    yield f"off: how far from the law of the others, in standard errors; {_odd(law.points)}" if rows else ""


def _odd(points: Sequence[PointCheck]) -> str:
    """Return from how far off a point does not belong, and what that limit means."""
    limit = points[0].limit
    if not isfinite(limit):
        return f"{len(points)} points are too few to say which does not belong"
    return f"one of {len(points)} points is beyond +/-{limit:.1f} by chance in 1 law of 20, there it does not belong"


def _formula(law: ParameterLaw, index: int) -> str:
    """Return `0.2278 + 0.3270 u^2`."""
    line = law.candidates[index]
    errors = [float(v) ** 0.5 for v in line.covariance.diagonal()]
    if not line.powers:
        low, high = (number(v) for v in (exp(line.coefficients[0]), float(line.coefficients[1])))
        return f"{low} u^({with_error(float(line.coefficients[1]), errors[1])})" if line.dof > 0 else f"{low} u^{high}"
    names = {0.0: "", 1.0: " u", 2.0: " u^2"}
    parts = [f"({with_error(float(c), e)}){names[p]}" for c, e, p in zip(line.coefficients, errors, line.powers, strict=True)]
    return " + ".join(parts)


def frames(laws: Laws) -> Frames:
    """Return the points the laws were drawn through, and the values of the laws at their speeds."""
    return {
        "points": lambda: table(_point_rows(laws), "name"),
        "values": lambda: table(({"speed_m_s": u, **laws.at(u)} for u in map(float, laws.speeds)), "speed_m_s"),
    }


def _point_rows(laws: Laws) -> list[dict[str, Any]]:
    return [
        {
            "name": cut(p.name, 200),
            "speed_m_s": p.speed,
            **dict(p.values),
            **{f"{name}_std_error": error for name, error in p.std_errors.items()},
        }
        for p in laws.points
    ]


def figures(laws: Laws) -> Figures:
    """Return the laws against speed."""
    return {"laws": sketch("law", laws)}


VIEW = View("laws", line, page, frames, lambda laws: laws.axis.value, figures)
