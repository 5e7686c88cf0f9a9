"""The search for the best excitation: a coordinate search over each maneuver of the catalogue, and optimal switching times.

The switching times of a binary signal are found by differential evolution (Storn and Price 1997), started from the best maneuvers
of the catalogue, and refined by a pattern search.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fieldsid.maneuvers import Maneuver, Parameter, all_maneuvers, pick_maneuver
from fieldsid.maneuvers.switched import COUNT, HOLDS
from fieldsid.numerics.arrays import FloatArray
from fieldsid.planning.design.objective import Objective
from fieldsid.planning.flight.excitation import Excitation, fin_command, fits

LEFT_OUT = ("switched", "turning_circle")
"""Maneuvers that are not in this search: `switched` has one of its own, and a circle serves the turning radius."""
STEP_FACTOR = 1.35
SHORTEST_HOLD_S = 0.25
MEMBERS, ROUNDS, PATTERN_ROUNDS = 20, 12, 2
SMALLEST = 0.02
"""Least amplitude over the fin limit."""
DIFFERENTIAL_WEIGHT, CROSSOVER_SHARE = 0.7, 0.8
"""Differential weight F and crossover probability CR."""
SEARCH_MARGIN = 0.9
"""Share of the envelope that the search may use: some draws of the prior have larger excursions than its corners, and a signal
that is reduced for them afterwards is no longer optimal."""


@dataclass(frozen=True, slots=True)
class Scored:
    """A candidate and its cost; lower is better."""

    candidate: Excitation
    cost: float


def catalogue(objective: Objective) -> list[Scored]:
    """Return every maneuver of the catalogue that fits the window, tuned, best first."""
    found = []
    for maneuver in all_maneuvers().values():
        if maneuver.name in LEFT_OUT:
            continue
        start = _start_of(maneuver, objective)
        if start is not None:
            found.append(_coordinate_search(objective, start))
    return sorted(found, key=lambda s: s.cost)


def switching(objective: Objective, seeds: list[Excitation], seed: int) -> Scored:
    """Return the best binary signal, found from a population that contains the seeds; its holds are multiples of the sample."""
    rng = np.random.default_rng(seed)
    base = pick_maneuver("switched")
    limit = objective.envelope.fin

    def candidate(x: FloatArray) -> Excitation:
        values = dict(zip(HOLDS, x[:COUNT].tolist(), strict=True))
        return Excitation("switched", {**base.defaults, **values, "amplitude": float(x[COUNT]) * limit})

    def cost(x: FloatArray) -> float:
        return objective.cost(candidate(x), margin=SEARCH_MARGIN)

    room = objective.window.excitation
    members = _population(objective, seeds, room, rng)
    costs = np.array([cost(m) for m in members])
    for _ in range(ROUNDS):
        _evolve(members, costs, cost, room, rng)
    best = int(np.argmin(costs))
    x, _ = _pattern_search(members[best], float(costs[best]), cost, room)
    rounded = candidate(np.append(merge_short_holds(x[:COUNT], 1.0 / objective.window.rate_hz), x[COUNT]))
    return Scored(rounded, objective.cost(rounded))


def merge_short_holds(holds: FloatArray, step: float) -> FloatArray:
    """Return holds as multiples of `step` s; one that is too short for a servo to follow is merged with its two neighbours."""
    # the times of the jumps are rounded down, so that the sum does not exceed the window
    edges = np.floor(np.cumsum(holds) / step + 1e-6) * step
    merged = [float(h) for h in np.diff(edges, prepend=0.0)]
    while len(merged) > 1 and min(merged) < SHORTEST_HOLD_S:
        i = int(np.argmin(merged))
        if i in (0, len(merged) - 1):
            # at an end the only neighbour has the other sign: the hold is dropped
            del merged[i]
        else:
            merged[i - 1 : i + 2] = [sum(merged[i - 1 : i + 2])]
    return np.round(np.pad(merged, (0, holds.size - len(merged))), 9)


def _population(objective: Objective, seeds: list[Excitation], room: float, rng: np.random.Generator) -> FloatArray:
    """Return members (MEMBERS, COUNT + 1): holds in s and amplitude over the fin limit."""
    scale = 1.0 / max(objective.scene.base.damping, 0.3)
    holds = np.exp(rng.normal(np.log(2.0 * scale), 0.6, (MEMBERS, COUNT)))
    members = np.column_stack([holds, rng.uniform(0.5, 1.0, MEMBERS)])
    for i, one in enumerate(seeds[: MEMBERS // 2]):
        members[i] = [*(one.parameters[h] for h in HOLDS), one.parameters["amplitude"] / objective.envelope.fin]
    return _legal(members, room)


def as_switched(objective: Objective, candidate: Excitation) -> Excitation | None:
    """Return a candidate whose fin jumps between two opposite angles as the maneuver `switched`; None for any other."""
    if candidate.record.rule is not None:
        return None
    command = fin_command(candidate, objective.window)
    start, end = (
        round(t * objective.window.rate_hz) for t in (objective.window.lead, objective.window.length - objective.window.recover)
    )
    fin = np.trim_zeros(np.nan_to_num(command[start : end + 1]), "b")
    if np.unique(np.round(np.abs(fin), 6)).size != 1:
        return None
    side = np.sign(fin)
    edges = np.flatnonzero(np.diff(side)) + 1
    holds = np.diff(np.concatenate([[0], edges, [fin.size]]))[:COUNT] / objective.window.rate_hz
    base = pick_maneuver("switched").defaults | dict.fromkeys(HOLDS, 0.0)
    values = dict(zip(HOLDS, holds.tolist(), strict=False))
    return Excitation("switched", {**base, **values, "amplitude": candidate.parameters["amplitude"]})


def _legal(members: FloatArray, room: float) -> FloatArray:
    """Return members with their holds scaled to fit `room` s and an amplitude of SMALLEST or more."""
    out = np.abs(members)
    out[..., COUNT] = np.clip(out[..., COUNT], SMALLEST, 1.0)
    out[..., :COUNT] = np.minimum(out[..., :COUNT], room)
    total = out[..., :COUNT].sum(axis=-1, keepdims=True)
    out[..., :COUNT] *= np.minimum(1.0, room / np.maximum(total, 1e-9))
    return out


def _evolve(
    members: FloatArray, costs: FloatArray, cost: Callable[[FloatArray], float], room: float, rng: np.random.Generator
) -> None:
    """Advance a population by one generation of differential evolution (best/1 or rand/1 at random)."""
    count = costs.size
    for i in range(count):
        a, b, c = rng.choice(count, 3, replace=False)
        base = members[int(np.argmin(costs))] if rng.random() < 0.6 else members[a]
        trial = base + DIFFERENTIAL_WEIGHT * (members[b] - members[c])
        keep = rng.random(trial.size) > CROSSOVER_SHARE
        trial = _legal(np.where(keep, members[i], trial)[None], room)[0]
        value = cost(trial)
        if value < costs[i]:
            members[i], costs[i] = trial, value


def _pattern_search(x: FloatArray, lowest: float, cost: Callable[[FloatArray], float], room: float) -> tuple[FloatArray, float]:
    size = 0.25
    for _ in range(PATTERN_ROUNDS):
        moved = False
        for i in range(x.size):
            for factor in (1.0 + size, 1.0 / (1.0 + size)):
                trial = x.copy()
                trial[i] *= factor
                trial = _legal(trial[None], room)[0]
                value = cost(trial)
                if value < lowest:
                    x, lowest, moved = trial, value, True
                    break
        size *= 1.0 if moved else 0.4
    return x, lowest


def _start_of(maneuver: Maneuver, objective: Objective) -> Excitation | None:
    """Return a maneuver at its defaults, shortened to fit the window; None where even the shortest does not fit."""
    room = objective.window.excitation
    values = maneuver.defaults | {"amplitude": objective.envelope.fin}
    if "second" in values:
        values["second"] = min(values["second"], objective.envelope.fin)
    for name in ("duration", "period"):
        if name in values:
            values[name] = room
    if maneuver.name == "multisine" and objective.scene.axis.value == "pitch":
        values["channel"] = 1.0
    candidate = Excitation(maneuver.name, maneuver.checked(values))
    for name in ("recovery", "repeats", "steps", "width", "unit", "hold"):
        while name in values and not fits(candidate, objective.window):
            low = next(p.low for p in maneuver.parameters if p.name == name)
            whole = next(p.whole for p in maneuver.parameters if p.name == name)
            value = candidate.parameters[name]
            lower = value - 1.0 if whole else value / STEP_FACTOR if value > 0.1 else 0.0
            if lower < low or lower >= value:
                break
            candidate = candidate.with_(**{name: lower})
    return candidate if fits(candidate, objective.window) else None


def _coordinate_search(objective: Objective, start: Excitation) -> Scored:
    """Return the best excitation after one step in each parameter of a maneuver in turn."""
    best = at_best_amplitude(objective, start)
    for parameter in (p for p in start.record.parameters if p.tuned):
        for value in moves_of(parameter, best.candidate.parameters[parameter.name], objective.envelope.fin):
            trial = best.candidate.with_(**{parameter.name: value})
            if fits(trial, objective.window) and (cost := objective.cost(trial)) < best.cost:
                best = Scored(trial, cost)
                break
    return best


def at_best_amplitude(objective: Objective, candidate: Excitation) -> Scored:
    """Return the candidate at the amplitude of least cost, out of three shares of its own."""
    amplitude = candidate.parameters["amplitude"]
    trials = [candidate.with_(amplitude=amplitude * share) for share in (1.0, 0.6, 0.35)]
    scored = [Scored(c, objective.cost(c)) for c in trials]
    return min(scored, key=lambda s: s.cost)


def moves_of(parameter: Parameter, value: float, fin: float) -> list[float]:
    """Return the values one step up and one step down from a parameter, inside its bounds and the fin limit."""
    options = [value + 1.0, value - 1.0] if parameter.whole else [value * STEP_FACTOR, value / STEP_FACTOR]
    high = min(parameter.high, fin) if parameter.unit == "rad" and parameter.name != "turn" else parameter.high
    return [o for o in options if parameter.low <= o <= high]
