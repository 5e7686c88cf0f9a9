"""What an import of a damaged log must be asked for, where a plain one is refused: what is left of it, or to accept a gap."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

from fieldsid.errors import FieldsidError
from fieldsid.logs.convert.conditioning import MAIN, MAX_GAP_S, gaps_in
from fieldsid.logs.importing import Importer
from fieldsid.logs.reader import WORTH_SALVAGING
from fieldsid.logs.run import Note, Run

LEFT_OUT = frozenset({"truncated", "bad_rows", "not_a_number", "no_time", "time_order"})
"""Codes of what a reading that takes all it can get has left out."""


@dataclass(frozen=True, slots=True)
class WayIn:
    """The options with which a log is imported, none where it is as it is; and why a plain import is refused."""

    options: tuple[str, ...] = ()
    refusal: FieldsidError | None = None


def way_in(path: Path, run: Run, notes: Iterable[Note], plain: Importer) -> WayIn:
    """Return how a log is imported of which `run` is all that could be read, with `notes` on it: the first way it is not refused.

    A log of which nothing was left out, and that has no long gap, is not read again: nothing of it is refused.
    """
    notes = list(notes)
    longest = max((g.length_s for s in MAIN if run.has(s) for g in gaps_in(run.time, run[s])), default=0.0)
    if longest <= MAX_GAP_S and not any(n.code in LEFT_OUT for n in notes):
        return WayIn()
    refusal: FieldsidError | None = None
    is_worth = _left(notes) >= WORTH_SALVAGING
    for options, importer in _ways(plain, round(longest + 0.1, 1), salvaging=is_worth):
        try:
            importer.read(path)
        except FieldsidError as error:
            refusal = refusal or error
        else:
            return WayIn(options, refusal)
    return WayIn((), refusal)


def _left(notes: Iterable[Note]) -> float:
    """Return the least share of the log's samples that a reading kept whose time repeats or goes back."""
    return min((1.0 - n.data["dropped"] / n.data["of"] for n in notes if n.code == "time_order"), default=1.0)


def _ways(plain: Importer, gap_s: float, *, salvaging: bool) -> Iterator[tuple[tuple[str, ...], Importer]]:
    for salvage in (False, True) if salvaging else (False,):
        asked = ("--salvage",) if salvage else ()
        yield asked, replace(plain, salvage=salvage)
        yield (*asked, "--max-gap", f"{gap_s:g}"), replace(plain, salvage=salvage, max_gap_s=gap_s)
