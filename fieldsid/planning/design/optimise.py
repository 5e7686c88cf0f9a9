"""The search for the best candidate: every catalogued maneuver tuned coordinate by coordinate, switching times optimised.

Differential evolution over the holds of a switched signal (Storn and Price 1997), started from the best the
catalogue gives, then a pattern search on the holds.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fieldsid.maneuvers import Maneuver, Parameter, all_maneuvers, pick_maneuver
from fieldsid.maneuvers.switched import COUNT, HOLDS
from fieldsid.numerics.arrays import FloatArray
from fieldsid.planning.design.objective import Objective
from fieldsid.planning.flight.excitation import Excitation, asked_of, fits

LEFT_OUT = ("switched", "turning_circle")
"""Searched apart; a full circle is flown for the radius, not for parameters."""
STEP_FACTOR = 1.35
SHORTEST_HOLD_S = 0.25
MEMBERS, ROUNDS, PATTERN_ROUNDS = 20, 12, 2
SMALLEST = 0.02
"""Of an amplitude, over the fin limit."""
DIFFERENTIAL_WEIGHT, CROSSOVER_SHARE = 0.7, 0.8
"""Step of the coordinate search, as a factor; shortest hold; differential weight and crossover share."""
SEARCH_MARGIN = 0.9
"""Share of the envelope the search may use: some draws of the prior go further than its corners, and a signal that has to be
made smaller for them afterwards is no longer the best."""


@dataclass(frozen=True, slots=True)
class Scored:
    """A candidate and its cost, lower is better."""

    candidate: Excitation
    cost: float


def catalogue(judge: Objective) -> list[Scored]:
    """Return every maneuver of the catalogue that fits the window, tuned, best first."""
    found = []
    for maneuver in all_maneuvers().values():
        if maneuver.name in LEFT_OUT:
            continue
        start = _started(maneuver, judge)
        if start is not None:
            found.append(_coordinate_search(judge, start))
    return sorted(found, key=lambda s: s.cost)


def switching(judge: Objective, seeds: list[Excitation], seed: int) -> Scored:
    """Return the best switched signal found from some seeds, which take part themselves, its holds in whole samples."""
    rng = np.random.default_rng(seed)
    base = pick_maneuver("switched")
    limit = judge.envelope.fin

    def candidate(x: FloatArray) -> Excitation:
        values = dict(zip(HOLDS, x[:COUNT].tolist(), strict=True))
        return Excitation("switched", {**base.defaults, **values, "amplitude": float(x[COUNT]) * limit})

    def cost(x: FloatArray) -> float:
        return judge.cost(candidate(x), margin=SEARCH_MARGIN)

    room = judge.window.excitation
    members = _population(judge, seeds, room, rng)
    costs = np.array([cost(m) for m in members])
    for _ in range(ROUNDS):
        _evolve(members, costs, cost, room, rng)
    best = int(np.argmin(costs))
    x, _ = _pattern_search(members[best], float(costs[best]), cost, room)
    tidy = candidate(np.append(merge_short_holds(x[:COUNT], 1.0 / judge.window.rate_hz), x[COUNT]))
    return Scored(tidy, judge.cost(tidy))


def merge_short_holds(holds: FloatArray, step: float) -> FloatArray:
    """Return holds in whole samples of `step` s; one too short for a servo to follow joins its two neighbours."""
    # Whole samples by the instants of the jumps, downwards: the sum never outgrows the room there is.
    edges = np.floor(np.cumsum(holds) / step + 1e-6) * step
    left = [float(h) for h in np.diff(edges, prepend=0.0)]
    while len(left) > 1 and min(left) < SHORTEST_HOLD_S:
        i = int(np.argmin(left))
        if i in (0, len(left) - 1):
            # At an end there is one neighbour only, of the other side: the time is given up.
            del left[i]
        else:
            left[i - 1 : i + 2] = [sum(left[i - 1 : i + 2])]
    return np.round(np.pad(left, (0, holds.size - len(left))), 9)


def _population(judge: Objective, seeds: list[Excitation], room: float, rng: np.random.Generator) -> FloatArray:
    """Return members (MEMBERS, COUNT + 1): holds in s and amplitude over the fin limit."""
    scale = 1.0 / max(judge.scene.base.damping, 0.3)
    holds = np.exp(rng.normal(np.log(2.0 * scale), 0.6, (MEMBERS, COUNT)))
    members = np.column_stack([holds, rng.uniform(0.5, 1.0, MEMBERS)])
    for i, one in enumerate(seeds[: MEMBERS // 2]):
        members[i] = [*(one.parameters[h] for h in HOLDS), one.parameters["amplitude"] / judge.envelope.fin]
    return _legal(members, room)


def as_switched(judge: Objective, candidate: Excitation) -> Excitation | None:
    """Return a candidate that only jumps between two opposite angles as a switched signal, None for any other."""
    if candidate.record.rule is not None:
        return None
    asked = asked_of(candidate, judge.window)
    start, end = (round(t * judge.window.rate_hz) for t in (judge.window.lead, judge.window.length - judge.window.recover))
    fin = np.trim_zeros(np.nan_to_num(asked[start : end + 1]), "b")
    if np.unique(np.round(np.abs(fin), 6)).size != 1:
        return None
    side = np.sign(fin)
    edges = np.flatnonzero(np.diff(side)) + 1
    holds = np.diff(np.concatenate([[0], edges, [fin.size]]))[:COUNT] / judge.window.rate_hz
    base = pick_maneuver("switched").defaults | dict.fromkeys(HOLDS, 0.0)
    values = dict(zip(HOLDS, holds.tolist(), strict=False))
    return Excitation("switched", {**base, **values, "amplitude": candidate.parameters["amplitude"]})


def _legal(members: FloatArray, room: float) -> FloatArray:
    """Return members with holds that fit the room and an amplitude from SMALLEST on."""
    out = np.abs(members)
    out[..., COUNT] = np.clip(out[..., COUNT], SMALLEST, 1.0)
    out[..., :COUNT] = np.minimum(out[..., :COUNT], room)
    total = out[..., :COUNT].sum(axis=-1, keepdims=True)
    out[..., :COUNT] *= np.minimum(1.0, room / np.maximum(total, 1e-9))
    return out


def _evolve(
    members: FloatArray, costs: FloatArray, cost: Callable[[FloatArray], float], room: float, rng: np.random.Generator
) -> None:
    """Move a population on by one round of differential evolution (best/1 and rand/1 in turn)."""
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


def _started(maneuver: Maneuver, judge: Objective) -> Excitation | None:
    """Return a maneuver at its defaults, as long as the window allows; None where even its shortest does not fit."""
    room = judge.window.excitation
    values = maneuver.defaults | {"amplitude": judge.envelope.fin}
    if "second" in values:
        values["second"] = min(values["second"], judge.envelope.fin)
    for name in ("duration", "period"):
        if name in values:
            values[name] = room
    if maneuver.name == "multisine" and judge.scene.axis.value == "pitch":
        values["channel"] = 1.0
    candidate = Excitation(maneuver.name, maneuver.checked(values))
    for name in ("recovery", "repeats", "steps", "width", "unit", "hold"):
        while name in values and not fits(candidate, judge.window):
            low = next(p.low for p in maneuver.parameters if p.name == name)
            whole = next(p.whole for p in maneuver.parameters if p.name == name)
            value = candidate.parameters[name]
            lower = value - 1.0 if whole else value / STEP_FACTOR if value > 0.1 else 0.0
            if lower < low or lower >= value:
                break
            candidate = candidate.with_(**{name: lower})
    return candidate if fits(candidate, judge.window) else None


def _coordinate_search(judge: Objective, start: Excitation) -> Scored:
    """Return the best of a maneuver after one step of each of its parameters in turn."""
    best = largest_paying(judge, start)
    for parameter in (p for p in start.record.parameters if p.tuned):
        for value in moves_of(parameter, best.candidate.parameters[parameter.name], judge.envelope.fin):
            trial = best.candidate.with_(**{parameter.name: value})
            if fits(trial, judge.window) and (cost := judge.cost(trial)) < best.cost:
                best = Scored(trial, cost)
                break
    return best


def largest_paying(judge: Objective, candidate: Excitation) -> Scored:
    """Return the candidate at the largest of a few amplitudes that pays."""
    amplitude = candidate.parameters["amplitude"]
    tried = [candidate.with_(amplitude=amplitude * share) for share in (1.0, 0.6, 0.35)]
    scored = [Scored(c, judge.cost(c)) for c in tried]
    return min(scored, key=lambda s: s.cost)


def moves_of(parameter: Parameter, value: float, fin: float) -> list[float]:
    """Return the values one step up and one step down from a parameter, inside its bounds and the fin limit."""
    options = [value + 1.0, value - 1.0] if parameter.whole else [value * STEP_FACTOR, value / STEP_FACTOR]
    high = min(parameter.high, fin) if parameter.unit == "rad" and parameter.name != "turn" else parameter.high
    return [o for o in options if parameter.low <= o <= high]
