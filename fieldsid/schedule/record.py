"""A gain schedule: rows over speed, conventions and provenance; saved and loaded as `fieldsid/schedule/1`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from math import nan
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np

from fieldsid.artifacts import save_record
from fieldsid.display import Brief, Displayed, InControl, Plotted
from fieldsid.logs.run import Note
from fieldsid.logs.wrong_file import unless_log
from fieldsid.models.allocation import PlaneFins, plane_fins_of
from fieldsid.models.axis import NAMES, Axis
from fieldsid.planning.whole_file import whole_file
from fieldsid.records.check import ShapeError
from fieldsid.records.keys import INLINE, Key, Number, body_of
from fieldsid.records.reading import load_record
from fieldsid.schedule.controller import Gains
from fieldsid.schedule.linear_plant import FinLimits
from fieldsid.schedule.wish import PROPORTIONAL, QUICKEST, Wish

KIND = "fieldsid/schedule"
COLUMNS = ("speed_m_s", "kp", "ki", "kd", "feed_forward_rad", "reference_gain", "fin_limit_rad", "depth_gain", "supported")
"""The columns of every export, in this order; depth_gain with a depth loop only."""


@dataclass(frozen=True, slots=True, repr=False)
class Row(Displayed):
    """Gains at one speed: fin = kp e + ki int e - kd rate + feed_forward + reference_gain ref, limited to fin_limit.

    depth_gain (pitch): pitch reference = depth_gain (depth - reference depth), rad/m, nose up positive. Margins are the least
    over 95 % of the draws; `draws_held` is the share of draws with the required margin that settle after the step, `settling` (s)
    the settling time of 95 % of the draws. `binds` names the requirement that limits the bandwidth, `fin_use` is the share of the
    fin limit that the step uses.
    """

    speed: Annotated[float, Key("Speed through the water.", "speed_m_s")]
    gains: Annotated[Gains, INLINE]
    feed_forward: Annotated[float, Key("Fin that cancels the trim.", "feed_forward_rad")]
    reference_gain: Annotated[float, Key("rad of fin per rad of reference: cancels the stiffness of pitch.")]
    fin_limit: Annotated[float, Key("Largest fin.", "fin_limit_rad")]
    depth_gain: Annotated[float, Key("rad of pitch per m of depth; zero without `--depth`.")] = 0.0
    supported: Annotated[bool, Key("Whether the data were taken at this speed.")] = True
    slowed: Annotated[
        float, Key("Share of the formula's speed that is left for the fin's lag, delay and the margin; 1 is not slowed.")
    ] = 1.0
    phase_margin_deg: Annotated[Number, Key("Phase margin.")] = nan
    gain_margin_db: Annotated[Number, Key("Gain margin; null where the loop never crosses.")] = nan
    delay_margin_s: Annotated[Number, Key("Delay margin; the three margins are the least over 95 % of the draws.")] = nan
    draws_held: Annotated[Number, Key("Share of the draws with the wished margin that come to rest from the standard step.")] = (
        nan
    )
    settling: Annotated[Number, Key("Time of 95 % of them to stay within 5 % of it.", "settling_s")] = nan
    binds: Annotated[str, Key("What keeps the gains from more bandwidth.")] = ""
    fin_use: Annotated[Number, Key("The share of the fin's limit that the step asks for.")] = nan


@dataclass(frozen=True, slots=True, repr=False)
class Answer(Brief):
    """The step response that rows were designed for: all settle after `step` (rad) within `settling` s, 0 where each differs.

    The other fields are the user's requirements: settling (s), bandwidth (rad/s), overshoot and fin use as shares; None without.
    """

    settling: Annotated[float, Key("The time in which all rows settle; zero where each has its own.", "settling_s")] = QUICKEST
    step: Annotated[float | None, Key("The step, the error that may ask for the fin.", "step_rad")] = None
    asked_settling: Annotated[float | None, Key("The time asked; zero for the quickest.", "asked_settling_s")] = None
    bandwidth: Annotated[float | None, Key("The bandwidth asked.", "asked_bandwidth_rad_s")] = None
    overshoot: Annotated[float | None, Key("The overshoot asked, as a share.", "asked_overshoot")] = None
    fin_use: Annotated[float | None, Key("The share of the fin asked.", "asked_fin_use")] = None


@dataclass(frozen=True, slots=True, repr=False)
class Schedule(InControl, Plotted):
    """Rows at rising speeds, the kind of controller with its requirements, and provenance (models, runs, conventions).

    `actuator` is lag, delay and rate limit of the fin in the design, `stated` those of them that were stated and not identified;
    `notes` are warnings on the plants of the design.
    """

    axis: Annotated[Axis, Key("The plane.")]
    kind: Annotated[str, Key("The controller.", "controller", of=Literal["p", "pd", "pi", "pid", "lqr"])]
    damping: Annotated[float, Key("Damping ratio asked for.", "damping_ratio")]
    phase_margin_deg: Annotated[float, Key("Phase margin asked for.", "phase_margin_wanted_deg")]
    depth: Annotated[bool, Key("Whether a depth loop is added.")]
    rows: Annotated[tuple[Row, ...], Key("One for each speed.")]
    actuator: Annotated[Mapping[str, float | None], Key("The fin.", of=FinLimits)]
    provenance: Annotated[Mapping[str, Any], Key("Models, runs, sign convention, what holds between and outside the rows.")] = (
        field(default_factory=dict)
    )
    stated: Annotated[Mapping[str, float | None], Key("What was said of the fin when it was designed.")] = field(
        default_factory=dict
    )
    notes: Annotated[
        tuple[Note, ...],
        Key(
            "Why the gains are for each speed's own model, and not for the vehicle that all runs together make believe in.",
            "warnings",
        ),
    ] = ()
    answer: Annotated[Answer, Key("The answer to a step.")] = field(default_factory=Answer)

    @property
    def wish(self) -> Wish:
        """The requirements of the design; for a file without `answer` those of the quickest gains at each speed."""
        a = self.answer
        settling = QUICKEST if a.step is None and self.kind not in PROPORTIONAL else a.asked_settling
        return Wish(self.kind, self.damping, self.phase_margin_deg, a.step, a.bandwidth, settling, a.overshoot, a.fin_use)

    @property
    def stated_limits(self) -> FinLimits:
        """The stated limits of the fin; the others are those of the models in the verification, with their errors."""
        return FinLimits(*(self.stated.get(name) for name in body_of(FinLimits())))

    @property
    def speeds(self) -> tuple[float, ...]:
        """Speeds of the rows, m/s."""
        return tuple(r.speed for r in self.rows)

    @property
    def fins(self) -> PlaneFins | None:
        """The fins over which the command is allocated; None for a single fin."""
        body = self.provenance.get("fins")
        return None if body is None else plane_fins_of(body)

    @property
    def fins_said(self) -> list[str]:
        """The command of each of these fins, in words; empty for a single fin."""
        return [] if self.fins is None else self.fins.says(NAMES[self.axis].fin.removesuffix("_rad"))

    @property
    def columns(self) -> tuple[str, ...]:
        """Columns an export writes for this axis."""
        return tuple(c for c in COLUMNS if c != "depth_gain" or self.depth)

    def column(self, name: str) -> list[Any]:
        """Return one column over the rows."""
        return [body_of(row)[name] for row in self.rows]

    def at(self, speed: float) -> Row:
        """Return the row at a speed, linear in speed between the rows and constant beyond them."""
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


def save_schedule(schedule: Schedule, path: Path, *, inputs: Sequence[Path] = (), force: bool = False) -> Path:
    """Write a schedule as YAML; raises ArtifactError."""
    return save_record(path, f"{KIND}/1", body_of(schedule), inputs=inputs, force=force)


def load_schedule(path: Path) -> Schedule:
    """Read a schedule back; raises ArtifactError naming what is missing or wrong."""
    with unless_log(path, "a schedule"):
        body = load_record(path, KIND)
    with whole_file(path, "schedule", "design it again, with `--force`"):
        rows = tuple(_row(r) for r in body["rows"])
        _check_rows(rows)
        fins = {name: body_of(plane_fins_of(value)) for name, value in body["provenance"].items() if name == "fins"}
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
    """Raise ShapeError where there is no row, the speeds do not rise, or kp is zero or has different signs."""
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
    """Return the `answer` of a file; an empty one for a file of an older version, which has none."""
    return Answer(body.get("settling_s") or QUICKEST, *(body.get(name) for name in list(body_of(Answer()))[1:]))
