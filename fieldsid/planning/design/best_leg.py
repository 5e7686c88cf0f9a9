"""Build one leg: the best maneuver searched at a speed, or a circle for the radius, kept inside the envelope; what it buys."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import islice

import numpy as np

from fieldsid.errors import UsageError
from fieldsid.maneuvers import Schedule, pick_maneuver
from fieldsid.models.model import Model
from fieldsid.numerics.arrays import FloatArray
from fieldsid.planning.belief.prior_model import draws_of, scales_of
from fieldsid.planning.design.leg import CIRCLE, Expected, Leg, turn_back_s
from fieldsid.planning.design.objective import Objective, information_of, make_objective
from fieldsid.planning.design.optimise import SMALLEST, Scored, as_switched, catalogue, largest_paying, switching
from fieldsid.planning.flight.excitation import LONGEST_WINDOW_S, Excitation, Window, fits, flown
from fieldsid.planning.flight.operating_point import operating_point
from fieldsid.planning.flight.rule_flight import fly_operating_points
from fieldsid.planning.safety.envelope import MOST_TURNS, Envelope
from fieldsid.planning.safety.monte_carlo import Ensemble, draw_ensemble, fly_ensemble, fly_list
from fieldsid.runtime.parallel_map import parallel_map

DESIGN_PROBABILITY_SHARE = 0.7
"""A plan aims at this part of the accepted probability, so that other draws of the prior keep to it as well."""
COARSE_DRAWS, DRAWS, ERROR_DRAWS = 200, 500, 12
FINALISTS = 3
RUN_UP_S = 10.0
"""Straight run before the window of each leg, unless another is asked for."""


@dataclass(frozen=True, slots=True)
class Setting:
    """What all legs of a plan share; `open_loop` leaves out maneuvers that follow the motion."""

    model: Model
    envelope: Envelope
    window: Window
    want: Mapping[str, float]
    run_up_s: float = RUN_UP_S
    seed: int = 1
    open_loop: bool = False


def best_leg(setting: Setting, speed: float, known: Sequence[Excitation] = ()) -> Leg:
    """Return the leg of one speed; `known` are maneuvers that were best at other speeds.

    A maneuver that follows the motion is taken only where a list of its expected fins can be sent to a vehicle. Raises
    UsageError when nothing stays inside the envelope.
    """
    judge = make_objective(setting.model, speed, setting.envelope, setting.window, setting.want, setting.run_up_s)
    crowd = ensemble_at(judge, setting)
    straight = fly_list(crowd.first(COARSE_DRAWS), np.zeros(0), judge.envelope, judge.autopilot, judge.run_up)
    if np.mean(straight.outside(judge.envelope)) > setting.envelope.share:
        raise _nothing_inside(judge)  # as the autopilot steers straight on
    # what was best elsewhere, each at the angle that pays here
    scored = [largest_paying(judge, c) for c in known if fits(c, judge.window)] if known else catalogue(judge)
    scored = [s for s in scored if s.candidate.record.rule is None or not setting.open_loop]
    seeds = [s for s in (as_switched(judge, c.candidate) for c in scored) if s is not None]
    scored.append(switching(judge, seeds, setting.seed))
    scored.sort(key=lambda s: s.cost)
    leg = _best_of(judge, setting, crowd, scored)
    if not leg.flown_from_list_in(setting.envelope):
        leg = _best_of(judge, setting, crowd, [s for s in scored if s.candidate.record.rule is None])
    costs = {s.candidate.spec: float(np.exp(s.cost)) for s in scored[:6]}
    return replace(leg, alternatives=costs)


def _best_of(judge: Objective, setting: Setting, crowd: Ensemble, scored: Sequence[Scored]) -> Leg:
    """Return the leg of the best of some maneuvers, best first, at the angles at which it stays inside; raises UsageError."""
    few = crowd.first(COARSE_DRAWS)
    kept = (enforce_envelope(judge, setting, few, s.candidate) for s in scored)
    finalists = islice((c for c in kept if c is not None), FINALISTS)
    inside = [Scored(c, judge.cost(c, margin=10.0)) for c in finalists]
    best = enforce_envelope(judge, setting, crowd, min(inside, key=lambda s: s.cost).candidate) if inside else None
    if best is None:
        raise _nothing_inside(judge)
    return leg_of(judge, setting, best, crowd)


def _nothing_inside(judge: Objective) -> UsageError:
    limits = judge.envelope
    return UsageError(
        f"no maneuver stays inside the envelope at {judge.scene.speed:g} m/s with a probability of {1 - limits.share:.0%}",
        found=", ".join(f"{k} {v:.3g}" for k, v in limits.rooms().items()),
        hint=f"{limits.widening()}, or narrow the prior with a first model: `--model MODEL`",
    )


def ensemble_at(judge: Objective, setting: Setting) -> Ensemble:
    """Return the draws of the prior that the legs at an objective's speed are simulated with."""
    return draw_ensemble(setting.model, judge.scene.speed, judge.window, DRAWS, setting.seed + 1)


def risk_of(judge: Objective, crowd: Ensemble, candidate: Excitation) -> tuple[float, dict[str, float]]:
    """Return the share of draws that leave the envelope, and each excursion's 95 % quantile."""
    flights = fly_ensemble(crowd, candidate, judge.envelope, judge.autopilot, judge.run_up)
    excursions = {name: float(np.quantile(values, 0.95)) for name, values in flights.excursions.items()}
    return float(np.mean(flights.outside(judge.envelope))), excursions


def leg_of(
    judge: Objective, setting: Setting, candidate: Excitation, crowd: Ensemble | None = None, purpose: str = "parameters"
) -> Leg:
    """Return an excitation as a leg: expected errors, with those of the paper's pulses for comparison, excursions, risk."""
    scene, crowd = judge.scene, crowd or ensemble_at(judge, setting)
    risk, excursions = risk_of(judge, crowd, candidate)
    nominal = _nominal(judge, candidate)
    blind = float("nan")
    if nominal.size:
        blind = float(np.mean(fly_list(crowd, nominal, judge.envelope, judge.autopilot, judge.run_up).outside(judge.envelope)))
    turn = turn_back_s(scene.base.damping, scene.base.authority, judge.envelope.fin)
    return Leg(
        speed=scene.speed,
        candidate=candidate,
        window=judge.window,
        run_up_s=setting.run_up_s,
        turn_s=turn,
        autopilot=judge.autopilot,
        expected=expected_errors(judge, setting, candidate),
        excursions=excursions,
        break_probability=risk,
        purpose=purpose,
        nominal=nominal,
        replay_risk=blind,
    )


def _nominal(judge: Objective, candidate: Excitation) -> FloatArray:
    """Return the fin about trim a rule is expected to ask for on the prior's mean, NaN where the autopilot steers, (n,)."""
    if candidate.record.rule is None:
        return np.zeros(0)
    window = judge.window
    flight = fly_operating_points(
        [judge.scene], candidate.record, candidate.parameters, limits=judge.envelope.limits, autopilot=judge.autopilot,
        schedule=Schedule(window.rate_hz, window.lead, window.recover),
    )  # fmt: skip
    return np.where(flight.recovering[:, 0], np.nan, flight.fin[:, 0])[: window.time.size]


def expected_errors(judge: Objective, setting: Setting, candidate: Excitation) -> dict[str, Expected]:
    """Return what one pass of a candidate tells about every parameter, with the spread over draws of the prior."""
    speed = judge.scene.speed
    mean = judge.expected(candidate)
    spread = []
    for drawn in draws_of(setting.model, ERROR_DRAWS, setting.seed + 2):
        scene = operating_point(drawn, speed)
        response = flown(scene, candidate, judge.window, judge.envelope.limits, judge.autopilot)
        spread.append(information_of(scene, response).std_errors())
    base = pulses(judge)
    before = {} if base is None else judge.expected(base).std_errors()
    scales = scales_of(setting.model, judge.scene.base, judge.envelope.fin)
    values = {**judge.scene.model.values, **judge.scene.model.at_speed(speed)}
    high = {n: _high([e[n] for e in spread]) for n in mean.names}
    errors = mean.std_errors()
    return {n: Expected(values[n], e, high[n], e / scales[n], before.get(n, float("nan"))) for n, e in errors.items()}


def _high(errors: list[float]) -> float:
    """Return the 5/6 quantile of errors, one of them where some are infinite: nothing lies between those."""
    return float(np.quantile(errors, 5 / 6, method="linear" if np.isfinite(errors).all() else "higher"))


def pulses(judge: Objective) -> Excitation | None:
    """Return the paper's pulses in a window, shortened to fit, within the fin limit; None where there is no room."""
    maneuver = pick_maneuver("square_pulses")
    fin = judge.envelope.fin
    spare = judge.window.excitation - 4.0 * maneuver.defaults["width"]
    if spare < 0:
        return None
    values = {"amplitude": min(0.26, fin), "second": min(0.15, fin), "recovery": min(maneuver.defaults["recovery"], spare)}
    return Excitation(maneuver.name, maneuver.checked(values))


def enforce_envelope(judge: Objective, setting: Setting, crowd: Ensemble, candidate: Excitation) -> Excitation | None:
    """Return the candidate with its angles lowered until enough of the draws keep the envelope, None where none is inside."""
    share, inside, outside = 1.0, 0.0, 1.0
    for step in range(7):
        trial = lowered(candidate, share)
        if trial is None:
            break
        if risk_of(judge, crowd, trial)[0] <= setting.envelope.share * DESIGN_PROBABILITY_SHARE:
            inside = share
            if share == 1.0:
                break
        else:
            outside = share
        share = 0.5 * (inside + outside) if inside > 0 or step > 2 else share * 0.7
    return lowered(candidate, inside) if inside > 0 else None


def lowered(candidate: Excitation, share: float) -> Excitation | None:
    """Return a candidate with every angle it may choose times `share`; None below its bounds."""
    changes = {p.name: candidate.parameters[p.name] * share for p in candidate.record.parameters if p.unit == "rad" and p.tuned}
    bounds = {p.name: p.low for p in candidate.record.parameters}
    if share < SMALLEST or any(v < bounds[n] for n, v in changes.items()):
        return None
    return candidate.with_(**changes)


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
