"""Legs that reach the steady turn: a circle with pull-out to either side, so that the turn radius is measured, not inferred."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fieldsid.errors import UsageError
from fieldsid.maneuvers import pick_maneuver
from fieldsid.planning.design.best_leg import Setting, leg_of
from fieldsid.planning.design.leg import CIRCLE, Leg
from fieldsid.planning.design.objective import make_objective
from fieldsid.planning.flight.excitation import LONGEST_WINDOW_S, Excitation
from fieldsid.planning.safety.envelope import MOST_TURNS
from fieldsid.runtime.parallel_map import parallel_map

SETTLED_TURN = 2.5 * np.pi
"""Heading (rad) to turn through: half a circle to settle, one to be measured on."""
LARGEST_TURN = MOST_TURNS * 2.0 * np.pi
"""Heading (rad) at which a circle is ended: one that is flown by the clock turns farther the stronger the fin is."""
SLACK = 1.6


def circle_legs(setting: Setting, speeds: Sequence[float]) -> list[Leg]:
    """Return a circle at the fin limit to port and one to starboard at every speed.

    A circle turns through more than a whole turn: its heading has a limit of its own. All other limits hold.
    Raises UsageError when a circle does not fit them.
    """
    return parallel_map(lambda turn: _circle(setting, *turn), [(speed, side) for speed in speeds for side in (0.0, 1.0)])


def _circle(setting: Setting, speed: float, mirrored: float) -> Leg:
    free = replace(setting.envelope, heading=LARGEST_TURN)
    probe = make_objective(setting.model, speed, free, setting.window, {}, setting.run_up_s)
    rate = abs(probe.scene.base.authority) * free.fin / max(probe.scene.base.damping, 0.02)
    maneuver = pick_maneuver("turning_circle")
    pull_out, around = 8.0, setting.window
    length = float(np.clip(SLACK * SETTLED_TURN / rate + pull_out, 20.0, LONGEST_WINDOW_S - around.lead - around.recover))
    values = {"amplitude": free.fin, "turn": SETTLED_TURN, "pull_out": pull_out, "mirrored": mirrored, "duration": length}
    window = replace(around, length=length + around.lead + around.recover)
    judge = make_objective(setting.model, speed, free, window, {}, setting.run_up_s)
    leg = leg_of(judge, setting, Excitation(maneuver.name, maneuver.checked(values)), purpose=CIRCLE)
    leg = replace(leg, heading=LARGEST_TURN)
    if leg.break_probability > free.share:
        raise _no_room(leg, setting)
    return leg


def _no_room(leg: Leg, setting: Setting) -> UsageError:
    """Return the error of a circle that leaves the envelope, with what would hold it."""
    far, limits = leg.excursions, setting.envelope
    wanted = []
    if limits.area_length is not None:
        wanted.append(f"`--area {max(1.1 * far['along'], limits.area_length):.0f}x{2.2 * far['across']:.0f}`")
    if limits.area_length is not None and far["behind"] > 0.0:
        wanted.append(f"`--run-up {setting.run_up_s + 1.1 * far['behind'] / leg.speed:.0f}`")
    if limits.track is not None:
        wanted.append(f"`--max-track {1.1 * far['track']:.0f}`")
    return UsageError(
        f"a full-fin circle at {leg.speed:g} m/s does not fit the envelope",
        found=f"{leg.break_probability:.0%} leave it: {far['along']:.0f} m along, {far['across']:.0f} m to a side, "
        f"{far['behind']:.0f} m behind the start, roll {far['roll']:.2g} rad",
        hint=f"give {' and '.join(wanted)}, or leave `--radius` out"
        if wanted
        else "leave `--radius` out, or give a smaller `--fin-max`",
    )
