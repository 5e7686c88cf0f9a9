"""What every maneuver keeps to: bounded named parameters, commands within the amplitude, the autopilot back at its end."""

from __future__ import annotations

from dataclasses import replace
from operator import attrgetter

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from fieldsid.errors import UsageError
from fieldsid.maneuvers import Autopilot, Limits, Schedule, all_maneuvers, fly, parse_spec, spec_of
from fieldsid.numerics.jit import plain_of

ALL = list(all_maneuvers().values())
OPEN = [m for m in ALL if m.rule is None]
RULES = [m for m in ALL if m.rule is not None]
RATE_HZ = 20.0


class Hull:
    """Vehicles r' = -a r + b d side by side, in small exact-enough steps."""

    def __init__(self, *pairs: tuple[float, float]) -> None:
        self.damping, self.authority = np.array(pairs, dtype=float).T
        self.angle, self.rate, self.trim = np.zeros((3, self.size))

    @property
    def size(self) -> int:
        return self.damping.size

    def advance(self, fin, step):
        for _ in range(5):
            self.rate = self.rate + step / 5 * (self.authority * fin - self.damping * self.rate)
            self.angle = self.angle + step / 5 * self.rate
        return self.angle.copy(), self.rate.copy()


def time_over(maneuver, values):
    return np.arange(-2.0, maneuver.duration(values) + 3.0, 1.0 / RATE_HZ)


@pytest.mark.parametrize("maneuver", ALL, ids=attrgetter("name"))
def test_it_declares_what_a_planner_asks(maneuver):
    names = [p.name for p in maneuver.parameters]
    assert "amplitude" in names
    assert len(set(names)) == len(names)
    assert maneuver.says
    assert maneuver.source
    assert (maneuver.command is None) != (maneuver.rule is None)
    for p in maneuver.parameters:
        assert p.low <= p.default <= p.high, p.name
        assert p.says, p.name
        assert p.unit in {"rad", "s", "Hz", ""}, p.name
        assert not p.whole or p.default == round(p.default)
    assert 0 < maneuver.duration(maneuver.defaults) <= 3600


@pytest.mark.parametrize("maneuver", ALL, ids=attrgetter("name"))
def test_its_defaults_are_accepted_and_anything_outside_the_bounds_is_not(maneuver):
    assert maneuver.checked(maneuver.defaults) == maneuver.defaults
    for p in maneuver.parameters:
        for wrong in (p.low - 1.0, p.high + 1.0, float("nan"), float("inf")):
            with pytest.raises(UsageError, match=p.name):
                maneuver.checked({p.name: wrong})


@pytest.mark.parametrize("maneuver", ALL, ids=attrgetter("name"))
def test_its_text_form_reads_back_to_the_same_maneuver(maneuver):
    changed = {p.name: p.low if p.whole else 0.5 * (p.default + p.high) for p in maneuver.parameters}
    again, values = parse_spec(spec_of(maneuver, changed))
    assert again is maneuver
    assert values == pytest.approx(changed, rel=1e-5)


@pytest.mark.parametrize("maneuver", OPEN, ids=attrgetter("name"))
@settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(data=st.data())
def test_its_command_stays_within_what_was_asked_for_and_ends_with_the_autopilot(maneuver, data):
    drawn = {
        p.name: data.draw(st.integers(int(p.low), min(int(p.high), 12)) if p.whole else st.floats(p.low, min(p.high, 40.0)))
        for p in maneuver.parameters
    }
    values = maneuver.checked(drawn)
    if maneuver.duration(values) > 400:
        return
    time = time_over(maneuver, values)
    command = maneuver.command(values, time)
    assert command.shape == time.shape
    largest = max(v for p, v in ((p, values[p.name]) for p in maneuver.parameters) if p.unit == "rad")
    assert np.nanmax(np.abs(command)) <= largest * (1 + 1e-9)
    assert np.all(np.nan_to_num(command[time < -1e-6]) == 0)
    assert np.all(np.isnan(command[time >= maneuver.duration(values) + 1e-6]))


@pytest.mark.parametrize("maneuver", OPEN, ids=attrgetter("name"))
def test_its_command_moves_the_fin_to_both_sides(maneuver):
    values = maneuver.defaults
    command = maneuver.command(values, time_over(maneuver, values))
    assert np.nanmax(command) > 0.5 * values["amplitude"]
    assert np.nanmin(command) < -0.5 * values["amplitude"]


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("maneuver", RULES, ids=attrgetter("name"))
def test_a_rule_ends_by_itself_on_vehicles_of_either_fin_sign(maneuver, sign):
    hull = Hull((1.0, 0.9 * sign), (1.6, 0.7 * sign))
    flight = fly(
        maneuver, maneuver.defaults, hull,
        limits=Limits(0.3), autopilot=Autopilot(0.4 * sign, 0.2 * sign, 0.3), schedule=Schedule(RATE_HZ),
    )  # fmt: skip
    assert flight.excitation[1] < maneuver.duration(maneuver.defaults)
    assert flight.recovering[-1].all()
    assert not flight.recovering[round(2.5 * RATE_HZ)].any()
    assert np.all(np.abs(flight.fin) <= 0.3 + 1e-12)


@pytest.mark.parametrize("maneuver", RULES, ids=attrgetter("name"))
def test_a_rule_compiled_is_the_rule_as_written(maneuver):
    plain = replace(maneuver, rule=plain_of(maneuver.rule))
    for values in (maneuver.defaults, maneuver.checked({"mirrored": 1, "duration": 9.0})):
        one, other = (
            fly(
                m,
                values,
                Hull((1.0, 0.9), (1.6, -0.7), (2.0, 0.0)),
                limits=Limits(0.3, 0.5),
                autopilot=Autopilot(0.4, 0.2, 0.3),
                schedule=Schedule(RATE_HZ),
            )
            for m in (maneuver, plain)
        )
        np.testing.assert_array_equal(one.fin, other.fin)
        np.testing.assert_array_equal(one.recovering, other.recovering)
        assert one.excitation == other.excitation


@pytest.mark.parametrize("maneuver", ALL, ids=attrgetter("name"))
@pytest.mark.parametrize(("fin", "rate"), [(0.05, 0.3), (0.2, np.inf)])
def test_flown_it_never_leaves_the_fin_limits(maneuver, fin, rate):
    flight = fly(
        maneuver, maneuver.defaults, Hull((1.0, -0.9)),
        limits=Limits(fin, rate), autopilot=Autopilot(-0.4, -0.2), schedule=Schedule(RATE_HZ, recover=5.0),
    )  # fmt: skip
    assert np.max(np.abs(flight.fin)) <= fin + 1e-12
    assert np.max(np.abs(np.diff(flight.fin, axis=0))) <= rate / RATE_HZ + 1e-12 if np.isfinite(rate) else True
