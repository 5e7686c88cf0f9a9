"""A model: its parameters with their errors, its effects, and where it came from."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from fieldsid.display import Frames, View
from fieldsid.page import Page, facts, listed
from fieldsid.rounding import number, p_value
from fieldsid.views._words import base_words, joined, parameter_block, parameter_rows, speed_words, table

if TYPE_CHECKING:
    from fieldsid.models.model import Model


def line(model: Model) -> str:
    """Return axis, effects, speed and base parameters."""
    return f"{joined(model.axis.value, listed(model.effects), speed_words(model.law.reference))}: {base_words(model)}"


def page(model: Model) -> Page:
    """Return how the model was found, and its parameters."""
    low, high = (model.trained.get(k, float("nan")) for k in ("speed_low", "speed_high"))
    whiteness = model.info.get("whiteness_p")
    known = facts(
        "Statistics",
        (
            ("method", model.method),
            ("effects", listed(model.effects) or "none"),
            ("runs", listed(model.runs)),
            ("speeds", f"{low:.2f} .. {high:.2f} m/s" if low < high else speed_words(low)),
            ("whiteness", "" if whiteness is None else p_value(whiteness)),
            ("damping", f"goes with u^{number(model.law.damping_exponent, 3)}"),
            ("authority", "of its own at each speed" if model.law.points else f"goes with u^{model.law.authority_exponent:.3g}"),
        ),
    )
    return Page(f"Model of the {model.axis.value} axis", (), (known, parameter_block([("", model)])))


def frames(model: Model) -> Frames:
    """Return the parameters."""
    return {"parameters": lambda: table(parameter_rows(model), "parameter")}


def label(model: Model) -> str:
    """Return the runs it was fitted to."""
    return "+".join(model.runs) or model.axis.value


def system(model: Model, speed: float | None) -> Any:
    """Return the plant at a speed."""
    from fieldsid.views._control import model_system

    return model_system(model, speed)


VIEW = View("model", line, page, frames, label, system=system)
