"""The figure of several models over one run: what was measured, and each model's free run over it."""

from __future__ import annotations

from collections.abc import Sequence

from fieldsid.comparison.compare import Comparison
from fieldsid.figures import motion
from fieldsid.figures.panel import Picture

KINDS = ("simulated", "second", "third", "fourth", "warm", "#56B4E9", "0.2")


def figure(found: Sequence[Comparison], names: Sequence[str]) -> Picture:
    """Return angle, rate, fin and the residual of each model in the most informative channel."""
    over = ", ".join(f"{n} {c.over_noise:.2f} x" for n, c in zip(names, found, strict=True))
    shown = [(name, kind, c.shown) for name, kind, c in zip(names, KINDS * len(found), found, strict=False)]
    title = f"{found[0].run}: error over the noise: {over}"
    return Picture(title, (10.0, 7.5), (motion.panels(shown, found[0].floor),))
