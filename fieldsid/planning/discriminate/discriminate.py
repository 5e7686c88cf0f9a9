"""The maneuver that discriminates rival models best: their predictions differ most after each has been refitted."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import permutations
from typing import Annotated

import numpy as np

from fieldsid.errors import UsageError
from fieldsid.maneuvers import RATE_HZ, pick_maneuver
from fieldsid.models.model import Model
from fieldsid.planning.design.best_leg import FINALISTS
from fieldsid.planning.design.optimise import moves_of
from fieldsid.planning.design.plan import MOST_PASSES
from fieldsid.planning.discriminate.t_optimality import Rival, log_odds, rival_of
from fieldsid.planning.flight.excitation import Excitation, Window, fits, flown
from fieldsid.planning.flight.operating_point import autopilot_of, operating_point
from fieldsid.planning.flight.rule_flight import Response
from fieldsid.planning.safety.envelope import Envelope, excursions_of, outside
from fieldsid.records.keys import Key, Number

Pairs = Mapping[str, float]
Map = Callable[[Callable[[Excitation], Pairs], Sequence[Excitation]], list[Pairs]]
"""The expected log odds of each ordered pair of rivals; and a map function that evaluates them at several candidates."""

LONGEST_WINDOW_S = 60.0
"""Length of the window unless another is requested: slow differences discriminate rivals as well."""
MOST_LOG_ODDS = float(np.log(np.finfo(np.float64).max))
FAST_HZ, BEYOND_DOUBT = 10.0, 50.0
AT_ONCE = 2
"""Candidates that are evaluated together before the fast search checks whether one of them is decisive."""
DECISIVE_LOG_ODDS = float(np.log(20.0))
"""Log odds above which a pair counts as discriminated."""


@dataclass(frozen=True, slots=True)
class Separation:
    """The discriminating maneuver: its parameters, speed (m/s), and the expected log odds for the true model.

    `expected_log_odds` is the least over the ordered pairs; `pairs` has all of them, with keys "true>wrong".
    """

    maneuver: Annotated[str, Key("The maneuver.")]
    parameters: Annotated[Mapping[str, float], Key("Its parameters.")]
    speed: Annotated[float, Key("The speed to fly it at.", "speed_m_s")]
    expected_log_odds: Annotated[Number, Key("Smallest log odds of the pairs.")]
    pairs: Annotated[Mapping[str, float], Key("`true>wrong`: expected log odds for the true one.")]
    window: Window
    alternatives: Annotated[Mapping[str, float], Key("Other maneuvers, with what they are expected to give.")]

    @property
    def candidate(self) -> Excitation:
        """The maneuver as a candidate of a plan."""
        return Excitation(self.maneuver, self.parameters)

    @property
    def decides(self) -> Annotated[bool, Key()]:
        """Whether every pair is expected to be discriminated at odds of 20 to 1 or better."""
        return self.expected_log_odds >= DECISIVE_LOG_ODDS

    @property
    def spec(self) -> Annotated[str, Key()]:
        """The maneuver with its parameters, as `--maneuver` takes it."""
        return self.candidate.spec

    @property
    def duration_s(self) -> Annotated[float, Key()]:
        """Its length."""
        return self.window.length

    @property
    def expected_odds(self) -> Annotated[Number, Key()]:
        """The same as odds."""
        return float(np.exp(min(self.expected_log_odds, MOST_LOG_ODDS)))

    def verdict(self) -> str:
        """Return the rivals and the least of the expected odds, as what the legs of a plan do."""
        rivals = " and ".join(dict.fromkeys(name for key in self.pairs for name in key.split(">")))
        return f"{rivals} apart at odds of {_odds(self.expected_log_odds)}" + ("" if self.decides else f"; {self._needed()}")

    def _needed(self) -> str:
        """Return how many passes are expected to give odds of 20 to 1."""
        passes = np.ceil(DECISIVE_LOG_ODDS / max(self.expected_log_odds, 1e-9))
        enough = f"{passes:.0f} are" if passes <= MOST_PASSES else f"nor are {MOST_PASSES}"
        return f"one pass is not enough for odds of 20 to 1, {enough}"

    def says(self) -> list[str]:
        """Return the expected odds, in sentences."""
        lines = [f"`{self.candidate.spec}` at {self.speed:g} m/s tells them apart{'' if self.decides else ' best'}:"]
        for key, value in self.pairs.items():
            true, _, wrong = key.partition(">")
            lines.append(f"  if it is {true}: odds {_odds(value)} against {wrong}")
        if not self.decides:
            lines.append(f"{self._needed()}; or leave it more room")
        return lines


@dataclass(frozen=True, slots=True)
class _RivalFlights:
    rivals: tuple[Rival, ...]
    envelope: Envelope
    window: Window
    run_up: float

    @property
    def speed(self) -> float:
        return self.rivals[0].scene.speed

    def responses(self, candidate: Excitation) -> list[Response] | None:
        """Return every rival's flight, None where one leaves the envelope."""
        limits = self.envelope.limits
        autopilot = autopilot_of(self.rivals[0].scene.base, limits)
        flights = [flown(rival.scene, candidate, self.window, limits, autopilot) for rival in self.rivals]
        for rival, flight in zip(self.rivals, flights, strict=True):
            far = excursions_of(
                rival.scene.axis, flight.angle[:, None], flight.rate[:, None], speed=self.speed, step=1.0 / self.window.rate_hz,
                run_up=self.run_up, roll_gain=1.0,
            )  # fmt: skip
            if not np.isfinite(flight.angle).all() or outside(far, self.envelope)[0]:
                return None
        return flights

    def pairs(self, candidate: Excitation) -> Pairs:
        """Return the expected log odds of every ordered pair, empty where a rival leaves the envelope.

        A pair whose true model is nested in the wrong one is left out: the larger model fits at least as well.
        """
        flights = self.responses(candidate)
        if flights is None:
            return {}
        found = {}
        for (true, flight), (wrong, _) in permutations(zip(self.rivals, flights, strict=True), 2):
            if not set(true.scene.model.effects) <= set(wrong.scene.model.effects):
                found[f"{true.name}>{wrong.name}"] = log_odds(true, wrong, flight)
        return found


def separate(
    models: Sequence[Model],
    envelope: Envelope,
    *,
    speed: float,
    rate_hz: float = RATE_HZ,
    window_s: float = LONGEST_WINDOW_S,
    run_up_s: float = 0.0,
    candidates: Sequence[Excitation] | None = None,
    fast: bool = False,
    mapped: Map = lambda function, candidates: list(map(function, candidates)),
) -> Separation:
    """Return the maneuver inside the envelope that discriminates rival models best at a speed (m/s).

    `fast`: at most 10 Hz, only the maneuvers that the rivals' effects name in `excited_by`, no tuning, and the search ends at the
    first clearly decisive maneuver. `candidates` replace the catalogue. `mapped` evaluates several candidates in parallel. Raises
    UsageError for fewer than two rivals, rivals of different axes, or when no maneuver stays within the envelope.
    """
    _check(models)
    rivals = tuple(rival_of(operating_point(m, speed)) for m in models)
    window = Window(window_s, rate_hz=min(rate_hz, FAST_HZ) if fast else rate_hz)
    arena = _RivalFlights(rivals, envelope, window, run_up_s * speed)
    among = candidate_maneuvers(window, envelope) if candidates is None else candidates
    scored = sorted(_scored(arena, among, mapped, fast=fast), key=lambda s: -worth(s[1]))
    if not scored:
        raise UsageError(
            "no maneuver of the catalogue stays inside the envelope for every rival",
            found=f"at {speed:g} m/s; "
            + (", ".join(f"{k} {v:.3g}" for k, v in envelope.excursion_limits().items()) or "no room"),
            hint=envelope.widening() + ("; `--max-heading none` lets circles in" if envelope.heading is not None else ""),
        )
    tuned = scored if fast else [_tuned(arena, *s) for s in scored[:FINALISTS]]
    candidate, pairs = max(tuned, key=lambda s: worth(s[1]))
    window = replace(_shortened(window, arena.responses(candidate)), rate_hz=rate_hz)
    return Separation(
        candidate.maneuver, candidate.parameters, speed, min(pairs.values()), pairs, window,
        {c.spec: min(p.values()) for c, p in scored[:5]},
    )  # fmt: skip


def as_flown(
    found: Separation, models: Sequence[Model], envelope: Envelope, candidate: Excitation, run_up_s: float
) -> Separation:
    """Return a separation with another candidate in place of its own, and the log odds expected of that one."""
    rivals = tuple(rival_of(operating_point(m, found.speed)) for m in models)
    simulator = _RivalFlights(rivals, envelope, found.window, run_up_s * found.speed)
    pairs = simulator.pairs(candidate)
    return replace(
        found, maneuver=candidate.maneuver, parameters=candidate.parameters, pairs=pairs,
        expected_log_odds=min(pairs.values(), default=0.0),
    )  # fmt: skip


def _check(models: Sequence[Model]) -> None:
    if len(models) < 2:
        raise UsageError("one model has no rival", found=f"{len(models)} model", hint="name two: `--separate delay,servo_lag`")
    if len({m.axis for m in models}) > 1:
        raise UsageError("the rivals are of different axes", found=", ".join(m.axis.value for m in models), hint="plan one axis")
    if len(models) == 2 and set(models[0].effects) == set(models[1].effects):
        raise UsageError("the two rivals are the same model", found="+".join(models[0].effects), hint="name two different ones")


def _scored(arena: _RivalFlights, candidates: Sequence[Excitation], mapped: Map, *, fast: bool) -> list[tuple[Excitation, Pairs]]:
    """Return the candidates that stay within the envelope, with the log odds of their pairs."""
    named = {m for r in arena.rivals for e in r.scene.effects for m in e.excited_by}
    chosen = [c for c in candidates if not (fast and named) or c.maneuver in named]
    scored = list[tuple[Excitation, Pairs]]()
    for first in range(0, len(chosen), AT_ONCE):
        batch = chosen[first : first + AT_ONCE]
        scored += [(c, pairs) for c, pairs in zip(batch, mapped(arena.pairs, batch), strict=True) if pairs]
        if fast and any(min(pairs.values()) > BEYOND_DOUBT for _, pairs in scored[-AT_ONCE:]):
            break
    return scored


def worth(pairs: Mapping[str, float]) -> float:
    """Return the utility of a maneuver: the mean over the pairs of a function that saturates once a pair is discriminated.

    A rival whose effect was fitted to almost zero equals the model without it, and no maneuver discriminates the two: a minimum
    over the pairs would then be useless.
    """
    values = np.maximum(np.array(list(pairs.values())), 0.0)
    more = np.log1p(values)
    return float(np.mean(1.0 - np.exp(-values / DECISIVE_LOG_ODDS)) + 1e-3 * more.min() + 1e-5 * more.mean())


def candidate_maneuvers(window: Window, envelope: Envelope) -> list[Excitation]:
    """Return the candidates: maneuvers of the catalogue, small, large, slow and fast, that fit the window."""
    fin, room = envelope.fin, window.excitation
    specified: list[tuple[str, dict[str, float]]] = [
        ("stairs", {"amplitude": fin, "lowest": 0.12 * fin, "steps": 5, "hold": room / 10.5}),
        ("stairs", {"amplitude": 0.5 * fin, "lowest": 0.06 * fin, "steps": 6, "hold": room / 12.5}),
        ("square_pulses", {"amplitude": fin, "second": 0.3 * fin, "width": room / 7.0, "recovery": room / 3.5}),
        ("square_pulses", {"amplitude": fin, "second": 0.5 * fin, "width": 2.0, "recovery": min(13.0, room / 3)}),
        ("three_two_one_one", {"amplitude": fin, "unit": room / 14.5, "repeats": 2}),
        ("prbs", {"amplitude": fin, "bit": 0.5, "order": 7, "duration": room}),
        ("prbs", {"amplitude": 0.3 * fin, "bit": 0.8, "order": 6, "duration": room}),
        ("chirp", {"amplitude": fin, "low_hz": 0.05, "high_hz": 1.5, "duration": room}),
        ("multisine", {"amplitude": fin, "low_hz": 0.05, "high_hz": 1.0, "period": room}),
        ("zigzag", {"amplitude": fin, "turn": 0.35, "reversals": 6, "duration": room}),
        ("zigzag", {"amplitude": fin, "turn": 1.2, "reversals": 4, "duration": room}),
        ("turning_circle", {"amplitude": fin, "turn": 4 * np.pi, "pull_out": 5.0, "duration": room}),
        ("turning_circle", {"amplitude": 0.5 * fin, "turn": 4 * np.pi, "pull_out": 5.0, "duration": room}),
    ]
    made = [Excitation(name, pick_maneuver(name).checked(values)) for name, values in specified]
    return [c for c in made if fits(c, window)]


def _tuned(arena: _RivalFlights, candidate: Excitation, pairs: Mapping[str, float]) -> tuple[Excitation, Mapping[str, float]]:
    """Return the candidate after one step in each of its parameters that increases its utility, with its pairs."""
    for parameter in candidate.record.parameters:
        if not parameter.tuned:
            continue
        for value in moves_of(parameter, candidate.parameters[parameter.name], arena.envelope.fin):
            trial = candidate.with_(**{parameter.name: value})
            found = arena.pairs(trial) if fits(trial, arena.window) else {}
            if found and worth(found) > worth(pairs):
                candidate, pairs = trial, found
                break
    return candidate, pairs


def _shortened(window: Window, flights: Sequence[Response] | None) -> Window:
    """Return the window shortened to the longest flight: a rule may end before its longest duration."""
    if not flights:
        return window
    longest = max(float(f.time[-1]) for f in flights)
    return replace(window, length=max(min(window.length, longest), window.shortest))


def _odds(log: float) -> str:
    if log >= np.log(1e6):
        return "over a million to 1"
    return f"{np.exp(log):.3g} to 1"
