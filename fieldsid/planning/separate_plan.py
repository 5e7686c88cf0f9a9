"""A plan of one leg: the maneuver that tells rivals apart, laid into run-up and window like any other."""

from __future__ import annotations

from collections.abc import Sequence

from fieldsid.errors import UsageError
from fieldsid.models.model import Model
from fieldsid.planning.build import Setting, crowd_at, kept_inside, leg_of
from fieldsid.planning.candidate import Window
from fieldsid.planning.discriminate import Separation, separate
from fieldsid.planning.envelope import Envelope, check_room, check_speeds
from fieldsid.planning.judge import judge_of
from fieldsid.planning.plan import SHORTEST_WINDOW_S, Plan
from fieldsid.planning.prior import checked_prior

LONGEST_WINDOW_S = 60.0


def separating_plan(
    rivals: Sequence[Model],
    envelope: Envelope,
    speeds: tuple[float, ...],
    window: Window,
    run_up_s: float,
    vehicle: str,
    seed: int,
) -> tuple[Plan, Separation]:
    """Return the plan that tells rivals apart, and what it is expected to show.

    A window shorter than a minute is stretched to one where the area allows. Raises UsageError when nothing stays
    inside the envelope, ModelError for a rival that is unstable.
    """
    check_speeds(speeds, None, None)
    check_room(envelope, speeds, run_up_s, SHORTEST_WINDOW_S)
    for rival in rivals:
        checked_prior(rival, rivals[0].axis, speeds)
    length = max(window.length, LONGEST_WINDOW_S)
    if envelope.area_length is not None:
        length = min(length, envelope.area_length / max(speeds) - run_up_s)
    found = separate(rivals, envelope, speeds=speeds, rate_hz=window.rate_hz, window_s=length)
    setting = Setting(rivals[0], envelope, found.window, {}, run_up_s, seed)
    judge = judge_of(rivals[0], found.speed, envelope, found.window, {}, run_up_s)
    crowd = crowd_at(judge, setting)
    safe = kept_inside(judge, setting, crowd, found.candidate) or found.candidate
    names = ", ".join("+".join(r.effects) or "none" for r in rivals)
    leg = leg_of(judge, setting, safe, crowd, purpose=f"separate {names}")
    if leg.break_probability > envelope.share:
        raise UsageError(
            f"`{found.candidate.spec}` would leave the envelope {leg.break_probability:.0%} of the time",
            found=", ".join(f"{k} {v:.3g}" for k, v in envelope.rooms().items()),
            hint=f"accept it with `--risk {leg.break_probability:.2g}`, or widen the envelope",
        )
    return Plan(rivals[0].axis, vehicle, rivals[0].method, envelope, (leg,), {}, seed), found
