"""Stamps with too few digits, whose samples share them: the even steps of the logger that they were rounded from.

A logger of an even step writes t0 + k T, rounded to a digit: whole seconds of an epoch, or three digits of a number that has
grown. If one t0 and T explain every stamp of a stretch within its last digit, the samples lie there; no digit is invented
where they do not. Steps of a clock that drifts are taken where each stamp is followed by the next one of that digit: then the
samples of one stamp are spread to the next.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import numpy.typing as npt

from fieldsid.logs.convert.times.clock_text import FEW_STEPS
from fieldsid.logs.run import Note
from fieldsid.numerics.arrays import FloatArray

FEWEST = 10
WORN_OUT = 0.05
"""Share of a last digit that a number's last bit may be worth, above which any number would pass for whole."""
DIGITS = range(2, 8)
DECIMALS = range(-9, 9)
WITHIN = 1.0 + 1e-6
"""Last digits by which a stamp may be off: half of one where it was rounded, up to one where it was cut."""
ROUGH = 0.25
"""Share of a step from which on the last digit of its stamps makes steps uneven that are not."""
SAME = 1e-3
"""Share of a step within which stamps are at even steps already: 0.2, 0.4, 0.6 has all the digits that it needs."""
MOST = 99.0
"""Percentile of the steps up to which they tell the usual one: what is longer may be a gap."""
SHORT = 3.0
"""Last digits that a stretch must go on by to tell its own step."""
IN_TURN = 0.9
"""Share of the changes of a stamp that are one last digit, from which on a clock that drifts is taken for coarse."""


def rebuilt(time: FloatArray, name: str) -> tuple[FloatArray, list[Note]]:
    """Return times (n,) with too few digits at the logger's even steps, and the note that says so; else as they are.

    `time` is in the column's own unit, from its own zero: its digits tell what it was rounded to. A row whose time is missing
    counts as a step, where that explains the others.
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
            if not shared and float(np.max(np.abs(even - stamps))) < SAME * float(np.median(steps)):
                return time, []
            whole = time.copy()
            whole[seen] = even
            return whole, [_note(name, stamps)]
    return time, []


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
    """Return what the last digit (n,) of each stamp may be worth: of so many digits in all, or behind the point."""
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
        found.append(np.full(stamps.size, least))  # samples that were sent together have the stamp of their message
    return found


def _whole(numbers: FloatArray, last_bit: float = 0.0) -> bool:
    """Whether numbers are whole within what their last bit is worth, and not all zero for being counted in too large a unit."""
    if not bool(np.abs(numbers).max() >= 1.0) or last_bit > WORN_OUT:
        return False
    return bool(np.all(np.abs(numbers - np.round(numbers)) <= 1e-6 + last_bit + 1e-12 * np.abs(numbers)))


def _even(stamps: FloatArray, last: FloatArray, rows: npt.NDArray[np.intp]) -> FloatArray | None:
    """Return the even steps (n,) of each stretch between gaps, of stamps in these rows (n,); None where one has none."""
    whole, steps = np.empty_like(stamps), np.diff(stamps)
    usual = float(np.mean(steps[steps <= np.percentile(steps, MOST)]))
    gaps = [int(i) + 1 for i in np.flatnonzero(steps > 2.0 * last[1:] + FEW_STEPS * usual)]
    for begin, end in pairwise([0, *gaps, stamps.size]):
        part = _of_stretch(stamps[begin:end], last[begin:end], usual, rows[begin:end] - rows[begin])
        if part is None:
            return None
        whole[begin:end] = part
    return whole if bool((np.diff(whole) > 0.0).all()) else None


def _of_stretch(stamps: FloatArray, last: FloatArray, usual: float, rows: npt.NDArray[np.intp]) -> FloatArray | None:
    count = rows.astype(np.float64)
    if stamps[-1] - stamps[0] < SHORT * last[-1]:
        even = stamps[0] + usual * count
    else:
        # A stamp weighs as its last digit allows: the early ones of a number that grows are the finer ones.
        slope, start = np.polyfit(count, stamps, 1, w=1.0 / last)
        even = start + slope * count
    if bool((np.abs(even - stamps) <= WITHIN * last).all()):
        return np.asarray(even)
    return _spread(stamps, last) if bool((np.diff(stamps) == 0.0).any()) else None


def _spread(stamps: FloatArray, last: FloatArray) -> FloatArray | None:
    """Return the samples of each stamp spread to the next one (n,), where the stamps follow each other digit by digit."""
    steps = np.diff(stamps)
    changed = np.flatnonzero(steps > 0.0) + 1
    if changed.size < 2 or float(np.isclose(steps[changed - 1], last[changed], rtol=1e-6).mean()) < IN_TURN:
        return None
    known, at = stamps[changed], changed.astype(np.float64)
    usual = float((known[-1] - known[0]) / (at[-1] - at[0]))
    count = np.arange(stamps.size, dtype=np.float64)
    inside = np.interp(count, at, known)
    before, after = count < at[0], count > at[-1]
    inside[before] = known[0] + usual * (count[before] - at[0])
    inside[after] = known[-1] + usual * (count[after] - at[-1])
    return inside
