"""The design of one leg: the best maneuver at a speed, or a circle for the turning radius, within the envelope."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import islice

import numpy as np

from fieldsid.errors import UsageError
from fieldsid.maneuvers import pick_maneuver
from fieldsid.numerics.arrays import FloatArray
from fieldsid.planning.belief.prior_model import draws_of, scales_of
from fieldsid.planning.design.leg import CIRCLE, Expected, Leg, turn_back_s
from fieldsid.planning.design.objective import Objective, Setting, information_of, make_objective
from fieldsid.planning.design.optimise import SMALLEST, Scored, as_switched, at_best_amplitude, catalogue, switching
from fieldsid.planning.flight.excitation import LONGEST_WINDOW_S, Excitation, fits, flown
from fieldsid.planning.flight.operating_point import operating_point
from fieldsid.planning.flight.rule_flight import fly_maneuver, plant_of
from fieldsid.planning.safety.envelope import MOST_TURNS
from fieldsid.planning.safety.monte_carlo import Ensemble, draw_ensemble, fly_ensemble
from fieldsid.runtime.parallel_map import parallel_map

DESIGN_PROBABILITY_SHARE = 0.7
"""Share of the accepted probability that a plan may use, so that other draws of the prior stay within it as well."""
COARSE_DRAWS, DRAWS, ERROR_DRAWS = 200, 500, 12
FINALISTS = 3


def best_leg(setting: Setting, speed: float, known: Sequence[Excitation] = ()) -> Leg:
    """Return the leg of one speed; `known` are maneuvers that were best at other speeds.

    A maneuver whose rule depends on the motion is chosen only where its expected fin angles can be flown open loop. Raises
    UsageError when no maneuver stays within the envelope.
    """
    objective = make_objective(setting, speed)
    ensemble = ensemble_at(objective)
    if risk_of(objective, ensemble.first(COARSE_DRAWS), np.zeros(0))[0] > setting.envelope.share:
        raise _nothing_inside(objective)  # not even the autopilot on a straight run stays inside
    # the best maneuvers of other speeds, each at its best amplitude here
    scored = [at_best_amplitude(objective, c) for c in known if fits(c, objective.window)] if known else catalogue(objective)
    scored = [s for s in scored if s.candidate.record.rule is None or not setting.open_loop]
    seeds = [s for s in (as_switched(objective, c.candidate) for c in scored) if s is not None]
    scored.append(switching(objective, seeds, setting.seed))
    scored.sort(key=lambda s: s.cost)
    leg = _best_of(objective, ensemble, scored)
    if not leg.flown_from_list_in(setting.envelope):
        leg = _best_of(objective, ensemble, [s for s in scored if s.candidate.record.rule is None])
    costs = {s.candidate.spec: float(np.exp(s.cost)) for s in scored[:6]}
    return replace(leg, alternatives=costs)


def _best_of(objective: Objective, ensemble: Ensemble, scored: Sequence[Scored]) -> Leg:
    """Return the leg of the best of some maneuvers (`scored`, best first), reduced to stay within the envelope; or UsageError."""
    few = ensemble.first(COARSE_DRAWS)
    reduced = (enforce_envelope(objective, few, s.candidate) for s in scored)
    finalists = islice((c for c in reduced if c is not None), FINALISTS)
    inside = [Scored(c, objective.cost(c, margin=10.0)) for c in finalists]
    best = enforce_envelope(objective, ensemble, min(inside, key=lambda s: s.cost).candidate) if inside else None
    if best is None:
        raise _nothing_inside(objective)
    return leg_of(objective, best, ensemble)


def _nothing_inside(objective: Objective) -> UsageError:
    limits = objective.envelope
    return UsageError(
        f"no maneuver stays inside the envelope at {objective.scene.speed:g} m/s with a probability of {1 - limits.share:.0%}",
        found=", ".join(f"{k} {v:.3g}" for k, v in limits.excursion_limits().items()),
        hint=f"{limits.widening()}, or narrow the prior with a first model: `--model MODEL`",
    )


def ensemble_at(objective: Objective) -> Ensemble:
    """Return the draws of the prior that the legs at an objective's speed are simulated with."""
    setting = objective.setting
    return draw_ensemble(setting.model, objective.scene.speed, objective.window, DRAWS, setting.seed + 1)


def risk_of(objective: Objective, ensemble: Ensemble, candidate: Excitation | FloatArray) -> tuple[float, dict[str, float]]:
    """Return the share of draws that leave the envelope, and each excursion's 95 % quantile; see `fly_ensemble`."""
    flights = fly_ensemble(ensemble, candidate, objective.envelope, objective.autopilot, objective.run_up)
    excursions = {name: float(np.quantile(values, 0.95)) for name, values in flights.excursions.items()}
    return float(np.mean(flights.outside(objective.envelope))), excursions


def leg_of(objective: Objective, candidate: Excitation, ensemble: Ensemble | None = None, purpose: str = "parameters") -> Leg:
    """Return the leg of an excitation: expected errors, those of the paper's pulses for comparison, excursions and risk."""
    scene, ensemble = objective.scene, ensemble or ensemble_at(objective)
    risk, excursions = risk_of(objective, ensemble, candidate)
    nominal = _nominal(objective, candidate)
    open_loop_risk = risk_of(objective, ensemble, nominal)[0] if nominal.size else float("nan")
    turn = turn_back_s(scene.base.damping, scene.base.authority, objective.envelope.fin)
    return Leg(
        speed=scene.speed,
        candidate=candidate,
        window=objective.window,
        run_up_s=objective.setting.run_up_s,
        turn_s=turn,
        autopilot=objective.autopilot,
        expected=expected_errors(objective, candidate, ensemble),
        excursions=excursions,
        break_probability=risk,
        purpose=purpose,
        nominal=nominal,
        replay_risk=open_loop_risk,
    )


def _nominal(objective: Objective, candidate: Excitation) -> FloatArray:
    """Return the fin angle about trim (n,) rad that a rule commands for the prior's mean, NaN where the autopilot steers."""
    if candidate.record.rule is None:
        return np.zeros(0)
    window, limits = objective.window, objective.envelope.limits
    flight = fly_maneuver(
        plant_of([objective.scene], window.time.size, window.rate_hz), candidate.record, candidate.parameters,
        limits=limits, autopilot=objective.autopilot, schedule=window.schedule,
    )  # fmt: skip
    return np.where(flight.recovering[:, 0], np.nan, flight.fin[:, 0])


def expected_errors(objective: Objective, candidate: Excitation, ensemble: Ensemble) -> dict[str, Expected]:
    """Return the expected error of every parameter after one pass of a candidate, with its spread over draws of the prior.

    The paper's pulses, which it is compared with, are kept inside the envelope as it is.
    """
    setting, speed = objective.setting, objective.scene.speed
    mean = objective.expected(candidate)
    spread = []
    for drawn in draws_of(setting.model, ERROR_DRAWS, setting.seed + 2):
        scene = operating_point(drawn, speed)
        response = flown(scene, candidate, objective.window, objective.envelope.limits, objective.autopilot)
        spread.append(information_of(scene, response).std_errors())
    usual = pulses(objective)
    reference = None if usual is None else enforce_envelope(objective, ensemble.first(COARSE_DRAWS), usual)
    baseline = {} if reference is None else objective.expected(reference).std_errors()
    scales = scales_of(setting.model, objective.scene.base, objective.envelope.fin)
    values = {**objective.scene.model.values, **objective.scene.model.at_speed(speed)}
    high = {n: _high([e[n] for e in spread]) for n in mean.names}
    errors = mean.std_errors()
    return {n: Expected(values[n], e, high[n], e / scales[n], baseline.get(n, float("nan"))) for n, e in errors.items()}


def _high(errors: list[float]) -> float:
    """Return the 5/6 quantile of errors, without interpolation where some are infinite."""
    return float(np.quantile(errors, 5 / 6, method="linear" if np.isfinite(errors).all() else "higher"))


def pulses(objective: Objective) -> Excitation | None:
    """Return the paper's pulses within the fin limit, shortened to fit the window; None where they do not fit."""
    maneuver = pick_maneuver("square_pulses")
    fin = objective.envelope.fin
    spare = objective.window.excitation - 4.0 * maneuver.defaults["width"]
    if spare < 0:
        return None
    values = {"amplitude": min(0.26, fin), "second": min(0.15, fin), "recovery": min(maneuver.defaults["recovery"], spare)}
    return Excitation(maneuver.name, maneuver.checked(values))


def enforce_envelope(objective: Objective, ensemble: Ensemble, candidate: Excitation) -> Excitation | None:
    """Return the candidate with its angles reduced until enough draws stay within the envelope; None where that is impossible."""
    share, inside, outside = 1.0, 0.0, 1.0
    for step in range(7):
        trial = with_reduced_angles(candidate, share)
        if trial is None:
            break
        if risk_of(objective, ensemble, trial)[0] <= objective.envelope.share * DESIGN_PROBABILITY_SHARE:
            inside = share
            if share == 1.0:
                break
        else:
            outside = share
        share = 0.5 * (inside + outside) if inside > 0 or step > 2 else share * 0.7
    return with_reduced_angles(candidate, inside) if inside > 0 else None


def with_reduced_angles(candidate: Excitation, share: float) -> Excitation | None:
    """Return a candidate with each of its tuned angles multiplied by `share`; None below their bounds."""
    changes = {p.name: candidate.parameters[p.name] * share for p in candidate.record.parameters if p.unit == "rad" and p.tuned}
    bounds = {p.name: p.low for p in candidate.record.parameters}
    if share < SMALLEST or any(v < bounds[n] for n, v in changes.items()):
        return None
    return candidate.with_(**changes)


SETTLED_TURN = 2.5 * np.pi
"""Heading change (rad) of a circle: half a turn to settle, a full one for the measurement."""
LARGEST_TURN = MOST_TURNS * 2.0 * np.pi
"""Heading change (rad) at which a circle is aborted: with commands over time a stronger fin turns farther."""
SLACK = 1.6


def circle_legs(setting: Setting, speeds: Sequence[float]) -> list[Leg]:
    """Return a circle at the fin limit to port and one to starboard at every speed.

    The heading limit of the envelope is replaced by LARGEST_TURN; all other limits hold. Raises UsageError when a circle violates
    them.
    """
    return parallel_map(lambda turn: _circle(setting, *turn), [(speed, side) for speed in speeds for side in (0.0, 1.0)])


def _circle(setting: Setting, speed: float, mirrored: float) -> Leg:
    free = replace(setting.envelope, heading=LARGEST_TURN)
    turning = replace(setting, envelope=free, want={})
    probe = make_objective(turning, speed)
    rate = abs(probe.scene.base.authority) * free.fin / max(probe.scene.base.damping, 0.02)
    maneuver = pick_maneuver("turning_circle")
    pull_out, around = 8.0, setting.window
    length = float(np.clip(SLACK * SETTLED_TURN / rate + pull_out, 20.0, LONGEST_WINDOW_S - around.lead - around.recover))
    values = {"amplitude": free.fin, "turn": SETTLED_TURN, "pull_out": pull_out, "mirrored": mirrored, "duration": length}
    window = replace(around, length=length + around.lead + around.recover)
    objective = make_objective(replace(turning, window=window), speed)
    leg = leg_of(objective, Excitation(maneuver.name, maneuver.checked(values)), purpose=CIRCLE)
    leg = replace(leg, heading=LARGEST_TURN)
    if leg.break_probability > free.share:
        raise _no_room(leg, setting)
    return leg


def _no_room(leg: Leg, setting: Setting) -> UsageError:
    """Return the error for a circle that leaves the envelope, with the limits that it needs."""
    far, limits = leg.excursions, setting.envelope
    options = []
    if limits.area_length is not None:
        options.append(f"`--area {max(1.1 * far['along'], limits.area_length):.0f}x{2.2 * far['across']:.0f}`")
    if limits.area_length is not None and far["behind"] > 0.0:
        options.append(f"`--run-up {setting.run_up_s + 1.1 * far['behind'] / leg.speed:.0f}`")
    if limits.track is not None:
        options.append(f"`--max-track {1.1 * far['track']:.0f}`")
    return UsageError(
        f"a full-fin circle at {leg.speed:g} m/s does not fit the envelope",
        found=f"{leg.break_probability:.0%} leave it: {far['along']:.0f} m along, {far['across']:.0f} m to a side, "
        f"{far['behind']:.0f} m behind the start, roll {far['roll']:.2g} rad",
        hint=f"give {' and '.join(options)}, or leave `--radius` out"
        if options
        else "leave `--radius` out, or give a smaller `--fin-max`",
    )
