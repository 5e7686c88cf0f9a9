"""A gain schedule: rows over speed, what it refers to and where it came from; saved and loaded as `fieldsid/schedule/1`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from fieldsid.artifacts import save_record
from fieldsid.display import Brief, Displayed, InControl, Plotted
from fieldsid.errors import ArtifactError
from fieldsid.logs.run import Note
from fieldsid.logs.wrong_file import unless_log
from fieldsid.models.allocation import PlaneFins, plane_fins_of
from fieldsid.models.axis import NAMES, Axis
from fieldsid.records.check import ShapeError
from fieldsid.records.reading import load_record
from fieldsid.schedule.controller import Gains
from fieldsid.schedule.wish import PROPORTIONAL, QUICKEST, Wish

KIND = "fieldsid/schedule"
COLUMNS = ("speed_m_s", "kp", "ki", "kd", "feed_forward_rad", "reference_gain", "fin_limit_rad", "depth_gain", "supported")
"""What every export writes, in this order; depth_gain in pitch only."""


@dataclass(frozen=True, slots=True, repr=False)
class Row(Displayed):
    """Gains at one speed: fin = kp e + ki int e - kd rate + feed_forward + reference_gain ref, limited to fin_limit.

    depth_gain (pitch): pitch reference = depth_gain (depth - depth wanted), rad/m, nose up positive. Margins are the least over
    95 % of the draws; `draws_held` is the share of them that come to rest from the step, within `settling`. `binds` says what
    keeps the gains from more bandwidth, `fin_use` which share of the fin's limit the step asks for.
    """

    speed: float
    gains: Gains
    feed_forward: float
    reference_gain: float
    fin_limit: float
    depth_gain: float = 0.0
    supported: bool = True
    slowed: float = 1.0
    phase_margin_deg: float = float("nan")
    gain_margin_db: float = float("nan")
    delay_margin_s: float = float("nan")
    draws_held: float = float("nan")
    settling: float = float("nan")
    binds: str = ""
    fin_use: float = float("nan")

    def record(self) -> dict[str, Any]:
        """Return the row by the names an export writes, with its margins."""
        return {
            "speed_m_s": self.speed,
            "kp": self.gains.kp,
            "ki": self.gains.ki,
            "kd": self.gains.kd,
            "feed_forward_rad": self.feed_forward,
            "reference_gain": self.reference_gain,
            "fin_limit_rad": self.fin_limit,
            "depth_gain": self.depth_gain,
            "supported": self.supported,
            "slowed": self.slowed,
            "phase_margin_deg": self.phase_margin_deg,
            "gain_margin_db": self.gain_margin_db,
            "delay_margin_s": self.delay_margin_s,
            "draws_held": self.draws_held,
            "settling_s": self.settling,
            "binds": self.binds,
            "fin_use": self.fin_use,
        }


@dataclass(frozen=True, slots=True, repr=False)
class Answer(Brief):
    """The answer that rows were designed for: all settle from `step` (rad) within `settling` s, 0 where each has its own.

    The rest is what was asked: settling (s), bandwidth (rad/s), overshoot and fin as shares, None where it was not.
    """

    settling: float = QUICKEST
    step: float | None = None
    asked_settling: float | None = None
    bandwidth: float | None = None
    overshoot: float | None = None
    fin_use: float | None = None

    def record(self) -> dict[str, float | None]:
        """Return the answer by its fields' names with units."""
        return {
            "settling_s": self.settling,
            "step_rad": self.step,
            "asked_settling_s": self.asked_settling,
            "asked_bandwidth_rad_s": self.bandwidth,
            "asked_overshoot": self.overshoot,
            "asked_fin_use": self.fin_use,
        }


@dataclass(frozen=True, slots=True, repr=False)
class Schedule(InControl, Plotted):
    """Rows at rising speeds, the controller's kind and wishes, and provenance (models, runs, conventions).

    actuator is the fin's lag, delay and rate that the design counted with, stated those of them that were said, not modelled;
    notes are what was said of the vehicle it was designed for.
    """

    axis: Axis
    kind: str
    damping: float
    phase_margin_deg: float
    depth: bool
    rows: tuple[Row, ...]
    actuator: Mapping[str, float | None]
    provenance: Mapping[str, Any] = field(default_factory=dict)
    stated: Mapping[str, float | None] = field(default_factory=dict)
    notes: tuple[Note, ...] = ()
    answer: Answer = field(default_factory=Answer)

    @property
    def wish(self) -> Wish:
        """What was asked, as it is asked again: of a file without an answer the quickest gains of each speed."""
        a = self.answer
        settling = QUICKEST if a.step is None and self.kind not in PROPORTIONAL else a.asked_settling
        return Wish(self.kind, self.damping, self.phase_margin_deg, a.step, a.bandwidth, settling, a.overshoot, a.fin_use)

    @property
    def speeds(self) -> tuple[float, ...]:
        """Speeds of the rows, m/s."""
        return tuple(r.speed for r in self.rows)

    @property
    def fins(self) -> PlaneFins | None:
        """The fins that the command is made of; None where it is one."""
        body = self.provenance.get("fins")
        return None if body is None else plane_fins_of(body)

    @property
    def fins_said(self) -> list[str]:
        """What each of them is told, in words; nothing where the command is one fin."""
        return [] if self.fins is None else self.fins.says(NAMES[self.axis].fin.removesuffix("_rad"))

    @property
    def columns(self) -> tuple[str, ...]:
        """Columns an export writes for this axis."""
        return tuple(c for c in COLUMNS if c != "depth_gain" or self.depth)

    def column(self, name: str) -> list[Any]:
        """Return one column over the rows."""
        return [row.record()[name] for row in self.rows]

    def at(self, speed: float) -> Row:
        """Return the row at a speed, linear in speed between knots and held beyond them."""
        knots = np.array(self.speeds)
        place = float(np.interp(speed, knots, np.arange(knots.size)))
        below = min(int(place), knots.size - 1)
        above, share = min(below + 1, knots.size - 1), place - below
        a, b = self.rows[below], self.rows[above]

        def mixed(name: str) -> float:
            return float(getattr(a, name) + share * (getattr(b, name) - getattr(a, name)))

        inside = knots[0] * (1 - 1e-9) <= speed <= knots[-1] * (1 + 1e-9)
        return Row(
            speed, a.gains.blended(b.gains, share), mixed("feed_forward"), mixed("reference_gain"), mixed("fin_limit"),
            mixed("depth_gain"), inside and a.supported and b.supported, min(a.slowed, b.slowed),
            min(a.phase_margin_deg, b.phase_margin_deg), min(a.gain_margin_db, b.gain_margin_db),
            min(a.delay_margin_s, b.delay_margin_s), min(a.draws_held, b.draws_held), max(a.settling, b.settling),
            a.binds if share <= 1.0 - share else b.binds, mixed("fin_use"),
        )  # fmt: skip


def body_of(schedule: Schedule) -> dict[str, Any]:
    """Return a schedule as the plain record that `--json` prints and the file holds."""
    return {
        "axis": schedule.axis.value,
        "controller": schedule.kind,
        "damping_ratio": schedule.damping,
        "phase_margin_wanted_deg": schedule.phase_margin_deg,
        "depth": schedule.depth,
        "actuator": dict(schedule.actuator),
        "stated": dict(schedule.stated),
        "answer": schedule.answer.record(),
        "rows": [r.record() for r in schedule.rows],
        "provenance": dict(schedule.provenance),
        "warnings": [{"code": n.code, "message": n.message} for n in schedule.notes],
    }


def save_schedule(schedule: Schedule, path: Path, *, inputs: Sequence[Path] = (), force: bool = False) -> Path:
    """Write a schedule as YAML; raises ArtifactError."""
    return save_record(path, f"{KIND}/1", body_of(schedule), inputs=inputs, force=force)


def load_schedule(path: Path) -> Schedule:
    """Read a schedule back; raises ArtifactError naming what is missing or wrong."""
    with unless_log(path, "a schedule"):
        body = load_record(path, KIND)
    try:
        rows = tuple(_row(r) for r in body["rows"])
        _check_rows(rows)
        fins = {name: plane_fins_of(value).record() for name, value in body["provenance"].items() if name == "fins"}
    except ValueError as error:  # a wrong shape too
        raise ArtifactError(
            f"`{path}` is not a complete schedule", found=str(error), hint="design it again, with `--force`"
        ) from error
    return Schedule(
        axis=Axis(body["axis"]),
        kind=body["controller"],
        damping=float(body["damping_ratio"]),
        phase_margin_deg=float(body["phase_margin_wanted_deg"]),
        depth=body["depth"],
        rows=rows,
        actuator=dict(body["actuator"]),
        provenance={**body["provenance"], **fins, "inputs": body.get("inputs", [])},
        stated=dict(body["stated"]),
        notes=tuple(Note(n["code"], n["message"]) for n in body.get("warnings", ())),
        answer=_answer(body.get("answer", {})),
    )


def _check_rows(rows: Sequence[Row]) -> None:
    """Raise ShapeError where there is no row, their speeds do not rise, or the fin would turn one way here, the other there."""
    if not rows:
        raise ShapeError("`rows` is empty: no gains at any speed")
    if any(b.speed <= a.speed for a, b in pairwise(rows)):
        raise ShapeError(f"the speeds do not rise: {', '.join(f'{r.speed:g}' for r in rows)}")
    if min(r.gains.kp for r in rows) * max(r.gains.kp for r in rows) <= 0.0:
        raise ShapeError(f"`kp` is zero or changes its sign: {', '.join(f'{r.gains.kp:g}' for r in rows)}")


def _row(r: Mapping[str, Any]) -> Row:
    def margin(name: str) -> float:
        return float("inf") if r[name] is None else float(r[name])

    return Row(
        float(r["speed_m_s"]), Gains(float(r["kp"]), float(r["ki"]), float(r["kd"])), float(r["feed_forward_rad"]),
        float(r["reference_gain"]), float(r["fin_limit_rad"]), float(r["depth_gain"]), r["supported"], float(r["slowed"]),
        margin("phase_margin_deg"), margin("gain_margin_db"), margin("delay_margin_s"), float(r["draws_held"]),
        margin("settling_s"), r.get("binds", ""), float("nan") if r.get("fin_use") is None else float(r["fin_use"]),
    )  # fmt: skip


def _answer(body: Mapping[str, Any]) -> Answer:
    """Return the answer of a file, of one from before there were any an empty one."""
    return Answer(body.get("settling_s") or QUICKEST, *(body.get(name) for name in list(Answer().record())[1:]))
