"""Other forms of the effects: the textbook's at their neutral numbers, and each against its equation written out."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fieldsid.dynamics.assemble import Base, assemble, integrate_record, measured, with_moments
from fieldsid.dynamics.free_run import command_record
from fieldsid.effects import all_effects, pick_effect
from fieldsid.models.axis import Axis
from fieldsid.models.effect import Motion, as_fitted, with_variant
from fieldsid.models.fin_path import FinPath
from fieldsid.models.hull import Core
from fieldsid.models.record import part_of

NEUTRAL = {
    "stall_blend": 0.0, "deadband_blend": 0.0, "deadband_jump": 0.0, "levelling": 0.0, "ramp": 0.0,
    "deviation_sin2": 0.0, "deviation_cos2": 0.0, "cross_quadratic": 0.0, "cross_fin": 0.0, "cross_exponent": 1.0,
    "second_period": 5.0, "second_sin": 0.0, "second_cos": 0.0, "sweep": 0.0, "release": 1.0, "rate_power": 2.0,
    "falling_share": 1.0, "lag_ratio": 1.0, "off_middle": 0.0, "lift_bend": 0.0, "prop_square": 0.0, "build_up": 0.0,
    "roll_rate_moment": 0.0, "scale_cubic": 0.0, "clock_drift": 0.0, "depth_square": 0.0, "current_sin2": 0.0,
    "current_cos2": 0.0, "current_turn": 0.0, "stall_drop": 0.0, "munk_exponent": 2.0, "prop_trimmed": 0.0,
    "scale_side": 0.0, "bias_drift": 0.0, "roll_cubic": 0.0, "speed_power": 2.0, "current_power": 0.0,
    "strip_drag": 0.0, "strip_inertia": 0.04, "strip_munk": 1.0, "damping_share": 1.0,
    "drift_power": 0.0,
}  # fmt: skip
"""Numbers at which a form is the textbook's; a servo's inertia has none within its bounds."""
GENTLE = {"cross_quadratic": 4.0, "cross_fin": 0.5, "strip_drag": 4.0, "strip_munk": 0.5}
"""Other numbers of those whose bounds are far wider than any hull's."""


def record(*, faster=False):
    time = np.arange(0.0, 20.0, 0.05)
    fin = np.interp(time, [0.0, 4.0, 9.0, 15.0, 20.0], [0.0, 0.3, -0.25, 0.1, 0.0])
    signals = {"thrust": 2.0 + np.sin(time), "roll": 0.2 * np.sin(1.3 * time), "depth": 3.0 + np.cos(0.4 * time)}
    if faster:
        signals["surge"] = 1.4 + 0.3 * np.sin(0.5 * time)
    return command_record(Axis.YAW, time, fin, speed=1.4, signals=signals)


def shown(effect, values, log):
    """What the sensors show of a hull with the effect at 1.7 times its reference speed, (2, n)."""
    start = np.array([0.1, -0.05, 0.01])
    arrays = assemble(log, [effect], Base(1.2, 0.3, -1.5, 0.01), values, 1.7)
    out = integrate_record(log, with_moments(log, arrays, [effect], values, start), start)
    motion = measured(Motion(out[:, 0], out[:, 1]), log, [effect], values)
    return np.stack([motion.angle, motion.rate])


FORMS = [(n, i) for n, e in sorted(all_effects().items()) for i in range(len(e.variants))]


@pytest.mark.parametrize(("name", "which"), FORMS)
def test_a_form_is_fitted_under_the_effects_own_name(name, which):
    effect = pick_effect(name)
    shaped = with_variant(effect, effect.variants[which])
    assert (shaped.name, shaped.variants) == (name, ())
    values = effect.starts() | {c.name: c.start for c in effect.variants[which].coefficients}
    values = {n: v for n, v in values.items() if n not in effect.variants[which].without}
    assert as_fitted(effect, values).coefficients == shaped.coefficients
    assert as_fitted(effect, effect.starts()) is effect


HAVE_NEUTRAL = [(n, i) for n, i in FORMS if n != "servo_lag" and not pick_effect(n).variants[i].without]


@pytest.mark.parametrize(("name", "which"), HAVE_NEUTRAL)
def test_a_form_is_the_textbooks_at_its_neutral_numbers_and_not_elsewhere(name, which):
    effect, log = pick_effect(name), record(faster=True)
    form = effect.variants[which]
    shaped = with_variant(effect, form)
    values = effect.starts() | {c.name: NEUTRAL[c.name] for c in form.coefficients}
    np.testing.assert_allclose(shown(shaped, values, log), shown(effect, effect.starts(), log), atol=1e-6)
    other = effect.starts() | {c.name: GENTLE.get(c.name, c.low + 0.45 * (c.high - c.low)) for c in form.coefficients}
    assert np.abs(shown(shaped, other, log) - shown(effect, effect.starts(), log)).max() > 1e-4


@pytest.mark.parametrize(("lag", "share"), [(0.3, 0.5), (0.3, 0.25), (0.3, 0.1), (0.08, 0.5), (1.0, 2.0)])
def test_a_servo_of_second_order_is_its_equation_integrated_finely(lag, share):
    rng = np.random.default_rng(5)
    start = 0.2 * rng.standard_normal(12)
    path = FinPath(start, start + 0.02 * rng.standard_normal(12))
    log, inertia, fine = record(), share * lag * lag, 4000
    steps = log.steps[:12]
    out = np.empty((12, 4))
    from fieldsid.effects.servo_lag import swung

    swung(steps, path.start, path.end, lag, inertia, out)
    fin, speed = float(path.start[0]), 0.0
    for i, h in enumerate(steps):
        time, dt = np.linspace(0.0, h, fine + 1), h / fine
        track = np.empty(fine + 1)
        track[0] = fin
        slope = (path.end[i] - path.start[i]) / h
        for k in range(fine):
            wanted = path.start[i] + slope * (time[k] + 0.5 * dt)
            middle, middle_speed = fin + 0.5 * dt * speed, speed + 0.5 * dt * (wanted - fin - lag * speed) / inertia
            fin += dt * middle_speed
            speed += dt * (wanted - middle - lag * middle_speed) / inertia
            track[k + 1] = fin
        mean = np.trapezoid(track, time) / h
        half = 6.0 * np.trapezoid(track * (time - 0.5 * h), time) / h**2
        np.testing.assert_allclose(out[i], [mean - half, mean + half, track[0], track[-1]], atol=2e-6)


@pytest.mark.parametrize("sweep", [0.0, 0.012, -0.02])
def test_the_frequency_of_a_swept_wave_is_the_one_declared_and_the_period_its_mean(sweep):
    log, wave = record(), pick_effect("wave")
    values = {"period": 4.0, "amplitude": 0.3, "phase": 0.2, "sweep": sweep}
    fine = np.linspace(0.0, log.time[-1], 20001)
    frequency = (1.0 + sweep * (fine - 0.5 * fine[-1])) / 4.0
    phase = 0.2 + 2.0 * np.pi * np.concatenate([[0.0], np.cumsum(0.5 * (frequency[1:] + frequency[:-1]) * np.diff(fine))])
    expected = 0.3 * np.sin(np.interp(log.time, fine, phase))
    np.testing.assert_allclose(wave.terms(values, log).moment, expected, atol=1e-6)
    assert np.mean(frequency) == pytest.approx(0.25)


def test_a_second_component_is_suggested_at_the_period_that_the_first_has_left():
    log, wave = record(), pick_effect("wave")
    second = next(f for f in wave.variants if f.initial_guesses is not None)
    left = np.stack([np.zeros(len(log)), 0.02 * np.cos(2.0 * np.pi * log.time / 3.1)])
    seen = replace(log, angle_ok=np.ones(len(log), bool), rate_ok=np.ones(len(log), bool))
    assert min(abs(p["second_period"] - 3.1) for p in second.initial_guesses([seen], [left])) < 0.2


@pytest.mark.parametrize(("jump", "release"), [(1.0, 0.5), (0.6, 0.7), (0.0, 1.0)])
def test_a_fin_that_stays_out_is_its_rule_applied_finely(jump, release):
    rng, width = np.random.default_rng(8), 0.08
    knots = np.concatenate([[0.0], 0.2 * rng.standard_normal(60)])
    start, end = knots[:-1], knots[1:]
    steps = rng.random(60) < 0.4
    end = np.where(steps, start, end)
    values = {"width": width, "deadband_jump": jump, "release": release}
    path = pick_effect("deadband").fin(FinPath(start, end), values, part_of(record(), slice(0, 61)))
    moves = False
    for i in range(start.size):
        fine = start[i] + (end[i] - start[i]) * (np.arange(4000) + 0.5) / 4000
        shown = np.zeros(4000)
        for k, d in enumerate(fine):
            moves = abs(d) > width or (moves and abs(d) >= release * width)
            shown[k] = np.sign(d) * (abs(d) - (1.0 - jump) * width) if moves else 0.0
        assert path.mean[i] == pytest.approx(shown.mean(), abs=2e-4)
        assert path.end[i] - path.start[i] == pytest.approx(shown[-1] - shown[0], abs=3e-4)


def test_a_gyros_other_forms_are_their_equations_and_carry_small_moves_as_they_move():
    log, rate = record(), np.linspace(-0.4, 0.5, len(record()))
    motion, moves = Motion(np.zeros(rate.size), rate), np.ones((1, 2, rate.size))
    sided = pick_effect("gyro_scale")
    values = {"scale_error": 0.1, "scale_side": -0.3}
    np.testing.assert_allclose(sided.measure(motion, values, log).rate, np.where(rate > 0, 0.8, 1.4) * rate)
    np.testing.assert_allclose(sided.sensor_jvp(moves, motion, values, log)[0, 1], np.where(rate > 0, 0.8, 1.4))
    drifting = pick_effect("gyro_bias").measure(motion, {"bias": 0.01, "bias_drift": 0.06}, log)
    np.testing.assert_allclose(drifting.rate - rate, 0.01 + 0.001 * (log.time - log.time[0]))


def test_moments_of_roll_speed_and_current_go_with_the_powers_that_their_forms_say():
    log = record()
    roll = pick_effect("roll_coupling").terms({"roll_moment": 0.5, "roll_cubic": -2.0}, log).moment
    np.testing.assert_allclose(roll, 0.5 * log["roll"] - 2.0 * log["roll"] ** 3)
    speed = pick_effect("speed_moment").terms({"speed_moment": 0.02, "speed_power": 1.3}, log).moment
    np.testing.assert_allclose(speed, 0.02 * 1.4**1.3)
    core = pick_effect("current").core({"current_sin": 0.1, "current_cos": -0.2, "current_power": 1.5}, 2.0)
    assert (core.heading_sin, core.heading_cos) == pytest.approx((0.1 * 2.0**1.5, -0.2 * 2.0**1.5))


def test_a_fins_drift_goes_with_the_power_of_the_speed_that_its_form_says():
    log, drift = record(faster=True), pick_effect("trim_drift")
    found = drift.terms({"drift": 0.6, "drift_power": 1.7}, log).moment
    np.testing.assert_allclose(found, 0.01 * log.time * log["surge"] ** 1.7)


def test_a_speed_over_ground_is_taken_through_the_water_where_a_heading_is_measured():
    log, current = record(faster=True), pick_effect("current")
    values = {"current_north": 0.3, "current_east": -0.2}
    plain = current.terms(values, log)
    assert (plain.authority_factor, plain.damping_factor, plain.cross_factor) == (None, None, None)
    heading, seen = np.linspace(0.0, 5.0, len(log)), np.ones(len(log), bool)
    seen[40:60] = False
    turned = replace(log, angle=np.where(seen, heading, np.nan), angle_ok=seen)
    past = log["surge"] - 0.3 * np.cos(heading) + 0.2 * np.sin(heading)
    run = np.median(past) / log.speed
    terms = current.terms(values, turned)
    for part, power in (("authority_factor", 2), ("damping_factor", 1), ("cross_factor", 1)):
        np.testing.assert_allclose(getattr(terms, part), run**power)
    speed_varying, shares = pick_effect("speed_varying"), {"speed_share": 0.8, "damping_share": 0.3}
    both = current.terms(values | shares, turned).combined_with(speed_varying.terms(values | shares, turned))
    water = past / (run * log.speed)  # over the run's own through the water, at which its parameters hold
    np.testing.assert_allclose(both.authority_factor, (run * water**0.8) ** 2)
    np.testing.assert_allclose(both.damping_factor, run * water**0.3)
    np.testing.assert_allclose(both.cross_factor, run * water**0.8)
    assert terms.moment is None
    assert current.core(values, 1.3) == Core()
