"""Sensitivities against central differences, the short and the piecewise way against the general one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from short_way import compare_with_the_general_core
from truth.paper import PITCH, YAW, YawRow, paper_run

from fieldsid.diagnosis.evidence.scored_model import bare_model
from fieldsid.fitting.initial.effect_screen import carry_parameters
from fieldsid.fitting.initial.equation_error import equation_error_start
from fieldsid.fitting.optimise import chunked
from fieldsid.fitting.optimise.levenberg_marquardt import GaussianPrior, cost_of, levenberg_marquardt, normal_equations
from fieldsid.fitting.optimise.linear_white import linear_white
from fieldsid.fitting.predict.predict import frozen_problem
from fieldsid.fitting.problem.parameters import layout_of, speed_groups
from fieldsid.fitting.problem.problem import Problem
from fieldsid.logs.run import Run
from fieldsid.models.axis import Axis
from fieldsid.models.effect import effect_named, with_variant
from fieldsid.models.model import Noise
from fieldsid.models.record import record_of
from fieldsid.numerics.gram_least_squares import SINGULAR_EIGENVALUE_SHARE, gram_least_squares, solve_normal_equations

NOISE = Noise(0.005, 0.004)


def record(row, seed=1, **change):
    log = paper_run(row, angle_noise=0.005, rate_noise=0.005, seed=seed)
    made = record_of(Run(f"run{seed}", log.pop("time_s"), log), Axis.YAW if isinstance(row, YawRow) else Axis.PITCH)
    return replace(made, **change)


def problem_of(records, effects=()):
    parts = tuple(effect_named(e) if isinstance(e, str) else e for e in effects)
    return Problem(tuple(records), layout_of(records, records[0].axis, parts))


def moved_start(problem):
    """A start off every symmetric point: base parameters near the truth, effects a little from zero."""
    base = problem.with_effects(()).layout
    x = carry_parameters(problem.layout, (base, equation_error_start(problem.records, base)))
    for i, slot in enumerate(problem.layout.parameters):
        if x[i] in (slot.low, 0.0):
            x[i] = min(slot.low + 0.05, 0.5 * slot.high) if slot.low >= 0 else 0.02
    return x


def compare_with_slopes(problem, x, run, near):
    """Compare a run's sensitivities with central differences of its free run."""
    result = problem.linearise(x, run)
    for slot, mine in zip(result.columns, result.sensitivity, strict=True):
        step = 1e-4 * max(abs(x[slot]), 0.1)
        ends = [problem.residual(np.where(np.arange(x.size) == slot, x + s, x), run)[0] for s in (step, -step)]
        slope = -(ends[0] - ends[1]) / (2 * step)
        scale = np.abs(slope).max() + 1e-9
        assert np.abs(mine - slope).max() < near * scale, problem.layout.parameters[slot].name


@pytest.mark.parametrize(
    ("row", "effects"),
    [
        (YAW[1], ()), (PITCH[3], ()), (YAW[1], ("quadratic_damping",)), (YAW[1], ("sway_coupling", "servo_lag")),
        (PITCH[3], ("large_angle_righting",)), (YAW[1], ("gyro_bias",)), (YAW[1], ("crossflow_drag",)),
    ],
    ids=str,
)  # fmt: skip
def test_sensitivities_are_the_slopes_of_the_free_run(row, effects):
    problem = problem_of([record(row)], effects)
    compare_with_slopes(problem, moved_start(problem), 0, 2e-3)


@pytest.mark.parametrize(("row", "effect"), [(YAW[1], "sway_coupling"), (PITCH[3], "heave_coupling")], ids=str)
def test_the_start_of_a_hidden_state_moves_with_its_coefficients_and_the_speed_law(row, effect):
    records = [record(row, speed=1.0), record(row, 2, speed=1.6)]
    problem = problem_of(records, [effect])
    x = moved_start(problem)
    for name, value in {"cross_rate": -0.4, "damping_exponent": 0.8, "rate_before": 0.15}.items():
        x[[s.name == name for s in problem.layout.parameters]] = value
    for run in range(2):
        assert problem.state_of(x, run)[2] == pytest.approx(0.15 * 0.4 / 0.8 * problem.scales[run][0] ** 0.8)
        compare_with_slopes(problem, x, run, 2e-5)


@pytest.mark.parametrize("variant", effect_named("sway_coupling").variants, ids=lambda v: v.says)
def test_the_start_of_a_hidden_state_moves_with_the_coefficients_of_its_forms(variant):
    records = [record(YAW[1], speed=1.0), record(YAW[1], 2, speed=1.6)]
    sway = effect_named("sway_coupling")
    problem = problem_of(records, [with_variant(sway, variant)])
    x = moved_start(problem)
    for name, value in {"cross_rate": -0.4, "rate_before": 0.15, "cross_quadratic": 6.0, "cross_fin": 0.3}.items():
        x[[s.name == name for s in problem.layout.parameters]] = value
    for run in range(2):
        values = problem.values_of(x, run)
        state, core = problem.state_of(x, run)[2], sway.core(values, problem.scales[run][0])
        square = core.cross_quadratic + core.strip_force * core.strip_flow**2
        held = core.cross_damping * state + square * state * abs(state)
        assert held == pytest.approx(-core.cross_rate * values["rate_before"])
        compare_with_slopes(problem, x, run, 2e-5)


@pytest.mark.parametrize("beside", [(), ("sway_coupling",)], ids=["its own state", "that of the sway beside it"])
def test_the_slopes_of_a_cross_flow_are_exact(beside):
    problem = problem_of([record(YAW[1], speed=1.0), record(YAW[1], 2, speed=1.6)], [*beside, "crossflow_drag"])
    assert ("flow_share" in problem.layout.names) == bool(beside)
    for run in range(2):
        compare_with_slopes(problem, moved_start(problem), run, 2e-5)


def test_a_bent_fins_trim_follows_what_changes_the_authority_within_a_run():
    n = len(record(YAW[1]))
    faster = {"surge": 1.3 + 0.3 * np.sin(np.arange(n) / 60.0)}
    problem = problem_of([record(YAW[1], speed=1.3, signals=faster), record(YAW[1], 2, speed=1.9)], ["speed_varying"])
    assert problem.layout.groups.trim_of_fin
    x = moved_start(problem)
    x[problem.layout.names.index("C0")] = 0.2
    for run in range(2):
        compare_with_slopes(problem, x, run, 2e-4)
    model = bare_model(problem, x, NOISE)
    for run, log in enumerate(problem.records):
        ours, start = frozen_problem(model, log, problem.layout.effects)
        held = {s.name: x[i] for i, s in enumerate(problem.layout.parameters) if s.run == run}
        start = np.array([held.get(s.name, v) for s, v in zip(ours.layout.parameters, start, strict=True)])
        np.testing.assert_allclose(ours.residual(start, 0)[0], problem.residual(x, run)[0], atol=1e-9)


@pytest.mark.parametrize("effects", [(), ("servo_lag", "sway_coupling"), ("quadratic_damping", "gyro_scale")], ids=str)
def test_another_command_moves_the_free_run_as_its_tangent_says(effects):
    problem = problem_of([record(YAW[1], command_lead=np.zeros(660))], effects)
    x, log = moved_start(problem), problem.records[0]
    jumps = np.flatnonzero(np.diff(log.fin)) + 1
    steps = [np.where(np.arange(660) == j, 1e-3, 0.0) for j in jumps[:3]]
    logged = problem.residual(x, 0)[0]
    for early, mine in zip(steps, problem.command_sensitivities(x, 0, [log.path_with_lead(e) for e in steps]), strict=True):
        other = Problem((replace(log, command_lead=early),), problem.layout)
        slope = logged - other.residual(x, 0)[0]
        assert np.abs(mine - slope).max() < 1e-3 * np.abs(slope).max()


def test_least_squares_by_products_are_those_of_the_rows_themselves():
    rng = np.random.default_rng(4)
    columns = rng.standard_normal((5, 400)) * np.array([1.0, 1e-6, 1e4, 1.0, 0.0])[:, None]
    target = rng.standard_normal(400)
    alike = columns[:4] / np.linalg.norm(columns[:4], axis=1)[:, None]
    best = np.linalg.lstsq(alike.T, target, rcond=None)[0] @ alike
    np.testing.assert_allclose(gram_least_squares(columns, target) @ columns, best, atol=1e-12)
    columns[3] = columns[0]
    twice = gram_least_squares(columns, target)
    assert twice[3] == pytest.approx(twice[0])
    assert twice[4] == 0.0


@pytest.mark.parametrize("seed", range(20))
def test_normal_equations_are_solved_as_by_eigenvalues_however_dependent_the_columns(seed):
    rng = np.random.default_rng(seed)
    columns = rng.standard_normal((6, 300))
    columns[4] = columns[0] - 2.0 * columns[1] + 10.0 ** (-seed / 2) * columns[4]
    gram, right = columns @ columns.T, columns @ rng.standard_normal(300)
    found, size = solve_normal_equations(gram, right), np.sqrt(np.diag(gram))
    best = np.linalg.lstsq(gram / np.outer(size, size), right / size, rcond=SINGULAR_EIGENVALUE_SHARE)[0] / size
    np.testing.assert_allclose(found @ columns, best @ columns, atol=1e-4)


def test_a_hidden_state_that_is_not_driven_starts_at_zero():
    problem = problem_of([record(YAW[1])], ["sway_coupling"])
    x = moved_start(problem)
    names = [s.name for s in problem.layout.parameters]
    x[names.index("rate_before")], x[names.index("cross_rate")] = problem.layout.high[names.index("rate_before")], 0.0
    base = problem_of([record(YAW[1])])
    keep = [i for i, n in enumerate(names) if n in {s.name for s in base.layout.parameters}]
    np.testing.assert_allclose(problem.residual(x, 0)[0], base.residual(x[keep], 0)[0], atol=1e-12)


def test_the_rate_before_a_run_is_not_far_beyond_those_of_the_records():
    log = record(YAW[1])
    for fastest, rates in ((1.5 * np.abs(log.rate).max(), log), (2.0, replace(log, rate_ok=np.zeros(len(log), bool)))):
        slot = next(s for s in problem_of([rates], ["sway_coupling"]).layout.parameters if s.name == "rate_before")
        assert (slot.low, slot.high) == (-fastest, fastest)


def test_the_short_way_has_the_normal_equations_of_the_general_core():
    logs = [record(PITCH[3]), record(PITCH[3], 2, speed=1.2)]
    ok = logs[0].rate_ok.copy()
    ok[100:130] = False
    problem = problem_of([replace(logs[0], rate_ok=ok), logs[1]])
    x = moved_start(problem)
    compare_with_the_general_core(problem, x, NOISE, gradient_near=1e-9)


@pytest.mark.parametrize("noise", [NOISE, Noise(0.005, 0.005, 0.02, 1.0)], ids=["white", "disturbed"])
def test_only_a_base_problem_under_white_noise_takes_the_short_way(noise):
    base, longer = problem_of([record(YAW[1])]), problem_of([record(YAW[1])], ["servo_lag"])
    assert (linear_white(base, noise, (0,)) is not None) == (noise is NOISE)
    assert linear_white(longer, noise, (0,)) is None


def test_pieces_of_a_long_record_add_up_to_the_whole(monkeypatch):
    problem = problem_of([record(YAW[1])], ["quadratic_damping"])
    x, free = moved_start(problem), (0, 1, 3, 4, 5)
    monkeypatch.setattr(chunked, "CHUNK_SAMPLES", 97)
    assert chunked.is_chunked(problem, NOISE)
    pieces, whole = chunked.chunked_normal_equations(problem, x, NOISE, free), normal_equations(problem, x, NOISE, free)
    assert pieces[0] == pytest.approx(whole[0], rel=1e-12)
    np.testing.assert_allclose(pieces[1], whole[1], rtol=1e-10, atol=1e-9 * np.abs(whole[1]).max())
    np.testing.assert_allclose(pieces[2], whole[2], rtol=1e-8, atol=1e-9 * np.abs(whole[2]).max())


def test_a_step_that_an_effect_refuses_counts_as_rejected():
    from fieldsid.errors import EffectError

    def moment(motion, values, record):
        if values["k"] > 0.1:
            raise EffectError("k is too large")
        return values["k"] * motion.rate

    base = effect_named("quadratic_damping")
    own = replace(base, name="own", core=None, initial_guesses=None, equivalent_solution=None, moment=moment, coefficients=(replace(base.coefficients[0], name="k", low=-1.0, high=1.0, start=0.0),))  # fmt: skip  # noqa: E501
    log = record(YAW[1])
    problem = Problem((log,), layout_of([log], Axis.YAW, (own,)))
    x = equation_error_start([log], problem.layout)
    x[problem.layout.names.index("a22")] += 0.5  # asks for k near 0.5
    slot = problem.layout.names.index("k")
    assert cost_of(problem, np.where(np.arange(x.size) == slot, 0.2, x), NOISE) == float("inf")
    found = levenberg_marquardt(problem, x, NOISE, free=[slot], max_iterations=15)
    assert 0.0 < found.x[slot] <= 0.1


def test_a_prior_holds_a_slot_as_strongly_as_it_says():
    problem = problem_of([record(YAW[1])])
    x = equation_error_start(problem.records, problem.layout)
    free = levenberg_marquardt(problem, x, NOISE)
    centre, precision = free.x.copy(), np.zeros((x.size, x.size))
    centre[4] += 0.01
    precision[4, 4] = 1e12
    assert levenberg_marquardt(problem, x, NOISE, prior=GaussianPrior(centre, precision)).x[4] == pytest.approx(
        centre[4], abs=1e-6
    )
    precision[4, 4] = 0.0
    np.testing.assert_allclose(
        levenberg_marquardt(problem, x, NOISE, prior=GaussianPrior(centre, precision)).x, free.x, rtol=1e-4, atol=1e-7
    )


@pytest.mark.parametrize("effects", [(), ("quadratic_damping",), ("step_change",)], ids=str)
@pytest.mark.parametrize("tolerance", [1e-3, 1e-8])
def test_a_descent_that_ends_without_looking_is_as_low_as_it_says(effects, tolerance):
    """The promise of its last step is below the tolerance: where that has led is not looked at."""
    problem = problem_of([record(YAW[1]), record(YAW[1], 2)], effects)
    noise = Noise(0.005, 0.005, 0.01, 1.0)
    start = equation_error_start(problem.records, problem.layout)
    found = levenberg_marquardt(problem, start, noise, tolerance=tolerance)
    held = [(b.damping, b.stiffness) for b in (problem.base_of(start, run) for run in range(2))]
    assert found.converged
    assert found.cost == pytest.approx(cost_of(problem, found.x, noise, held), rel=tolerance)


def test_runs_that_count_as_flown_at_one_speed_change_within_over_that():
    one = record(YAW[0])
    slowing = np.linspace(1.1, 0.9, len(one))
    runs = [replace(one, speed=u, signals={**one.signals, "surge": 1.5 * slowing}) for u in (1.45, 1.55)]
    effect = effect_named("speed_varying")
    for snapped in (False, True):
        layout = layout_of(runs, Axis.YAW, (effect,), speed_groups(runs, snapped=snapped))
        problem = Problem(tuple(runs), layout)
        x = equation_error_start(runs, layout)
        motions = [problem.simulate(x, run)[0].rate for run in (0, 1)]
        # by lift theory one fin in one flow turns the hull alike, whatever the run's median; without it only at one speed
        x[layout.names.index("speed_share")] = 0.0
        still = [problem.simulate(x, run)[0].rate for run in (0, 1)]
        assert np.allclose(*motions, atol=1e-12)
        assert np.allclose(*still, atol=1e-12) == snapped
