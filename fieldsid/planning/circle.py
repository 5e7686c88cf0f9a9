"""Legs that reach the steady turn: a circle with pull-out to either side, so that the turn radius is measured, not inferred."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fieldsid.errors import UsageError
from fieldsid.maneuvers import pick_maneuver
from fieldsid.planning.build import Setting, leg_of
from fieldsid.planning.candidate import Candidate
from fieldsid.planning.judge import judge_of
from fieldsid.planning.leg import Leg

SETTLED_TURN = 2.5 * np.pi
"""Heading (rad) to turn through: half a circle to settle, one to be measured on."""
SLACK = 1.6
LONGEST_S = 300.0


def circle_legs(setting: Setting, speeds: Sequence[float]) -> list[Leg]:
    """Return a circle at the fin limit to port and one to starboard at every speed.

    The heading and track limits of the other maneuvers do not hold here: a circle leaves any of them; the area does.
    Raises UsageError when a circle does not fit the area.
    """
    return [leg for speed in speeds for leg in (_circle(setting, speed, 0.0), _circle(setting, speed, 1.0))]


def _circle(setting: Setting, speed: float, mirrored: float) -> Leg:
    free = replace(setting.envelope, heading=None, track=None)
    probe = judge_of(setting.model, speed, free, setting.window, {}, setting.run_up_s)
    rate = abs(probe.scene.base.authority) * free.fin / max(probe.scene.base.damping, 0.02)
    maneuver = pick_maneuver("turning_circle")
    pull_out = 8.0
    length = float(np.clip(SLACK * SETTLED_TURN / rate + pull_out, 20.0, LONGEST_S))
    values = {"amplitude": free.fin, "turn": SETTLED_TURN, "pull_out": pull_out, "mirrored": mirrored, "duration": length}
    around = setting.window
    window = replace(around, length=length + around.lead + around.recover)
    judge = judge_of(setting.model, speed, free, window, {}, setting.run_up_s)
    leg = leg_of(judge, setting, Candidate(maneuver.name, maneuver.checked(values)), purpose="turn radius")
    if leg.break_probability > free.share:
        need = {k: leg.excursions[k] for k in ("along", "across")}
        raise UsageError(
            f"a full-fin circle at {speed:g} m/s does not fit the envelope",
            found=f"{leg.break_probability:.0%} leave it: {need['along']:.0f} m along, {need['across']:.0f} m across",
            hint=f"give `--area {1.1 * need['along']:.0f}x{1.1 * need['across']:.0f}`, or leave `--radius` out",
        )
    return leg
