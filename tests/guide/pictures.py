"""Figures as small PNG files: few colours, the same bytes from the same drawing; and whether two show the same."""

from __future__ import annotations

from functools import cache
from io import BytesIO

import matplotlib as mpl
import numpy as np
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from PIL import Image
from PIL.PngImagePlugin import PngInfo

from fieldsid.figures import canvas
from fieldsid.figures.drawn import COLOURS

DPI = 96
LARGEST = 28_000
"""Bytes of a figure at most."""
WHOLE = (0.0, 0.0, 1.0, 1.0)
CELL = 12
"""Pixels of the squares that two figures are compared by."""
ALIKE, MOST = 8.0, 0.15
"""Grey levels (0 to 255) that one square, and squares on average, may differ by: what a last bit does to a curve."""
ALIKE_REDRAWN, MOST_REDRAWN = 30.0, 1.5
"""The same where another version of the library has drawn: it moves letters, ticks and margins by a pixel or two."""
DRAWN_BY = "Software"
SERIES = (canvas.SIMULATED, canvas.SECOND, canvas.THIRD, canvas.FOURTH, canvas.WARM, "#56B4E9", "0.2")
"""The colours of lines and marks."""
GREYS = (0, 51, 64, 115, 153, 191, 204, 229, 242, 255)
"""Those of lines, dots, bars, bands and grids, and what lies between them and white."""


def small_png(figure: Figure) -> bytes:
    """Return a figure as a PNG of few colours."""
    buffer = BytesIO()
    figure.savefig(buffer, format="png", dpi=DPI)
    return _reduced(Image.open(buffer).convert("RGB"))


def part_of(png: bytes, scale: float, box: tuple[float, float, float, float] = WHOLE) -> bytes:
    """Return a part of a PNG, its left, top, right and bottom as shares of the whole, at another scale and of few colours."""
    whole = Image.open(BytesIO(png)).convert("RGB")
    image = whole.crop(tuple(round(share * size) for share, size in zip(box, whole.size * 2, strict=True)))
    return _reduced(image.resize((round(image.width * scale), round(image.height * scale)), Image.Resampling.LANCZOS))


def alike(was: bytes, now: bytes) -> bool:
    """Whether two figures show the same, but for what another processor or another version of the library makes of them."""
    a, b = _cells(was), _cells(now)
    if a.shape != b.shape:
        return False
    off, again = np.abs(a - b), _drawn_by(was) == _drawn_by(now)
    most, mean = (ALIKE, MOST) if again else (ALIKE_REDRAWN, MOST_REDRAWN)
    return bool(off.max() <= most and off.mean() <= mean)


def _drawn_by(png: bytes) -> object:
    return Image.open(BytesIO(png)).info.get(DRAWN_BY)


def _reduced(image: Image.Image) -> bytes:
    out, info = BytesIO(), PngInfo()
    info.add_text(DRAWN_BY, f"Matplotlib {mpl.__version__}")
    image.quantize(palette=_palette(), dither=Image.Dither.NONE).save(out, format="png", optimize=True, pnginfo=info)
    return out.getvalue()


@cache
def _palette() -> Image.Image:
    """Return a palette of greys, and of the colours that figures are drawn in with their blends towards white."""
    greys = [[v] * 3 for v in GREYS]
    colours = [[round(255 * v) for v in to_rgb(c)] for c in (*SERIES, COLOURS["limit"])]
    blends = [[round(255 - share * (255 - v)) for v in colour] for colour in colours for share in (1.0, 0.5, 0.18)]
    image = Image.new("P", (1, 1))
    image.putpalette([v for colour in (*greys, *blends) for v in colour])
    return image


def _cells(png: bytes) -> np.ndarray:
    grey = np.asarray(Image.open(BytesIO(png)).convert("L"), dtype=float)
    rows, columns = (n // CELL for n in grey.shape)
    return grey[: rows * CELL, : columns * CELL].reshape(rows, CELL, columns, CELL).mean(axis=(1, 3))
