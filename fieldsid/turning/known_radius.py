"""How a radius is told: a number with its band, or the band alone where that is too wide for a number to be known."""

from __future__ import annotations

from fieldsid.rounding import number

MAX_KNOWN_WIDTH = 0.35
"""Widest 95 % band of a turn that counts as identified, over the radius: beyond it no number is known, but the band."""
BRACKETED = "radius in brackets: these runs tell the band, not the number"


def is_band_only(radius: float, band: tuple[float, float]) -> bool:
    """Return whether a band (m, m) is too wide for the radius (m) in it to be known."""
    return band[1] - band[0] > MAX_KNOWN_WIDTH * radius


def radius_cell(radius: float, band: tuple[float, float]) -> str:
    """Return a radius (m) for a table, in brackets where the band alone is known."""
    return f"({number(radius, 3)})" if is_band_only(radius, band) else number(radius, 3)


def turn_words(radius: float, band: tuple[float, float], where: str) -> str:
    """Return `4.90 m to port, 95 % 4.39 .. 5.48 m` of a turn somewhere, or `between 4.39 and 9.48 m (95 %) to port`."""
    low, high = number(band[0], 3), number(band[1], 3)
    if is_band_only(radius, band):
        return f"between {low} and {high} m (95 %) {where}"
    return f"{number(radius, 3)} m {where}, 95 % {low} .. {high} m"
