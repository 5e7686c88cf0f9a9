"""The decision whether a proposed mapping is used without confirmation by the user.

It is used where names state the signals that an axis needs, the numbers agree with them, and their units are known. A signal in
doubt is reported with the reason; it is left out where no axis needs it, else the user must write a mapping.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

from fieldsid.logs.channels import ATTITUDE, ChannelMap, is_enough
from fieldsid.logs.doctor.angle_and_rate import CONTRADICTING
from fieldsid.logs.mapping.draft import place_of
from fieldsid.logs.mapping.trial import Proposal
from fieldsid.logs.run import ANGLES, READ_AS, Note

DOUBT_REASONS: Mapping[str, str] = MappingProxyType(
    {"alternatives": "it may be another one", "left_out": "it cannot be read", "frame_open": "port and starboard are open",
     "course_against": "the course goes against it", "course_slope": "the course turns otherwise", "unit": "its unit is open",
     "course_offset": "the course is off it", "fin_range": "no fin goes so far", "fin_late": "the motion comes before it",
     "no_side": "its side is open",
     "rate_scale": "angle and rate differ", "constant": "it never moves", "speed_unit": "its unit is open",
     "depth_unit": "its unit is open", "dive_sign": "its sign is open", "speed_sign": "its sign is open",
     "over_ground": "it may be a course over ground"}
    | dict.fromkeys(CONTRADICTING - {"unit"}, "angle and rate contradict each other")
)  # fmt: skip
"""The reason, in words, for the doubt about a signal, by the code of the note that names the signal."""
CONTRARY = CONTRADICTING | {"rate_scale"}
"""Codes of notes that an angle and a rate are not of one motion as they are read."""
TIME_DOUBTS = frozenset({"rate_guessed", "time_guessed", "time_unit", "time_scale"})
"""Codes of notes that put the time in doubt, and hence all signals."""


@dataclass(frozen=True, slots=True)
class Certain:
    """A mapping that is used without confirmation, or None; its notes; and the reason for the doubt about each signal.

    `against` holds the findings that two proposed signals contradict each other, by the place of each signal.
    """

    mapping: ChannelMap | None
    notes: tuple[Note, ...]
    doubts: Mapping[str, str]
    against: tuple[tuple[Note, Mapping[str, str]], ...] = ()

    def left_out_beside(self, read: Collection[str]) -> list[Note]:
        """Return the notes on signals that are not read because they contradict one that is."""
        pairs = [(n, places, s) for n, places in self.against if places.keys() & read for s in places if s not in read]
        return [
            Note("left_out", f"{s} from `{places[s]}` is not read, and contradicts what is: {n.message}", {"signal": s, **n.data})
            for n, places, s in pairs
        ]


def certain_of(proposal: Proposal) -> Certain:
    """Return the signals of a proposed mapping that are beyond doubt, where they suffice for an axis."""
    from fieldsid.logs.mapping.mapping_file import mapping_of

    signals = proposal.body["signals"]
    notes = (*proposal.notes, *(() if proposal.run is None else proposal.run.notes))
    doubts = {s: n.message for n in notes if n.code in TIME_DOUBTS for s in ("time",)} | _doubts(signals, notes)
    sure = {s: item for s, item in signals.items() if s not in doubts}
    against = tuple(
        (n, {s: place_of(signals[s]) for s in n.data.get("signals", ()) if s in signals}) for n in notes if n.code in CONTRARY
    )
    if proposal.run is None or not is_enough(sure) or "time" in doubts:
        return Certain(None, (), MappingProxyType(doubts), against)
    mapping = mapping_of(proposal.body | {"signals": sure})
    return Certain(mapping, (_read_as_note(sure, doubts),), MappingProxyType(doubts), against)


def _doubts(signals: Mapping[str, Any], notes: Iterable[Note]) -> dict[str, str]:
    found: dict[str, str] = {}
    for note in notes:
        named = (note.data.get("signal"), *note.data.get("signals", ()))
        if note.code == "unit_assumed":
            found |= dict.fromkeys(note.data["signals"], "nothing tells its unit")
        elif note.code == "evidence" and ({"column", "outputs"} & note.data.keys() or "sign" in str(note.data.get("finding"))):
            found[note.data["signal"]] = "only the numbers say so"
        elif note.code in DOUBT_REASONS:
            found |= {s: DOUBT_REASONS[note.code] for s in named if s in signals or s in ANGLES}
    if ATTITUDE in signals and (angles := [s for s in ANGLES if s in found]):
        # in motion in one plane two of the three angles are constant
        moves = [s for s in angles if found[s] != DOUBT_REASONS["constant"]]
        found |= {ATTITUDE: found[moves[0] if moves else angles[0]]} if moves or len(angles) == len(ANGLES) else {}
    return found


def _read_as_note(sure: Mapping[str, Any], doubts: Mapping[str, str]) -> Note:
    """Return the note that states how a log is read: each signal with its column and unit, and the signals left out."""
    parts = [f"{_short(s)} from {place_of(item)}{_unit(item)}" for s, item in sure.items()]
    left = [f"{_short(s)} ({why})" for s, why in doubts.items()]
    message = f"read as: {', '.join(parts)}" + (f"; left out: {', '.join(left)}" if left else "")
    return Note(READ_AS, message, {"signals": list(sure), "left_out": list(doubts)})


def _short(signal: str) -> str:
    """Return a signal without its unit, as `yaw rate` for yaw_rate_rad_s."""
    for suffix in ("_rad_s", "_m_s", "_rad", "_m"):
        signal = signal.removesuffix(suffix)
    return signal.replace("_", " ")


def _unit(item: Mapping[str, Any]) -> str:
    centre = f" about {item['centre']:g}" if "centre" in item else ""
    return f" ({item['unit']}{centre})" if "unit" in item else ""
