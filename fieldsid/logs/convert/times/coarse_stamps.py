"""Rebuild stamps with too few digits, which several samples share, from the even steps of the logger.

A logger with a constant step writes t0 + k T, rounded to its last digit: whole seconds of an epoch, or three digits of a number
that has grown. If one t0 and T explain every stamp of a stretch within its last digit, the stamps are replaced by t0 + k T; else
they are left unchanged. For a clock that drifts no such t0 and T exist; if its stamps increase by one last digit at a time, the
samples of each stamp are spread evenly up to the next stamp.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import numpy.typing as npt

from fieldsid.logs.convert.times.clock_text import FEW_STEPS
from fieldsid.logs.few_of import FEW, FEWEST, NEARLY_ALL
from fieldsid.logs.run import Note
from fieldsid.numerics.arrays import FloatArray

DIGITS = range(2, 8)
DECIMALS = range(-9, 9)
WITHIN = 1.0 + 1e-6
"""Largest error of a stamp in units of its last digit: half of one where it was rounded, up to one where it was truncated."""
ROUGH = 0.25
"""Smallest last digit, as a share of the median step, that makes even steps look uneven."""
SAME = 1e-3
"""Share of a step within which a step is a whole multiple of it: 0.2, 0.4, 0.6 have all the digits that they need."""
BY_TURNS = 1.25
"""Largest range of the errors of rounded stamps, in units of the last digit: one, and what the line through them is off."""
MOST = 99.0
"""Percentile of the steps up to which they are averaged to the usual step: longer ones may be gaps."""
SHORT = 3.0
"""Smallest length of a stretch, in units of the last digit, from which its step is estimated from its stamps."""


def rebuilt(time: FloatArray, name: str) -> tuple[FloatArray, list[Note]]:
    """Return times (n,) with too few digits replaced by the even steps of the logger, and a note; else the times unchanged.

    `time` is in the unit of the column and from its zero, because its digits show how it was rounded. A row whose time is missing
    counts as a step, if the other stamps are explained that way.
    """
    seen = np.flatnonzero(np.isfinite(time))
    stamps = time[seen]
    steps = np.diff(stamps)
    if stamps.size < FEWEST or bool((steps < 0.0).any()):
        return time, []
    shared = bool((steps == 0.0).any())
    for last in _last_digits(stamps):
        if not shared and float(np.median(last)) < ROUGH * float(np.median(steps)):
            continue
        even = next((e for rows in (seen, np.arange(seen.size)) if (e := _even(stamps, last, rows)) is not None), None)
        if even is not None:
            if not shared and _rows_are_missing(steps, (even - stamps) / last):
                return time, []
            rebuilt_time = time.copy()
            rebuilt_time[seen] = even
            return rebuilt_time, [_note(name, stamps)]
    return time, []


def _rows_are_missing(steps: FloatArray, off: FloatArray) -> bool:
    """Whether steps (n - 1,) are whole multiples of the usual one as rows that are missing leave them, here and there.

    A step that is no whole number of last digits is now and then rounded to one more, but by turns, so that the even steps are
    nowhere further `off` (n,) than the last digit is worth.
    """
    usual = float(np.median(steps))
    at_once = steps / usual
    if float(np.max(np.abs(at_once - np.round(at_once)))) > SAME:
        return False
    return int((at_once > 1.5).sum()) < FEWEST or float(np.ptp(off)) > BY_TURNS


def _note(name: str, stamps: FloatArray) -> Note:
    shared = int((np.diff(stamps) == 0.0).sum())
    why = (
        f"{shared} of {stamps.size} samples have the stamp of the one before"
        if shared
        else "its last digit is rough for its steps"
    )
    message = (
        f"`{name}` has too few digits: {why}; all were set at the even steps that explain the stamps within their last digit"
    )
    return Note("coarse_time", message, {"count": shared, "of": int(stamps.size)})


def _last_digits(stamps: FloatArray) -> list[FloatArray]:
    """Return candidates of the value (n,) of each stamp's last digit: by a fixed number of significant digits or decimals.

    A third candidate is the smallest step, if all steps are multiples of it.
    """
    found = []
    size = np.abs(stamps)
    with np.errstate(divide="ignore"):
        places = np.where(size > 0.0, np.floor(np.log10(np.where(size > 0.0, size, 1.0))), 0.0)
    for digits in DIGITS:
        unit = 10.0 ** (places - digits + 1)
        if _whole(stamps / unit):
            found.append(unit)
            break
    for decimals in DECIMALS:
        if _whole((stamps - stamps[0]) * 10.0**decimals, float(np.spacing(size.max())) * 10.0**decimals):
            found.append(np.full(stamps.size, 10.0**-decimals))
            break
    steps = np.diff(stamps)
    ahead = steps[steps > 0.0]
    if FEWEST <= ahead.size <= 0.5 * steps.size and _whole(ahead / (least := float(ahead.min()))):
        found.append(np.full(stamps.size, least))  # samples sent together share the stamp of their message
    return found


def _whole(numbers: FloatArray, last_bit: float = 0.0) -> bool:
    """Whether numbers are whole within `last_bit`, the value of their last bit, and not all zero in too large a unit.

    A last bit that is worth more than the share FEW of a unit would make any number whole. A last digit tells apart what
    differs: an epoch near a round number is not whole in millions of seconds.
    """
    whole = np.round(numbers)
    made_equal = np.diff(whole)[np.diff(numbers) != 0.0] == 0.0
    if not bool(np.abs(numbers).max() >= 1.0) or last_bit > FEW or bool(made_equal.any()):
        return False
    return bool(np.all(np.abs(numbers - whole) <= 1e-6 + last_bit + 1e-12 * np.abs(numbers)))


def _even(stamps: FloatArray, last: FloatArray, rows: npt.NDArray[np.intp]) -> FloatArray | None:
    """Return the even times (n,) of stamps in some rows (n,), for each stretch between gaps; None where a stretch has none."""
    even, steps = np.empty_like(stamps), np.diff(stamps)
    usual = float(np.mean(steps[steps <= np.percentile(steps, MOST)]))
    gaps = [int(i) + 1 for i in np.flatnonzero(steps > 2.0 * last[1:] + FEW_STEPS * usual)]
    for begin, end in pairwise([0, *gaps, stamps.size]):
        part = _even_in_stretch(stamps[begin:end], last[begin:end], usual, rows[begin:end] - rows[begin])
        if part is None:
            return None
        even[begin:end] = part
    return even if bool((np.diff(even) > 0.0).all()) else None


def _even_in_stretch(stamps: FloatArray, last: FloatArray, usual: float, rows: npt.NDArray[np.intp]) -> FloatArray | None:
    count = rows.astype(np.float64)
    if stamps[-1] - stamps[0] < SHORT * last[-1]:
        even = stamps[0] + usual * count
    else:
        # The weight of a stamp is the inverse of its last digit: with a fixed number of digits the early stamps are finer.
        slope, start = np.polyfit(count, stamps, 1, w=1.0 / last)
        even = start + slope * count
    if bool((np.abs(even - stamps) <= WITHIN * last).all()):
        return np.asarray(even)
    return _spread(stamps, last) if bool((np.diff(stamps) == 0.0).any()) else None


def _spread(stamps: FloatArray, last: FloatArray) -> FloatArray | None:
    """Return the times (n,) of samples spread evenly from each stamp to the next; None unless stamps rise by one last digit."""
    steps = np.diff(stamps)
    changed = np.flatnonzero(steps > 0.0) + 1
    if changed.size < 2 or float(np.isclose(steps[changed - 1], last[changed], rtol=1e-6).mean()) < NEARLY_ALL:
        return None
    known, at = stamps[changed], changed.astype(np.float64)
    usual = float((known[-1] - known[0]) / (at[-1] - at[0]))
    count = np.arange(stamps.size, dtype=np.float64)
    inside = np.interp(count, at, known)
    before, after = count < at[0], count > at[-1]
    inside[before] = known[0] + usual * (count[before] - at[0])
    inside[after] = known[-1] + usual * (count[after] - at[-1])
    return inside
