"""What every effect of the catalogue keeps to; a new file in fieldsid/effects gets these tests for free."""

from __future__ import annotations

import math
from dataclasses import replace
from types import MappingProxyType

import numpy as np
import pytest

from fieldsid.effects import all_effects
from fieldsid.maneuvers import all_maneuvers
from fieldsid.models.axis import NAMES, Axis
from fieldsid.models.effect import Effect, Motion, Stage, Terms
from fieldsid.models.fin_path import FinPath
from fieldsid.models.hull import CONSTANTS, FACTORS
from fieldsid.models.record import Record

EFFECTS = all_effects()
HOOKS = {
    Stage.ACTUATOR: {"fin"},
    Stage.HYDRODYNAMICS: {"terms", "slope", "core", "moment"},
    Stage.SENSOR: {"measure", "sensor_jvp", "sensor_slope"},
}
MANEUVERS = set(all_maneuvers())
ROLES = {"surge", "thrust", "roll", "depth"}
# Values at which an effect is absent, where that is not zero for every shared coefficient.
ABSENT = {"rate_limit": {"max_rate": math.inf}, "stall": {"stall_angle": 10.0, "slope_after": 0.0}}

each_effect = pytest.mark.parametrize("effect", EFFECTS.values(), ids=EFFECTS.keys())
each_coefficient = pytest.mark.parametrize(
    ("effect", "name"), [(e, c.name) for e in EFFECTS.values() for c in e.coefficients], ids=lambda v: getattr(v, "name", v)
)


def record(axis: Axis, *, held: bool = True) -> Record:
    rng = np.random.default_rng(5)
    time = np.cumsum(np.r_[100.0, rng.uniform(0.03, 0.07, 399)])
    t = time - time[0]
    fin = 0.26 * np.sign(np.sin(1.3 * t)) + 0.1 * np.sin(0.37 * t)
    signals = {"surge": 1.5 + 0.2 * np.sin(t), "thrust": 60.0 + 10.0 * np.sin(0.5 * t), "roll": 0.1 * np.cos(t)}
    signals |= {"depth": 2.0 + 0.1 * t}
    for array in (time, fin, *signals.values()):
        array.setflags(write=False)
    return Record(
        name="made", axis=axis, time=time, fin=fin, fin_is_held=held, fin_is_measured=not held,
        angle=np.zeros(400), rate=np.zeros(400), angle_ok=np.ones(400, bool), rate_ok=np.ones(400, bool),
        cross=0.1 * np.sin(0.7 * t), cross_ok=np.ones(400, bool), signals=MappingProxyType(signals), speed=1.5,
    )  # fmt: skip


def motion_of(log: Record) -> Motion:
    t = log.time - log.time[0]
    return Motion(2.0 * np.sin(0.4 * t), 0.8 * np.cos(0.4 * t))


def outputs(effect: Effect, values: dict[str, float], log: Record) -> dict[str, np.ndarray]:
    """Everything the effect's hooks give, as arrays by name."""
    found: dict[str, np.ndarray] = {}
    if effect.fin is not None:
        path = effect.fin(log.commanded, values, log)
        found |= {"start": path.start, "end": path.end, "mean": path.mean}
    if effect.terms is not None:
        terms = effect.terms(values, log)
        found |= {n: getattr(terms, n) for n in Terms.__dataclass_fields__ if getattr(terms, n) is not None}
    if effect.core is not None:
        core = effect.core(values, 1.3)
        found |= {n: np.array([getattr(core, n)]) for n in CONSTANTS}
    if effect.moment is not None:
        found["moment"] = effect.moment(motion_of(log), values, log)
    if effect.measure is not None:
        seen = effect.measure(motion_of(log), values, log)
        found |= {"angle": seen.angle, "rate": seen.rate}
    return found


def absent(effect: Effect) -> dict[str, float]:
    return {c.name: (0.0 if not c.per_run and c.low <= 0.0 <= c.high else c.start) for c in effect.coefficients} | ABSENT.get(
        effect.name, {}
    )


def untouched(name: str, log: Record) -> np.ndarray | float:
    path, motion = log.commanded, motion_of(log)
    plain = {"start": path.start, "end": path.end, "mean": path.mean, "angle": motion.angle, "rate": motion.rate}
    plain |= {"damping_factor": 1.0, "authority_factor": 1.0, "cross_factor": 1.0}
    return plain.get(name, 0.0)


@each_effect
def test_exactly_the_hooks_of_its_stage_are_given(effect):
    given = {hook for hooks in HOOKS.values() for hook in hooks if getattr(effect, hook) is not None}
    assert given
    assert given <= HOOKS[effect.stage]


@each_effect
def test_everything_a_command_may_print_is_declared(effect):
    for text in (effect.says, effect.equation, effect.telltale, effect.source):
        assert len(text) > 10
    assert effect.axes
    assert effect.excited_by
    assert set(effect.excited_by) <= MANEUVERS
    assert set(effect.needs) <= ROLES
    assert len(set(effect.excited_by)) == len(effect.excited_by)
    assert len(set(effect.mistaken_for)) == len(effect.mistaken_for)


@each_effect
def test_coefficients_have_unit_bounds_and_a_start_between_them(effect):
    assert effect.coefficients
    for c in effect.all_coefficients:
        assert c.unit
        assert c.says
        assert c.low < c.high
        assert all(c.low <= v <= c.high for v in (c.start, *c.scan))
        assert 0.0 < c.step < 0.1 * (c.high - c.low)


@each_effect
def test_rivals_are_known_effects_of_an_axis_they_share(effect):
    assert effect.mistaken_for
    assert effect.name not in effect.mistaken_for
    for rival in effect.mistaken_for:
        assert set(EFFECTS[rival].axes) & set(effect.axes), rival


@each_effect
def test_a_rival_of_every_axis_is_named(effect):
    for axis in effect.axes:
        assert any(axis in EFFECTS[r].axes for r in effect.mistaken_for), axis


@pytest.mark.parametrize("axis", Axis)
def test_no_two_effects_of_an_axis_share_a_coefficient(axis):
    names = [name for e in all_effects(axis).values() for name in e.names]
    names += [*NAMES[axis].base, NAMES[axis].trim_fin]
    assert len(names) == len(set(names))


def test_actuator_effects_have_an_order_of_their_own():
    orders = [e.order for e in EFFECTS.values() if e.stage is Stage.ACTUATOR]
    assert len(orders) == len(set(orders))
    assert min(orders) > 0


@each_effect
@pytest.mark.parametrize("held", [True, False], ids=["held", "measured"])
def test_an_absent_effect_changes_nothing(effect, held):
    log = record(effect.axes[0], held=held)
    values = absent(effect)
    if effect.name in ("crossflow_drag", "sway_coupling", "heave_coupling"):
        core = effect.core(values, 1.0)
        assert core.strip_moment == core.cross_rate == core.cross_fin == 0.0
        return
    for name, array in outputs(effect, values, log).items():
        wanted = 1.0 if name in FACTORS else untouched(name, log)
        np.testing.assert_allclose(array, wanted, rtol=0.0, atol=1e-12, err_msg=name)


@each_effect
@pytest.mark.parametrize("held", [True, False], ids=["held", "measured"])
def test_outputs_are_finite_over_the_declared_range_and_of_the_right_length(effect, held):
    log = record(effect.axes[0], held=held)
    rng = np.random.default_rng(11)
    for _ in range(8):
        values = {c.name: float(rng.uniform(c.low, c.high)) for c in effect.coefficients}
        for name, array in outputs(effect, values, log).items():
            assert np.isfinite(array).all(), (name, values)
            expected = {"start": 399, "end": 399, "mean": 399}.get(name, 1 if effect.core else 400)
            assert array.shape == (expected,), name


@each_effect
def test_hooks_are_pure(effect):
    log = record(effect.axes[0])
    values = MappingProxyType(effect.starts())
    first = outputs(effect, values, log)
    second = outputs(effect, values, log)
    for name, array in first.items():
        np.testing.assert_array_equal(array, second[name])


@each_coefficient
def test_every_coefficient_moves_something_and_its_derivative_is_finite(effect, name):
    log = record(effect.axes[0], held=False)
    c = next(c for c in effect.coefficients if c.name == name)
    values = effect.starts()
    at = c.start if c.low < c.start < c.high else c.start + 2.0 * c.step
    high, low = (outputs(effect, values | {name: at + s * c.step}, log) for s in (1.0, -1.0))
    slopes = [(high[k] - low[k]) / (2.0 * c.step) for k in high]
    assert all(np.isfinite(s).all() for s in slopes)
    assert max(float(np.abs(s).max()) for s in slopes) > 1e-6


@pytest.mark.parametrize("effect", [e for e in EFFECTS.values() if e.fin], ids=lambda e: e.name)
def test_the_fin_path_of_a_held_command_stays_near_the_commands_range(effect):
    log = record(effect.axes[0])
    path = effect.fin(log.commanded, effect.starts(), log)
    assert np.abs(path.mean).max() <= np.abs(log.fin).max() * 1.1


@pytest.mark.parametrize("effect", [e for e in EFFECTS.values() if e.fin], ids=lambda e: e.name)
def test_a_path_cut_in_half_steps_keeps_its_area(effect):
    """The same command sampled twice as finely must turn the hull by the same amount."""
    coarse = record(effect.axes[0], held=False)
    time = np.sort(np.r_[coarse.time, 0.5 * (coarse.time[1:] + coarse.time[:-1])])
    fin = np.interp(time, coarse.time, coarse.fin)
    signals = {role: np.interp(time, coarse.time, values) for role, values in coarse.signals.items()}
    fine = replace(coarse, time=time, fin=fin, signals=signals)
    values = effect.starts()
    area = effect.fin(coarse.commanded, values, coarse).mean * coarse.steps
    halves = effect.fin(fine.commanded, values, fine).mean * fine.steps
    np.testing.assert_allclose(area, halves.reshape(-1, 2).sum(axis=1), atol=2e-7)


@pytest.mark.parametrize(
    ("effect", "form"),
    [(e, f) for e in EFFECTS.values() if e.slope for f in (None, *e.variants)],
    ids=lambda v: getattr(v, "name", "form"),
)
def test_an_effects_slopes_are_those_of_its_moment(effect, form):
    log, coefficients = record(effect.axes[0]), effect.coefficients + (form.coefficients if form else ())
    values = {c.name: max(c.low, c.start) + 0.1 * (min(c.high, 1.0 + c.start) - c.start) for c in coefficients}
    values |= {"sweep": 0.004} if "sweep" in values else {}
    for c in coefficients:
        above, below = (effect.terms(values | {c.name: values[c.name] + s}, log) for s in (1e-5, -1e-5))
        assert {n for n in Terms.__dataclass_fields__ if getattr(above, n) is not None} == {"moment"}
        slope = effect.slope(c.name, values, log)
        assert np.abs(slope).max() > 0.0
        np.testing.assert_allclose(slope, (above.moment - below.moment) / 2e-5, atol=1e-6 * np.abs(slope).max())


@pytest.mark.parametrize("effect", [e for e in EFFECTS.values() if e.measure], ids=lambda e: e.name)
def test_a_sensor_effect_returns_motion(effect):
    log = record(effect.axes[0])
    assert isinstance(effect.measure(motion_of(log), effect.starts(), log), Motion)


@pytest.mark.parametrize("effect", [e for e in EFFECTS.values() if e.sensor_jvp], ids=lambda e: e.name)
def test_moves_carried_through_a_sensor_are_the_slopes_of_what_it_shows(effect):
    log, rng = record(effect.axes[0]), np.random.default_rng(4)
    motion, moves = motion_of(log), rng.standard_normal((3, 2, len(log)))
    values = {c.name: c.start + 0.1 * (c.high - c.start) for c in effect.all_coefficients}
    for carried, move in zip(effect.sensor_jvp(moves, motion, values, log), moves, strict=True):
        ends = [effect.measure(Motion(motion.angle + s * move[0], motion.rate + s * move[1]), values, log) for s in (1e-5, -1e-5)]
        slope = np.stack([ends[0].angle - ends[1].angle, ends[0].rate - ends[1].rate]) / 2e-5
        np.testing.assert_allclose(carried, slope, atol=1e-6)


@pytest.mark.parametrize("effect", [e for e in EFFECTS.values() if e.sensor_slope], ids=lambda e: e.name)
def test_the_slope_by_a_sensors_coefficient_is_that_of_what_it_shows(effect):
    log = record(effect.axes[0])
    motion, values = motion_of(log), {c.name: c.start + 0.1 * (c.high - c.start) for c in effect.all_coefficients}
    for name in effect.names:
        ends = [effect.measure(motion, values | {name: values[name] + s}, log) for s in (1e-5, -1e-5)]
        slope = np.stack([ends[0].angle - ends[1].angle, ends[0].rate - ends[1].rate]) / 2e-5
        np.testing.assert_allclose(effect.sensor_slope(name, motion, values, log), slope, atol=1e-9)


def test_a_fin_path_has_its_mean_between_its_ends():
    assert FinPath(np.array([0.0]), np.array([0.2])).mean == pytest.approx(0.1)
