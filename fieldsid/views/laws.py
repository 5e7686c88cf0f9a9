"""The laws of one axis: each parameter against speed, and what the exponent's test says."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

from fieldsid.display import View
from fieldsid.page import Block, Page, cut
from fieldsid.rounding import number
from fieldsid.views._words import counted, joined, table, warned

if TYPE_CHECKING:
    from pandas import DataFrame

    from fieldsid.turning import Laws


def line(laws: Laws) -> str:
    """Return axis, points, the law of each parameter and the exponent of the authority."""
    kinds = ", ".join(f"{name} {law.chosen}" for name, law in laws.by_name.items())
    exponent = laws.authority.exponent
    says = "" if exponent is None else f"{laws.authority.name} goes with u^{number(exponent.value, 3)}"
    return f"{laws.axis.value}, {counted(len(laws.points), 'point')}: {joined(kinds, says)}"


def page(laws: Laws) -> Page:
    """Return the law taken of each parameter, its value at each point, and the exponent."""
    from fieldsid.plant.laws.axis_laws import law_notes

    chosen = [
        (name, law.chosen, number(law.line.rms, 3), number(law.line.r2, 3), "yes" if law.std_errors is not None else "no")
        for name, law in laws.by_name.items()
    ]
    heads = ("m/s", *laws.by_name)
    points = [(number(u, 3), *(number(v) for v in laws.at(u).values())) for u in map(float, laws.speeds)]
    exponent = laws.authority.exponent
    closing = () if exponent is None else (f"exponent of |{laws.authority.name}|: {exponent.says}",)
    blocks = (
        Block("Laws", tuple(chosen), ("", "law", "rms", "R^2", "weighted"), left=2),
        Block("Values by the laws", tuple(points), heads, left=0),
    )
    return Page(f"Laws of the {laws.axis.value} axis against speed", warned((*laws.notes, *law_notes(laws))), blocks, closing)


def frames(laws: Laws) -> Mapping[str, Callable[[], DataFrame]]:
    """Return the points the laws were drawn through, and the values of the laws at their speeds."""
    return {
        "points": lambda: table(_point_rows(laws), "name"),
        "values": lambda: table(({"speed_m_s": u, **laws.at(u)} for u in map(float, laws.speeds)), "speed_m_s"),
    }


def figures(laws: Laws) -> Mapping[str, Callable[[], Any]]:
    """Return the laws against speed."""
    from fieldsid.figures.law import figure

    return {"laws": lambda: figure(laws)}


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


VIEW = View("laws", line, page, frames, lambda laws: laws.axis.value, figures)
