"""Gains by the paper's formula, slowed by lag and delay; margins against python-control; steps against scipy; the file."""

from __future__ import annotations

from dataclasses import replace

import control
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from truth.paper import PITCH, YAW

from fieldsid.effects import add_effects, forget_effects
from fieldsid.errors import ArtifactError, ModelError, UsageError
from fieldsid.models.axis import Axis
from fieldsid.models.effect import Coefficient, Effect, Stage, Terms
from fieldsid.models.hull import CONSTANTS, Core
from fieldsid.models.model import Model, Noise, save_model
from fieldsid.models.speed_law import SpeedLaw
from fieldsid.plant.laws.axis_laws import save_laws
from fieldsid.plant.parameter_source import ParameterSource, load_parameter_source
from fieldsid.schedule.controller import KINDS, Gains, closed_poles, least_damping, margins
from fieldsid.schedule.flown.closed_loop_kernel import close_loop
from fieldsid.schedule.flown.jit_warmup import compile_loops
from fieldsid.schedule.flown.response import (
    LIMIT_CYCLE_SHARE,
    Flight,
    Pace,
    disturbance_moment,
    fly,
    overshoot,
    settling,
    steady_error,
    swing,
)
from fieldsid.schedule.linear_plant import FinLimits, LinearPlant, not_counted, plants_at
from fieldsid.schedule.make import design_schedule
from fieldsid.schedule.record import load_schedule, save_schedule
from fieldsid.schedule.search.design import design_gains, row_of
from fieldsid.schedule.verdict import against_constant
from fieldsid.schedule.verify import checked_speeds, verify_schedule
from fieldsid.schedule.wish import Wish

EVERY_OTHER = [r.speed for r in YAW[::2]]
"""Speeds of the paper's first, middle and last row."""


def stepped(plant, row, *, reference, seconds, offset=0.0):
    """A step of the reference flown under one row's gains."""
    return fly(plant, [row], Flight(seconds, reference=reference, offset=offset))


def by_python_control(plant, gains):
    """Phase (deg), gain (dB) and delay (s) margin of the estimate, by python-control from the frequency response."""
    omega = np.geomspace(1e-3, 200.0, 500)
    response = plant.one().response(omega)[0] * gains.response(omega)
    gain, phase, _, _, crossing, _ = control.stability_margins(control.FrequencyResponseData(response, omega, smooth=True))
    delay = np.radians(phase) / crossing if np.isfinite(crossing) and crossing > 0 else np.inf
    return phase, 20 * np.log10(gain) if gain > 1.0 else np.inf, delay


def source_of(folder, rows, names):
    path = folder / "table.csv"
    text = [",".join(("speed_m_s", *names))] + [",".join(str(getattr(r, n)) for n in ("speed", *names)) for r in rows]
    path.write_text("\n".join(text) + "\n")
    return load_parameter_source([path])


@pytest.fixture
def yaw(tmp_path):
    return source_of(tmp_path, YAW, ("a22", "b2", "C0"))


@pytest.fixture
def pitch(tmp_path):
    return source_of(tmp_path, PITCH, ("c22", "c23", "d2", "Cb"))


POWERS = {
    "cross_damping": 1.0, "cross_rate": 2.0, "cross_fin": 3.0, "cross_quadratic": -1.0, "strip_force": 1.0, "strip_flow": -1.0,
}  # fmt: skip


def plant(speed=1.5, count=1, **own):
    base = {
        "damping": 1.2,
        "stiffness": 0.0,
        "authority": -1.6,
        "offset": 0.0,
        "lag": 0.0,
        "delay": 0.0,
        "fin_rate": np.inf,
    }
    core = Core(**({"cross_damping": 1.0} | {k: v for k, v in own.items() if k in CONSTANTS}))
    arrays = {k: np.broadcast_to(np.asarray(v, dtype=float), count).copy() for k, v in (base | own).items() if k not in CONSTANTS}
    powers = [1.0, 2.0, *(POWERS.get(name, 0.0) for name in CONSTANTS)]
    arrays |= {"core": np.tile(np.array(core), (count, 1)), "powers": np.tile(powers, (count, 1))}
    return LinearPlant(Axis.YAW, speed, **arrays, speed_loss=np.zeros((count, 3)))


def model_at(folder, speed, effects=("servo_lag",), **values):
    own = {"a22": 0.8 * speed, "b2": -0.6 * speed**2, "C0": 0.01} | ({"lag": 0.35} if "servo_lag" in effects else {}) | values
    covariance = np.diag([(0.02 * v) ** 2 for v in own.values()])
    trained = {"speed_low": speed, "speed_high": speed, "fin_max": 0.26}
    model = Model(Axis.YAW, effects, own, {}, tuple(own), covariance, SpeedLaw(speed), Noise(0.005, 0.005), trained)
    return save_model(model, folder / f"m{speed}.yaml", force=True)


@pytest.fixture
def lagging(tmp_path):
    """Files of two models with a slow servo, and the fit file made from them."""
    paths = [model_at(tmp_path, speed) for speed in (1.0, 1.8)]
    return paths, save_laws(load_parameter_source(paths).laws, tmp_path / "law.yaml", models=paths)


def test_a_fit_file_gives_the_gains_that_its_models_give(lagging):
    paths, law = lagging
    of_models, of_law = (design_schedule(load_parameter_source(given), 0.26) for given in (paths, [law]))
    assert of_law.actuator["lag_s"] == 0.35
    assert of_law.rows == of_models.rows
    assert all(r.slowed < 1.0 for r in of_law.rows)
    checked = verify_schedule(of_law, load_parameter_source([law]), draws=8)
    assert checked.spread
    assert checked.worst == verify_schedule(of_models, load_parameter_source(paths), draws=8).worst


def test_beyond_the_points_a_fit_files_laws_go_on_and_ones_own_hold_and_the_effects_stay(lagging):
    paths, law = lagging
    source, own = load_parameter_source([law]), load_parameter_source(paths, laws=["b2=-5"])
    (plant, share), *_ = plants_at(source, 3.0, FinLimits(), 30, 1)
    (edge, _), *_ = plants_at(source, 1.8, FinLimits(), 30, 1)
    assert share == 1.0
    gone = {n: source.laws.at(3.0)[n] - source.laws.at(1.8)[n] for n in ("a22", "b2")}
    assert plant.damping[0] == pytest.approx(edge.damping[0] + gone["a22"])
    assert plant.authority[0] == pytest.approx(edge.authority[0] + gone["b2"])
    assert plant.lag[0] == 0.35
    assert np.std(plant.damping) > 0.0
    assert plants_at(own, 1.0, FinLimits(), 30, 1)[0][0].authority[0] == pytest.approx(-5.0)
    with pytest.raises(UsageError, match="crosses zero before 3 m/s"):
        plants_at(load_parameter_source([law], laws=["b2=-2,1"]), 3.0, FinLimits(), 30, 1)


def test_gains_without_the_servo_are_verified_on_models_with_it(tmp_path):
    quick = design_schedule(load_parameter_source([model_at(tmp_path, u, effects=()) for u in (1.0, 1.8)]), 0.26)
    quick = load_schedule(save_schedule(quick, tmp_path / "gains.yaml"))
    slow = [model_at(tmp_path, speed, lag=1.5) for speed in (1.0, 1.8)]
    assert quick.actuator["lag_s"] == 0.0
    assert verify_schedule(quick, load_parameter_source(slow), draws=8).worst["phase_margin_deg"] < 45.0
    stated = design_schedule(load_parameter_source(slow), 0.26, limits=FinLimits(lag=0.0))
    assert verify_schedule(stated, load_parameter_source(slow), draws=8).worst["phase_margin_deg"] > 45.0


def test_effects_that_a_linear_plant_does_not_hold_are_named(tmp_path):
    path = model_at(tmp_path, 1.4, effects=("servo_lag", "backlash", "quadratic_damping"), gap=0.02, quadratic=1.0)
    source = load_parameter_source([path])
    assert not_counted(source.models) == {"backlash": ("gap",)}
    assert design_schedule(source, 0.26).provenance["effects_not_counted"] == ["backlash"]
    inert = load_parameter_source([model_at(tmp_path, 1.4, inertia_share=0.5)])
    assert not_counted(inert.models) == {"servo_lag": ("inertia_share",)}, "its lag is: it stands beside"
    assert not_counted(load_parameter_source([model_at(tmp_path, 1.4)]).models) == {}


def test_a_factor_that_follows_the_thrust_is_in_the_gains_of_each_speed_and_a_fin_that_does_is_named(tmp_path):
    def terms(values, record):
        return Terms(authority_factor=1.0 + values["washed"] * record["thrust"], damping=0.1 * record["thrust"])

    wash = Effect(
        name="wash", says="", stage=Stage.HYDRODYNAMICS, axes=(Axis.YAW,), equation="", needs=("thrust",), terms=terms,
        coefficients=(Coefficient("washed", "1", -5.0, 5.0, 0.2),), telltale="", excited_by=(), mistaken_for=(), source="",
    )  # fmt: skip
    own = Coefficient("held", "1", 0.0, 1.0, 0.2)
    fin = replace(wash, stage=Stage.ACTUATOR, terms=None, fin=lambda path, *_: path, coefficients=(own,))
    values = {"a22": 1.5, "b2": -2.0, "C0": 0.02, "washed": 0.2}
    trained = {"thrust_at_1_m_s": 1.0, "thrust_exponent": 2.0}
    model = Model(Axis.YAW, ("wash",), values, {}, tuple(values), np.zeros((4, 4)), SpeedLaw(1.0), Noise(0.005, 0.005), trained)
    try:
        add_effects([wash])
        source = load_parameter_source([save_model(model, tmp_path / "m.yaml")])
        (plant, _), *_ = plants_at(source, 2.0, FinLimits(), 1, 1)
        assert plant.authority[0] == pytest.approx(-2.0 * 4.0 * (1.0 + 0.2 * 4.0))
        assert plant.damping[0] == pytest.approx(1.5 * 2.0**model.law.damping_exponent + 0.1 * 4.0)
        assert not_counted(source.models) == {}
        add_effects([fin])
        assert not_counted([replace(model, values={**model.base, "held": 0.2})]) == {"wash": ("held",)}
    finally:
        forget_effects()


@pytest.mark.parametrize("zeta", [0.6, 0.7071, 0.9])
def test_yaw_gain_and_feed_forward_are_the_papers(yaw, zeta):
    schedule = design_schedule(yaw, 0.26, wish=Wish(damping=zeta))
    for row, truth in zip(schedule.rows, YAW, strict=True):
        assert row.gains.kp == pytest.approx(truth.a22**2 / (4 * zeta**2 * truth.b2), rel=1e-9)
        assert row.feed_forward == pytest.approx(-truth.C0 / truth.b2)
        assert row.slowed == 1.0
        assert row.supported


def test_poles_of_the_papers_gain_have_the_chosen_damping():
    found = row_of(design_gains(plant(), Wish(damping=0.7), 0.26), depth=False, supported=True)
    assert least_damping(plant(), found.gains) == pytest.approx(0.7, abs=1e-6)


def test_lag_and_delay_slow_the_gain_until_damping_and_margin_hold():
    wish = Wish(damping=0.7, phase_margin_deg=50.0)
    late = plant(lag=0.3, delay=0.4)
    found = row_of(design_gains(late, wish, 0.26), depth=False, supported=True)
    assert found.slowed < 0.95
    assert least_damping(late, found.gains) >= 0.7 - 1e-3
    assert margins(late, found.gains).phase_deg[0] >= 50.0 - 0.1


@pytest.mark.parametrize("kind", [pytest.param(k, marks=pytest.mark.slow) if k in ("pd", "pid") else k for k in KINDS])
def test_every_controller_is_stable_and_keeps_its_margin(kind, yaw, pitch):
    for source, rows in ((yaw, YAW), (pitch, PITCH)):
        ends = [r.speed for r in rows[::4]]
        schedule = design_schedule(source, 0.26, speeds=ends, wish=Wish(kind=kind), limits=FinLimits(0.2, 0.1, 0.6))
        assert all(r.phase_margin_deg >= 44.0 for r in schedule.rows)
        assert all(r.gain_margin_db > 6.0 for r in schedule.rows)


def test_integral_control_needs_no_feed_forward(yaw):
    (row,) = design_schedule(yaw, 0.26, speeds=[1.63], wish=Wish(kind="pi")).rows
    late = stepped(plants_at(yaw, 1.63, FinLimits(), 1, 0)[0][0], row, reference=0.0, seconds=120.0, offset=0.03)
    assert steady_error(late.angle, 0.0)[0] == pytest.approx(0.0, abs=2e-3)


@pytest.mark.parametrize(
    "own",
    [
        {},
        {"lag": 0.2},
        {"lag": 0.2, "delay": 0.3},
        {"cross_rate": -0.5, "cross_damping": 0.8, "cross_fin": -0.3},
        {"cross_rate": -0.5, "cross_damping": 0.8, "cross_fin": -0.3, "cross_share": 0.4},
        {"stiffness": 0.4},
    ],
)
@pytest.mark.parametrize("gains", [Gains(-0.5), Gains(-0.6, -0.05, -0.2)], ids=["p", "pid"])
def test_margins_agree_with_python_control(own, gains):
    ours = margins(plant(**own), gains)
    phase, gain, delay = by_python_control(plant(**own), gains)
    assert ours.phase_deg[0] == pytest.approx(phase, abs=0.3)
    assert ours.delay_s[0] == pytest.approx(delay, rel=0.01)
    assert ours.gain_db[0] == pytest.approx(gain, abs=0.1) or (ours.gain_db[0] == gain == np.inf)


def test_margins_of_a_known_loop_are_those_of_the_textbook():
    own = plant(damping=1.0, authority=1.0, lag=0.5)
    gains = Gains(2.0)
    gain, phase, *_ = control.margin(control.tf([2.0], [0.5, 1.5, 1.0, 0.0]))
    assert margins(own, gains).phase_deg[0] == pytest.approx(phase, abs=0.05)
    assert margins(own, gains).gain_db[0] == pytest.approx(20 * np.log10(gain), abs=0.02)


STRIPS = {"cross_share": 0.6, "strip_moment": 2.5, "strip_force": 3.0, "strip_flow": 1.1}


@pytest.mark.parametrize("strips", [{}, STRIPS], ids=["sway", "strips"])
@pytest.mark.parametrize("power", [2.0, 1.6, 3.0])
def test_step_agrees_with_an_ode_solver(power, strips):
    drags = {"quadratic": 0.8, "beyond_square": power - 2.0}
    own = plant(lag=0.25, **drags, **strips, cross_rate=-0.4, cross_damping=0.7, cross_quadratic=3.0, offset=0.01)
    xi = (np.arange(400) + 0.5) / 400 - 0.5
    row = replace(design_schedule_row(), gains=Gains(-0.6, 0.0, -0.2), feed_forward=-0.01, fin_limit=10.0)
    ours = stepped(own, row, reference=0.3, seconds=15.0)

    def slope(_t, s):
        y, p, x, fin = s
        command = -0.6 * (0.3 - y) + 0.2 * p - 0.01
        flow = strips.get("strip_flow", 0.0) * x + xi * p
        sway = -(0.7 + 3.0 * abs(x)) * x + 0.4 * p - strips.get("strip_force", 0.0) * np.mean(flow * np.abs(flow))
        drag = 0.8 * np.sign(p) * 0.2**2 * (abs(p) / 0.2) ** power
        drag += strips.get("strip_moment", 0.0) * 32.0 * np.mean(flow * np.abs(flow) * xi)
        return [p, -1.2 * p - 1.6 * (fin + 0.01) - drag + strips.get("cross_share", 1.0) * x, sway, (command - fin) / 0.25]

    theirs = solve_ivp(slope, (0.0, 15.0), [0.0, 0.0, 0.0, -0.01], t_eval=ours.time, rtol=1e-9, atol=1e-11)
    assert np.max(np.abs(ours.angle[:, 0] - theirs.y[0])) < 2e-3


def design_schedule_row():
    from fieldsid.schedule.record import Row

    return Row(1.5, Gains(-0.5), 0.0, 0.0, 0.26, 0.0, True, 1.0, 60.0, np.inf, 1.0)


def test_fin_limit_rate_and_delay_are_kept():
    row = replace(design_schedule_row(), gains=Gains(-3.0), fin_limit=0.2)
    own = plant(fin_rate=0.4, delay=0.5)
    steps = stepped(own, row, reference=0.5, seconds=10.0)
    assert np.max(np.abs(steps.fin)) <= 0.2 + 1e-12
    assert np.all(steps.angle[steps.time < 0.5, 0] == 0.0)
    assert steps.angle[steps.time > 2.0, 0][0] != 0.0


def test_overshoot_and_settling_of_a_known_second_order_step():
    row = replace(design_schedule_row(), gains=Gains(-1.0 / 1.6), fin_limit=10.0)
    zeta = 1.2 / 2.0
    steps = stepped(plant(), row, reference=1.0, seconds=20.0)
    assert overshoot(steps.angle, 1.0)[0] == pytest.approx(np.exp(-np.pi * zeta / np.sqrt(1 - zeta**2)), abs=8e-3)
    assert settling(steps.time, steps.angle, 1.0)[0] == pytest.approx(5.2, abs=0.4)


def test_feed_forward_removes_the_error_of_a_bent_fin_and_its_absence_leaves_it():
    row = design_schedule_row()
    known = replace(row, feed_forward=-0.05)
    gone = stepped(plant(), known, reference=0.0, seconds=40.0, offset=0.05)
    left = stepped(plant(), row, reference=0.0, seconds=40.0, offset=0.05)
    assert steady_error(gone.angle, 0.0)[0] == pytest.approx(0.0, abs=1e-4)
    assert steady_error(left.angle, 0.0)[0] == pytest.approx(0.05 / 0.5, rel=0.01)


def test_depth_through_pitch_settles_without_overshoot_to_speak_of(pitch):
    schedule = design_schedule(pitch, 0.26, wish=Wish(kind="pd"), depth=True)
    assert schedule.provenance["law"].endswith("; ref = depth_gain (depth - wanted depth), limited to +/- 0.349 rad")
    own = plants_at(pitch, 1.67, FinLimits(0.2), 1, 0)[0][0]
    steps = fly(own, schedule.rows[2:3], Flight(120.0, depth=2.0, pitch_limit=0.35))
    assert steps.depth[-1, 0] == pytest.approx(2.0, abs=0.1)
    assert overshoot(steps.depth, 2.0)[0] < 0.08
    assert settling(steps.time, steps.depth, 2.0)[0] < 20.0


def test_the_depth_loop_keeps_its_phase_margin_by_python_control():
    own = replace(plant(stiffness=0.4, lag=0.3, delay=0.0), axis=Axis.PITCH)
    found = row_of(design_gains(own, Wish(kind="pd", step=0.175), 0.26), depth=True, supported=True)
    kp, kd, ref = found.gains.kp, found.gains.kd, found.reference_gain
    pitch_loop = control.tf([-1.6 * (kp + ref)], [0.3, 1.0 + 0.3 * 1.2, 1.2 + 0.3 * 0.4 - 1.6 * kd, 0.4 - 1.6 * kp])
    _, phase, *_ = control.margin(pitch_loop * control.tf([found.depth_gain * own.speed], [1.0, 0.0]))
    assert phase == pytest.approx(60.0, abs=1.0)


def slowest(checked):
    """The longest settling of the standard step over speeds and 95 % of the draws: with the schedule, with the constant gain."""
    return (max(c.settling_most for c in part) for part in (checked.scheduled, checked.constant))


def test_verification_covers_knots_and_between_and_beats_the_best_constant_gain(yaw):
    schedule = design_schedule(yaw, 0.26, speeds=EVERY_OTHER, limits=FinLimits(lag=0.2))
    checked = verify_schedule(schedule, yaw, draws=8)
    assert [c.knot for c in checked.scheduled] == [True, False] * 2 + [True]
    assert len(checked_speeds(schedule)) == 5
    assert max(c.overshoot for c in checked.scheduled) < 0.1
    own, one = slowest(checked)
    assert own < 0.7 * one
    assert against_constant(checked).startswith("against the best constant gain")
    assert all(c.phase_least_deg <= c.phase_deg + 0.5 for c in checked.scheduled)
    assert all(abs(c.bent_error) < 0.1 * abs(c.bent_error_unknown) for c in checked.scheduled)
    assert all(0.6 * c.speed < c.speed_least < 0.995 * c.speed for c in checked.scheduled)


def test_where_one_constant_gain_is_better_it_is_said(yaw):
    slow = design_schedule(yaw, 0.26, speeds=EVERY_OTHER, wish=Wish(kind="pd"))
    rows = [replace(r, gains=r.gains.times(0.2) if i else r.gains) for i, r in enumerate(slow.rows)]
    checked = verify_schedule(replace(slow, rows=tuple(rows)), yaw, draws=4)
    own, one = slowest(checked)
    assert one < own
    assert checked.worse == slow.speeds[1:]
    said = against_constant(checked)
    own, one = (next(c for c in part if c.speed == slow.speeds[1]) for part in (checked.scheduled, checked.constant))
    assert said.startswith("one constant gain, kp ")
    assert f"is better at 1.63, 2.19 m/s: at 1.63 m/s a 20 deg step settles in {own.settling:.1f} s for " in said
    assert f"in {one.settling:.1f} s for " in said
    assert all(c.phase_least_deg >= 44.0 - 1.5 for c in checked.constant)


def test_schedule_comes_back_from_its_file_and_is_clamped_outside(yaw, tmp_path):
    schedule = design_schedule(yaw, 0.26, speeds=[0.8, 1.5, 2.0])
    again = load_schedule(save_schedule(schedule, tmp_path / "gains.yaml", inputs=yaw.paths))
    assert [r.gains.kp for r in again.rows] == pytest.approx([r.gains.kp for r in schedule.rows], rel=1e-5)
    assert [r.gain_margin_db for r in again.rows] == [r.gain_margin_db for r in schedule.rows]
    assert [r.supported for r in again.rows] == [False, True, True]
    assert again.at(5.0).gains == again.rows[-1].gains
    assert not again.at(5.0).supported
    middle = again.at(1.75).gains.kp
    assert middle == pytest.approx(0.5 * (again.rows[1].gains.kp + again.rows[2].gains.kp))
    assert again.provenance["outside_rows"].startswith("clamp")


def test_a_schedule_without_rows_is_refused(yaw, tmp_path):
    path = save_schedule(design_schedule(yaw, 0.26, speeds=[1.5]), tmp_path / "gains.yaml")
    path.write_text(path.read_text().split("rows:")[0] + "rows: []\nprovenance: {}\n")
    with pytest.raises(ArtifactError, match="not a complete schedule"):
        load_schedule(path)


@pytest.mark.parametrize(
    ("wish", "limit"),
    [(Wish(kind="bang"), 0.26), (Wish(damping=0.0), 0.26), (Wish(phase_margin_deg=89.0), 0.26), (Wish(), 0.0), (Wish(), 0.005)],
)
def test_a_wish_that_cannot_be_meant_is_refused(yaw, wish, limit):
    with pytest.raises(UsageError) as caught:
        design_schedule(yaw, limit, wish=wish)
    assert caught.value.hint


def test_depth_of_a_heading_schedule_is_refused(yaw):
    with pytest.raises(UsageError, match="depth"):
        design_schedule(yaw, 0.26, depth=True)


def test_an_unstable_plant_is_refused_for_p_and_held_by_pd():
    with pytest.raises(ModelError, match="unstable") as caught:
        design_gains(plant(damping=-0.2), Wish(), 0.26)
    assert caught.value.found == "damping -0.2 1/s, a deviation doubles every 3.5 s"
    assert "`--controller pd`" in caught.value.hint
    held = row_of(design_gains(plant(damping=-0.2), Wish(kind="pd"), 0.26), depth=False, supported=True)
    assert least_damping(plant(damping=-0.2), held.gains)[0] > 0.5
    assert held.draws_held == 1.0


def test_p_is_refused_where_half_of_the_draws_are_unstable_and_the_estimate_is_not():
    damping = np.where(np.arange(20) % 3 == 0, 0.5, -0.3)
    doubtful = plant(count=20, damping=damping)
    assert doubtful.growth == pytest.approx(-damping)
    with pytest.raises(ModelError, match="half of the draws") as caught:
        design_gains(doubtful, Wish(), 0.26)
    assert "unstable by 13 of 20 draws" in caught.value.found
    held = row_of(design_gains(doubtful, Wish(kind="pd"), 0.26), depth=False, supported=True)
    assert held.draws_held == 1.0
    assert margins(doubtful, held.gains).phase_deg.min() >= 22.5


def test_gains_serve_the_worst_of_the_draws_not_their_mean():
    strong = plant(count=20, authority=-1.6 * np.linspace(1.0, 6.0, 20), lag=0.3, delay=0.4)
    of_mean = row_of(design_gains(strong.one(), Wish(kind="pd"), 0.26), depth=False, supported=True)
    of_all = row_of(design_gains(strong, Wish(kind="pd"), 0.26), depth=False, supported=True)
    assert margins(strong, of_mean.gains).worst()[0] < 22.5
    assert margins(strong, of_all.gains).worst()[0] >= 22.5
    assert of_all.draws_held >= 0.95


def test_an_unstable_loop_has_no_margin_whatever_its_crossings_are():
    wild = plant(damping=-0.5)
    found = margins(wild, Gains(-0.5))
    assert least_damping(wild, Gains(-0.5))[0] < 0.0
    assert found.phase_deg[0] < 0.0
    assert (found.gain_db[0], found.delay_s[0]) == (0.0, 0.0)


def test_poles_of_all_draws_are_numpys_of_each():
    many = plant(count=3, damping=[1.2, -0.3, 2.0], lag=0.2, delay=0.1, cross_rate=-0.4, cross_fin=0.2)
    gains = Gains(-0.6, -0.05, -0.3)
    for i, poles in enumerate(closed_poles(many, gains)):
        a, b, t = float(many.damping[i]), -1.6, 0.1
        hull = np.polyadd(np.polymul([1.0, a, 0.0], [1.0, 1.0]), [-0.4, 0.0])
        pade = ([t * t / 12, -t / 2, 1.0], [t * t / 12, t / 2, 1.0])
        below = np.polymul(np.polymul(np.polymul(hull, [0.2, 1.0]), pade[1]), [1.0, 0.0])
        above = np.polymul(np.polymul([b, b + 0.2], pade[0]), [gains.kd, gains.kp, gains.ki])
        assert np.sort_complex(poles) == pytest.approx(np.sort_complex(np.roots(np.polyadd(below, above))), abs=1e-6)


def test_the_autopilots_latency_comes_on_top_of_the_models_delay(yaw):
    late, own = (plants_at(yaw, 1.5, FinLimits(delay=0.2, latency=t), 1, 0)[0][0] for t in (0.15, None))
    assert (late.delay[0], own.delay[0]) == (pytest.approx(0.35), 0.2)
    schedule = design_schedule(yaw, 0.26, speeds=[1.5], limits=FinLimits(latency=0.15))
    assert schedule.actuator["latency_s"] == schedule.stated["latency_s"] == 0.15


def test_speed_lost_in_the_turn_weakens_the_fin_and_the_gains_follow_it():
    own = plant(count=1)
    lossy = replace(own, speed_loss=np.array([[0.1, 0.0, 8.0]]))
    row = replace(design_schedule_row(), gains=Gains(-1.0, 0.0, -0.6))
    kept, lost = (stepped(p, row, reference=1.5, seconds=40.0) for p in (own, lossy))
    assert kept.speed.min() == kept.speed.max() == 1.5
    assert 1.0 < lost.speed.min() < 1.45
    assert settling(lost.time, lost.angle, 1.5)[0] > settling(kept.time, kept.angle, 1.5)[0]
    rows = [replace(row, speed=1.0, gains=Gains(-2.0, 0.0, -1.2)), row]
    followed = fly(lossy, rows, Flight(40.0, reference=1.5))
    assert np.max(np.abs(followed.angle - lost.angle)) > 0.01


def test_a_speed_lost_agrees_with_an_ode_solver():
    lossy = replace(plant(cross_rate=-0.4, cross_damping=0.7, quadratic=0.8), speed_loss=np.array([[0.2, 1.5, 4.0]]))
    row = replace(design_schedule_row(), gains=Gains(-0.6, 0.0, -0.2), fin_limit=10.0)
    ours = stepped(lossy, row, reference=0.8, seconds=15.0)

    def slope(_t, s):
        y, p, x, u = s
        f = u / 1.5
        fin = -0.6 * (0.8 - y) + 0.2 * p
        turning = -1.2 * f * p - 1.6 * f**2 * fin - 0.8 * p * abs(p) + x
        sway = -0.7 * f * x + 0.4 * f**2 * p
        return [p, turning, sway, 0.2 * (1.5**2 - u * u * (1.0 + 1.5 * fin**2) - 4.0 * p * p)]

    theirs = solve_ivp(slope, (0.0, 15.0), [0.0, 0.0, 0.0, 1.5], t_eval=ours.time, rtol=1e-9, atol=1e-11)
    assert np.max(np.abs(ours.angle[:, 0] - theirs.y[0])) < 2e-2
    assert np.max(np.abs(ours.speed[:, 0] - theirs.y[3])) < 1e-2


def test_a_loop_begins_where_it_rests():
    row = replace(design_schedule_row(), gains=Gains(-0.5, 0.0, -0.3), feed_forward=-0.01)
    off = plant(offset=0.03)
    still = stepped(off, row, reference=0.0, seconds=20.0)
    assert np.ptp(still.angle) < 1e-9
    assert still.angle[0, 0] == pytest.approx(0.02 / -0.5)
    integral = stepped(off, replace(row, gains=Gains(-0.5, -0.05, -0.3)), reference=0.0, seconds=20.0)
    assert np.max(np.abs(integral.angle)) < 1e-9


def test_a_limit_cycle_is_seen_at_the_size_that_has_it():
    wild = plant(damping=-0.5, quadratic=3.0, lag=0.3)
    steps = stepped(wild, replace(design_schedule_row(), gains=Gains(-0.6)), reference=0.35, seconds=60.0)
    assert swing(steps.angle, 0.35)[0] > LIMIT_CYCLE_SHARE
    calm = stepped(plant(), replace(design_schedule_row(), gains=Gains(-0.5)), reference=0.35, seconds=60.0)
    assert swing(calm.angle, 0.35)[0] < LIMIT_CYCLE_SHARE


def test_a_straight_leg_has_the_rms_of_the_models_disturbance():
    noise = Noise(0.005, 0.005, 0.04, 0.5)
    push = disturbance_moment(noise, Pace())
    assert np.std(push) == pytest.approx(0.04, rel=0.2)
    leg = fly(plant(), [replace(design_schedule_row(), gains=Gains(-0.5))], Flight(Pace().leg, push=push))
    # heading over moment: 1 / (s^2 + a s + b kp), driven by an AR(1) moment of 0.04 rad/s^2 and 0.5 s
    omega = np.geomspace(1e-3, 50.0, 4000)
    s = 1j * omega
    density = np.abs(1.0 / (s * s + 1.2 * s + 0.8)) ** 2 * 2.0 * 0.04**2 * 0.5 / (1.0 + (0.5 * omega) ** 2)
    assert np.std(leg.angle) == pytest.approx(np.sqrt(np.trapezoid(density, omega) / np.pi), rel=0.25)
    assert np.ptp(disturbance_moment(None, Pace())) == 0.0


def test_the_trim_offset_holds_the_propellers_moment_at_each_speeds_thrust():
    values = {"a22": 1.2, "b2": -1.6, "C0": 0.016, "prop_moment": 0.02}
    trained = {"thrust_at_1_m_s": 2.0, "thrust_exponent": 2.0}
    law = SpeedLaw(1.5)
    model = Model(Axis.YAW, ("prop_moment",), values, {}, tuple(values), np.zeros((4, 4)), law, Noise(0.01, 0.01), trained)
    source = ParameterSource(Axis.YAW, (), (model,), ("made",), None, ())
    for speed in (1.0, 2.0):
        offset = float(plants_at(source, speed, FinLimits(), 1, 0)[0][0].offset[0])
        authority = model.at_speed(speed)["b2"]
        wanted = (0.016 * law.trim_factor(speed) + 0.02 * 2.0 * speed**2) / authority
        assert offset == pytest.approx(wanted)


def test_what_the_tour_compiles_ahead_is_what_a_step_and_a_dive_call():
    compile_loops()
    row = design_schedule_row()
    stepped(plant(), row, reference=0.1, seconds=1.0)
    fly(plant(), [row], Flight(1.0, depth=1.0, pitch_limit=0.3))
    stepped(replace(plant(), hull=np.ones((1, 22))), row, reference=0.1, seconds=1.0)
    assert len(close_loop.signatures) == 1
