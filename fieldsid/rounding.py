"""A value and its error, rounded together by the rule of the Particle Data Group (Review of Particle Physics, 5.3).

And a number rounded for decisions: processors sum in different orders, and numbers that differ by that only must count as equal.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from re import Match
from re import compile as pattern

MANY = 100.0
"""Ratio of error to noise from which on a log counts as one without noise, as from a towing tank or a simulation."""
ROUNDED_SHARE = 1e-12
"""Relative error of a value below which the error is due to rounding of doubles."""
MOST_DIGITS = 9
"""Significant digits of a number that do not depend on the order of summation."""
TWO_SIDED_95 = 1.96
"""Quantile 0.975 of the normal distribution: half the width of a 95 % interval in standard errors."""


def digits_of_error(error: float) -> int:
    """Return the decimals to keep: two digits of an error whose leading three are 100..354 or 950..999, else one."""
    exponent = math.floor(math.log10(error))
    leading = round(error / 10.0 ** (exponent - 2))
    if leading >= 1000:
        exponent, leading = exponent + 1, 100
    if leading >= 950:
        return -exponent
    return 1 - exponent if leading <= 354 else -exponent


def times_noise(error: float, of: str = "the noise") -> str:
    """Return an error over the noise in words; for a log without noise there is no factor."""
    return f"{error:.2f} x {of}" if error < MANY else f"far more than {of}, of which the log has next to none"


def noise_fall(before: float, after: float, of: str = "the noise floor") -> str:
    """Return in words the error over the noise before and after."""
    return f"{f'{before:.2f}' if before < MANY else f'{times_noise(before, of)},'} to {times_noise(after, of)}"


def nine_digits(value: float) -> float:
    """Return a number rounded to nine digits, as later ones depend on the order of summation."""
    return float(f"{value:.8e}")


def with_error(value: float, error: float, *, sign: str = "+/-") -> str:
    """Return `2.281 +/- 0.013`; the value alone, to four digits, where the error is not positive or only due to rounding."""
    if not math.isfinite(value):
        return "-"
    if not (math.isfinite(error) and error > ROUNDED_SHARE * abs(value)):
        return number(value)
    decimals = digits_of_error(error)
    shown = max(decimals, 0)
    return f"{round(value, decimals) + 0.0:.{shown}f} {sign} {round(error, decimals):.{shown}f}"


def at_its_bound(value: float) -> str:
    """Return `20.00 (at its bound)`, as a value on a bound has no error."""
    return f"{number(value)} (at its bound)"


def interval(low: float, high: float) -> str:
    """Return `2.256 .. 2.306`, both ends to one digit more than the half width's own rounding shows."""
    half = 0.5 * (high - low)
    if not (math.isfinite(half) and half > 0.0):
        return "-"
    decimals = max(digits_of_error(half) + 1, 0)
    return f"{low:.{decimals}f} .. {high:.{decimals}f}"


def number(value: float | None, digits: int = 4) -> str:
    """Return a number to some significant digits without an exponent where that is short; `-` where there is none."""
    if value is None or not math.isfinite(value):
        return "-"
    if value == 0.0:
        return "0"
    exponent = math.floor(math.log10(abs(value)))
    if -5 <= exponent < 7:
        return f"{value:.{max(digits - 1 - exponent, 0)}f}"
    return f"{value:.{digits - 1}e}"


def number_against(value: float, limit: float, digits: int = 3) -> str:
    """Return a number to `digits` significant digits, or more where they are needed to show on which side of a limit it is."""
    for more in range(digits, MOST_DIGITS):
        shown = number(value, more)
        if not math.isfinite(value) or value == limit or (float(shown) - limit) * (value - limit) > 0.0:
            return shown
    return number(value, MOST_DIGITS)


def probability(p: float) -> str:
    """Return a probability to three digits, or as a bound: `0.982`, `> 0.999`."""
    return f"{p:.3f}" if 0.001 <= p <= 0.999 else "< 0.001" if p < 0.001 else "> 0.999"


def p_value(p: float) -> str:
    """Return a p-value with its relation: `p = 0.031`, and `p < 0.001` below that, where a tail probability is not reliable."""
    return f"p = {p:.2g}" if p >= 0.001 else "p < 0.001"


def in_unit(unit: str) -> str:
    """Return a unit as it is printed after a number: empty for the unit 1 of a dimensionless number."""
    return "" if unit == "1" else unit


@dataclass(frozen=True, slots=True)
class Angles:
    """The unit in which angles are shown, and the factor from rad: all conversions for display are made here."""

    unit: str
    factor: float

    def of(self, unit: str) -> tuple[float, str]:
        """Return the factor by which a number in a unit is multiplied for display, and its unit then; empty for the unit 1.

        Every radian in the unit is converted, with its exponent.
        """
        if self.factor == 1.0 or "rad" not in unit:
            return 1.0, in_unit(unit)
        above, _, below = unit.partition("/")
        power = above.count("rad") + above.count("rad^2") - below.count("rad") - below.count("rad^2")
        return self.factor**power, unit.replace("rad", self.unit)

    def estimate(
        self, value: float, std_error: float, interval95: Sequence[float], unit: str, *, at_bound: bool = False
    ) -> tuple[str, str, str]:
        """Return an estimate as the cells of a table: value with its error, unit, 95 % interval; on a bound the value alone."""
        factor, unit = self.of(unit)
        if at_bound:
            return at_its_bound(factor * value), unit, "-"
        low, high = interval95
        return with_error(factor * value, factor * std_error), unit, interval(factor * low, factor * high)

    def words(self, text: str) -> str:
        """Return a sentence with the angles in it converted for display: `rate: 0.05 .. 0.1 rad/s`."""
        return text if self.factor == 1.0 else _ANGLE.sub(self._turned, text)

    def _turned(self, found: Match[str]) -> str:
        numbers = [f"{float(found[name]) * self.factor:.3g}" for name in ("low", "high") if found[name]]
        return f"{' .. '.join(numbers)} {self.unit}{found['rest']}"


_ANGLE = pattern(r"(?P<low>-?[\d.]+)(?: \.\. (?P<high>-?[\d.]+))? rad\b(?P<rest>(?:/s(?:\^2)?)?)")
RADIANS, DEGREES = Angles("rad", 1.0), Angles("deg", 180.0 / math.pi)
