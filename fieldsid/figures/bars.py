"""Bars that several figures and the report show: the error with each model of a line or a diagnosis, and where a model fails."""

from __future__ import annotations

from collections.abc import Sequence
from math import degrees, isfinite
from typing import TYPE_CHECKING

from fieldsid.figures.panel import Bar, Bars
from fieldsid.rounding import DEGREES, MANY, RADIANS, Angles, noise_fall

if TYPE_CHECKING:
    from fieldsid.comparison.localize import Place
    from fieldsid.diagnosis.records import Pair
    from fieldsid.extension.extend import Gain
    from fieldsid.models.model import Noise

MOST_PLACES = 10
LOOKS_AT = "beside a bar: rms there over that of the whole run"


def places(where: Sequence[Place], title: str = "", most: int = MOST_PLACES) -> Bars:
    """Return the conditions worse than the rest, the worst first: share of the squared error less that of the samples, in %."""
    worse = sorted((p for p in where[:most] if p.beyond > 0.0), key=lambda p: -p.beyond)
    rows = [Bar(DEGREES.words(p.condition), 100.0 * p.beyond, f"{p.rms_ratio:.2f} x", stands_out=p is worse[0]) for p in worse]
    return Bars("share of the squared error\nbeyond that of the time, %", rows, title=title)


def errors(models: Sequence[tuple[str, Pair, Noise, str]], named: str, *, noiseless: bool, title: str = "") -> Bars:
    """Return the error of models on unseen and on fitted runs over the noise floor; where there are no unseen ones, on these.

    models: of each its name, errors, noise floor and further words. named: the one that stands out. In a log without noise the
    errors are over those of the first model.
    """
    from fieldsid.models.model import Noise

    first = models[0][1]
    judged = any(isfinite(pair.validation.mean) for _, pair, _, _ in models)
    rows = []
    for name, pair, floor, more in models:
        sides = ((pair.train, first.train), (pair.validation, first.validation))
        fitted, unseen = (e.over(Noise(of.angle_rms_rad, of.rate_rms_rad_s) if noiseless else floor) for e, of in sides)
        value = unseen if judged else fitted
        says = sides[judged][0].sized("deg", degrees(1.0)) if noiseless else f"{value:.2f} x"
        rows.append(Bar(name, value, says + more, fitted if judged else float("nan"), stands_out=name == named))
    label = f"free-run error over {f'that of the {models[0][0]}' if noiseless else 'the noise floor'}"
    runs = ("unseen runs", "fitted runs") if judged else ("fitted runs", "")
    return Bars(label, rows, *runs, mark="" if noiseless else "noise floor", title=title)


def steps(gains: Sequence[Gain], before: Sequence[str], title: str = "") -> Bars:
    """Return the error of a model with some effects before any addition, and after each of several."""
    models = [(", ".join(before) or "plain model", gains[0].before, gains[0].noise_floor, "")]
    models += [(f"+ {', '.join(g.added)}", g.after, g.noise_floor, "") for g in gains]
    return errors(models, models[-1][0], noiseless=gains[0].over_floor[0] >= MANY, title=title)


def fall(gains: Sequence[Gain], angles: Angles = RADIANS) -> str:
    """Return how the error falls with additions, in words: over the noise floor, or in its own units where a log has no noise."""
    before, after = gains[0].over_floor[0], gains[-1].over_floor[1]
    where = "unseen data" if gains[-1].unseen else "the runs fitted to"
    sizes = (e.sized(angles.unit, angles.factor) for e in (gains[0].judged[0], gains[-1].judged[1]))
    return f"the error on {where} goes from {noise_fall(before, after) if before < MANY else ' to '.join(sizes)}"
