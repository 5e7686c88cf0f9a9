"""Aircraft, REMUS, barge and ship, of 0.2 to 60 s: identified and diagnosed alike, but for the sway of the slow.

All kinds are one hull told in other units of time (tests/truth/vehicle_kinds.py). All diagnoses:
`pytest -m slow tests/recovery/test_vehicle_kinds.py`.
"""

from __future__ import annotations

from functools import cache

import pytest
from truth.vehicle_kinds import HIDDEN, KINDS, TRAINING, Kind, logs_of, physics_of

from fieldsid.diagnosis import diagnose
from fieldsid.fitting.fit import Fit
from fieldsid.fitting.identify import identify
from fieldsid.logs.run import Run
from fieldsid.models.axis import Axis

BY_NAME = {kind.name: kind for kind in KINDS}
POWERS = {"a22": 1, "b2": 2, "quadratic": 0, "cross_damping": 1, "cross_rate": 2}
"""Powers of the time constant that make a parameter a number without a unit of time."""
SLOW_SWAY = {"barge", "ship"}
"""Kinds whose sway dies out slower than the catalogue's bound of 0.1 1/s: it is not theirs."""
CASES = [(kind, effect) for kind in BY_NAME for effect in HIDDEN if not (kind in SLOW_SWAY and effect == "sway_coupling")]
SHORT = (pytest.param("aircraft", "sway_coupling", marks=pytest.mark.slow), ("ship", ""))


@cache
def runs(kind: str, effect: str) -> tuple[tuple[Run, ...], tuple[Run, ...]]:
    """Return the runs to learn from and those to judge on."""
    logs = logs_of(BY_NAME[kind], effect)
    every = {n: Run(n, log["time_s"], {k: v for k, v in log.items() if k != "time_s"}) for n, log in logs.items()}
    return tuple(every[n] for n in TRAINING), tuple(r for n, r in every.items() if n not in TRAINING)


@cache
def fitted(kind: str, effect: str) -> Fit:
    """Return the fit to the runs to learn from, of what is hidden alone."""
    effects = [effect] if effect else []
    (found,) = identify(runs(kind, effect)[0], Axis.YAW, effects=effects, joint=True, method="output_error")
    return found


def expected(kind: Kind, effect: str) -> dict[str, float]:
    """Return the true numbers in the catalogue's words."""
    truth = physics_of(kind, effect)
    values = {"a22": truth.damping, "b2": truth.authority}
    if effect == "quadratic_damping":
        values["quadratic"] = truth.quadratic
    if effect == "sway_coupling":
        values |= {"cross_damping": truth.cross_damping, "cross_rate": -truth.cross_rate * truth.cross_moment}
    return values


@pytest.mark.parametrize(("kind", "effect"), CASES)
def test_the_numbers_of_every_kind_come_back_and_none_is_on_a_bound(kind, effect):
    found = fitted(kind, effect)
    for name, value in expected(BY_NAME[kind], effect).items():
        assert found.model.values[name] == pytest.approx(value, rel=0.05), name
    assert not [n for n in found.notes if n.code in ("on_bound", "unstable")]


@pytest.mark.parametrize("effect", HIDDEN, ids=lambda e: e or "nothing")
def test_what_is_found_does_not_hang_on_the_unit_of_time(effect):
    seen, kinds = {}, [kind for kind in KINDS if (kind.name, effect) in CASES]
    for kind in kinds:
        values = fitted(kind.name, effect).model.values
        seen[kind.name] = {n: values[n] * kind.time_constant ** POWERS[n] for n in expected(kind, effect)}
    for kind in kinds:
        assert seen[kind.name] == pytest.approx(seen["remus"], rel=0.02), kind.name


def diagnosed_right(kind: str, effect: str) -> None:
    """Assert that what a kind hides is named, and that no number of the model is on a bound."""
    training, unseen = runs(kind, effect)
    found = diagnose(training, Axis.YAW, unseen)
    assert (found.verdict, found.effects) == (("effect", (effect,)) if effect else ("sufficient", ())), found.says
    assert found.final.validation.over(found.noise_floor) < 1.05
    assert not [n for n in found.notes if n.code == "on_bound"]
    for name, value in expected(BY_NAME[kind], effect).items():
        assert found.model.values[name] == pytest.approx(value, rel=0.05), name


@pytest.mark.parametrize(("kind", "effect"), SHORT)
def test_what_the_fastest_and_the_slowest_hide_is_named(kind, effect):
    diagnosed_right(kind, effect)


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "effect"), CASES)
def test_what_every_kind_hides_is_named(kind, effect):
    diagnosed_right(kind, effect)
