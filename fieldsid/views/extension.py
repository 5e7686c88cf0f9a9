"""An extension: the effects added, the error before and after against the noise floor, and the model with them."""

from __future__ import annotations

from collections.abc import Iterator
from math import isfinite
from typing import TYPE_CHECKING, Any

from fieldsid.display import Figures, Frames, View
from fieldsid.figures.bars import fall
from fieldsid.figures.sketch import sketch
from fieldsid.page import Block, Page, facts, listed
from fieldsid.rounding import RADIANS, Angles, number
from fieldsid.views._words import parameter_block, parameter_rows, table, warned

if TYPE_CHECKING:
    from fieldsid.extension.extend import Extension, Gain


def line(found: Extension) -> str:
    """Return the effects added, the error before and after, and whether the addition is kept."""
    return f"{'+'.join(found.gain.added)}: {fall([found.gain])}, {_verdict(found)}"


def page(found: Extension, angles: Angles = RADIANS) -> Page:
    """Return the errors before and after, and the parameters of the extended model."""
    gain = found.gain
    known = facts(
        "Statistics",
        (
            ("effects", listed(found.model.effects)),
            ("log evidence", f"{found.evidence:+.1f}"),
            ("fitted to", listed(gain.learned_on)),
            ("judged on", listed(gain.judged_on) + ("" if gain.unseen else ", which were fitted")),
        ),
    )
    blocks = (known, errors(gain, angles), parameter_block([("", found.model)], angles))
    title = f"Extension by {' and '.join(gain.added)}: {fall([found.gain])}, {_verdict(found)}"
    return Page(title, warned(found.notes), blocks)


def frames(found: Extension) -> Frames:
    """Return the errors before and after, and the parameters of the extended model."""
    return {
        "errors": lambda: table(channels_of(found.gain)),
        "parameters": lambda: table(parameter_rows(found.model), "parameter"),
    }


def figures(found: Extension) -> Figures:
    """Return the fall of the error towards the noise floor."""
    before = tuple(e for e in found.model.effects if e not in found.gain.added)
    return {"errors": sketch("history", [found.gain], before, "the extension", draw="fall_figure")}


def _verdict(found: Extension) -> str:
    return "which pays" if found.pays else "which does not pay"


def errors(gain: Gain, angles: Angles) -> Block:
    """Return the error before and after of each channel, on unseen and on fitted runs, with the noise floor."""
    rows = [
        (f"{r['channel']}, {unit}, {r['runs']}", *(number(factor * r[k], 3) for k in ("before", "after", "noise_floor")))
        for r in channels_of(gain)
        for factor, unit in [angles.of(r["unit"])]
    ]
    return Block("", tuple(rows), ("rms error", "before", "after", "noise floor"))


def channels_of(gain: Gain) -> Iterator[dict[str, Any]]:
    """Yield the error of each channel before and after an addition, on unseen and on fitted runs, with its noise floor."""
    for channel, unit, name, floor in (
        ("angle", "rad", "angle_rms_rad", gain.noise_floor.angle),
        ("rate", "rad/s", "rate_rms_rad_s", gain.noise_floor.rate),
    ):
        for runs, before, after in (
            ("unseen", gain.before.validation, gain.after.validation),
            ("fitted", gain.before.train, gain.after.train),
        ):
            if isfinite(getattr(before, name)):
                values = {"before": getattr(before, name), "after": getattr(after, name), "noise_floor": floor}
                yield {"channel": channel, "unit": unit, "runs": runs, **values}


VIEW = View("extension", line, page, frames, lambda found: "+".join(found.gain.added), figures)
