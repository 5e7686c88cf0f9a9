"""The search over sets of effects: what holds of every archive it leaves, and of each of its moves."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations, pairwise
from types import SimpleNamespace

import hidden_lag
import numpy as np
import pytest

from fieldsid.diagnosis.data.applicable_effects import applicable_effects
from fieldsid.diagnosis.evidence.likelihood_fit import MIN_LIKELIHOOD_GAIN
from fieldsid.diagnosis.evidence.scored_model import score_model
from fieldsid.diagnosis.moves.add_effect import Addition, mechanisms, screen_addition
from fieldsid.diagnosis.moves.archive import Archive
from fieldsid.diagnosis.moves.drop_effect import drop_each
from fieldsid.diagnosis.moves.grow import Growth
from fieldsid.diagnosis.moves.refit import with_events_of_parts
from fieldsid.diagnosis.records import Errors
from fieldsid.diagnosis.search.accepted_sets import core_of
from fieldsid.diagnosis.search.search import MAX_CANDIDATES, Search
from fieldsid.diagnosis.search.whole_hull import ADDED, whole_hull
from fieldsid.diagnosis.thresholds import ALTERNATIVE_LOG_ODDS, EVIDENCE_TEMPERATURE
from fieldsid.effects import all_effects
from fieldsid.fitting.initial.effect_screen import carry_parameters
from fieldsid.fitting.optimise.levenberg_marquardt import cost_of
from fieldsid.models.axis import Axis
from fieldsid.models.model import Noise
from fieldsid.models.record import record_of

LAG = frozenset({"servo_lag"})
YAW = all_effects(Axis.YAW)


def search_for(*names):
    """A search for some effects on the runs of the hidden lag."""
    training, unseen = hidden_lag.runs()
    records = [tuple(record_of(r, Axis.YAW) for r in runs) for runs in (training, [unseen])]
    catalogue, _ = applicable_effects([YAW[n] for n in names], [*records[0], *records[1]])
    return Search(*records, Axis.YAW, catalogue)


def grown(*names):
    """A search for a lag, a dead time and a bias with its base and the children of some of them."""
    made = search_for("servo_lag", "delay", "gyro_bias")
    base = made.base()
    growth = Growth(base, [YAW[n] for n in names], made.tried, made.grounds, lambda: False, forced=True)
    growth.grow()
    return made, base, [made.tried[frozenset([n])] for n in names]


@pytest.fixture(scope="module")
def ended():
    """A search that has come to its end, and what it has found."""
    made = search_for(*ADDED[:1], *ADDED[2:], "delay", "gyro_bias", "stall")
    return made, made.best()


@pytest.fixture(scope="module")
def base():
    """A search with its base judged."""
    made = search_for("servo_lag")
    made.base()
    return made


def test_it_finds_the_hidden_lag_and_nothing_besides(ended):
    made, found = ended
    assert set(found.names) & {"servo_lag", "delay"}
    assert len(found.names) == 1
    assert core_of(found, made.tried, made.floor) == frozenset(found.names)


def test_what_is_found_was_fitted_without_each_of_its_effects(ended):
    made, found = ended
    assert {name for name, _ in made.tried.without_each(found)} == set(found.names)


def test_no_model_of_the_table_is_less_likely_than_a_part_of_it(ended):
    made, _ = ended
    shown = made.ranked()[:MAX_CANDIDATES]
    pairs = [(h, part) for h in shown for _, part in made.tried.without_each(h) if all(e in h.effects for e in part.effects)]
    assert pairs
    for h, part in pairs:
        assert h.log_likelihood > part.log_likelihood - 2.0 * MIN_LIKELIHOOD_GAIN, (h.names, part.names)


def test_no_noise_is_far_below_what_the_sensors_show(ended):
    made, _ = ended
    for h in made.ranked():
        left = np.concatenate([run.residual.ravel() for run in (h.reported_fit.problem.linearise(h.reported_fit.x, 0),)])
        assert np.isfinite(left).all()
        assert h.train.over(made.floor) > 0.95


def test_less_error_on_every_run_with_fewer_effects_is_never_far_less_evidence(ended):
    """Never by half of what the hidden effect gains."""
    made, found = ended
    far = 0.5 * (found.log_evidence - made.base().log_evidence)
    for one, other in combinations(made.ranked(), 2):  # the first has more evidence
        runs = list(zip(one.errors.runs, other.errors.runs, strict=True))
        better = all(theirs.over(made.floor) < 0.9 * own.over(made.floor) for own, theirs in runs)
        if better and set(other.names) < set(one.names):
            assert one.log_evidence - other.log_evidence < far, (one.names, other.names)


def test_the_whole_hull_has_its_effects_and_every_set_on_the_way():
    made = search_for("servo_lag", "quadratic_damping", "sway_coupling", "gyro_bias")
    hull = whole_hull(made.base(), made.catalogue, made.tried, made.grounds)
    assert hull.names == ("sway_coupling", "servo_lag", "quadratic_damping")
    way = [made.base(), made.tried[frozenset(hull.names[:1])], made.tried[frozenset(hull.names[:2])], hull]
    assert all(after.log_likelihood > before.log_likelihood - 1.0 for before, after in pairwise(way))
    assert hull.train.over(made.floor) < 1.05


def test_the_whole_hull_is_fitted_beside_the_effects_that_a_model_has():
    made = search_for("servo_lag", "quadratic_damping", "gyro_bias")
    made.grow(made.base(), forced=True)
    hull = whole_hull(made.tried[LAG], made.catalogue, made.tried, made.grounds)
    assert hull.names == ("servo_lag", "quadratic_damping")
    beside = whole_hull(made.tried[frozenset({"gyro_bias"})], made.catalogue, made.tried, made.grounds)
    assert beside.names == ("gyro_bias", "servo_lag", "quadratic_damping")
    assert beside.log_likelihood > hull.log_likelihood - 1.0


def test_an_effect_pays_its_prior_odds_at_the_temperature_of_the_evidence():
    made, alone, (lag,) = grown("servo_lag")
    paid = lag.complexity_penalty - alone.complexity_penalty
    prior = EVIDENCE_TEMPERATURE * ALTERNATIVE_LOG_ODDS
    assert prior < paid < prior + 0.5 * np.log(2 * sum(r.time.size for r in made.records))
    assert lag.trial_penalty - alone.trial_penalty == pytest.approx(paid - ALTERNATIVE_LOG_ODDS)


def test_a_model_that_diverges_has_no_moves(base):
    h = base.base()
    lost = replace(h, likelihood_fit=replace(h.likelihood_fit, log_likelihood=-np.inf))
    assert screen_addition(Addition(h, base.catalogue), base.parallel)
    assert not screen_addition(Addition(lost, base.catalogue), base.parallel)


@pytest.mark.parametrize(("unseen", "kept"), [(-300.0, False), (1.0, True)])
def test_a_better_fit_is_kept_where_unseen_runs_agree(base, unseen, kept):
    before = base.base()
    fit = replace(before.likelihood_fit, log_likelihood=before.likelihood_fit.log_likelihood + 5.0)
    known = replace(before, validation_log_density=before.validation_log_density - unseen)
    assert (base.grounds.better(known, fit) is not known) == kept


def test_the_same_optimum_is_not_scored_again(base):
    known = base.base()
    assert base.grounds.better(known, known.likelihood_fit) is known


def _with_a_step(run, share, moment=0.08):
    """A run with the answer of its hull, of linear damping, to a moment (rad/s^2) from a share of the run on."""
    damping = 1.1 * float(np.mean(run.signals["surge_m_s"])) / hidden_lag.REFERENCE
    since = np.maximum(run.time - run.time[0] - share * (run.time[-1] - run.time[0]), 0.0)
    rate = moment / damping * (1.0 - np.exp(-damping * since))
    angle = moment / damping * since - rate / damping
    moved = {"yaw_rad": run.signals["yaw_rad"] + angle, "yaw_rate_rad_s": run.signals["yaw_rate_rad_s"] + rate}
    return replace(run, signals={**run.signals, **moved})


def test_an_event_at_a_wrong_time_is_fitted_again_at_the_time_that_a_part_has_found():
    training, unseen = hidden_lag.runs()
    stepped = [_with_a_step(run, share) for run, share in zip(training, (0.4, 0.65), strict=True)]
    records = [tuple(record_of(r, Axis.YAW) for r in runs) for runs in (stepped, [_with_a_step(unseen, 0.5)])]
    made = Search(*records, Axis.YAW, [YAW["servo_lag"], YAW["step_change"]])
    Growth(made.base(), made.catalogue, made.tried, made.grounds, lambda: False, forced=True).grow()
    lag, step = made.tried[LAG], made.tried[frozenset({"step_change"})]
    of_step = step.likelihood_fit.fitted
    assert [of_step.x[of_step.problem.layout.nuisances_of(run)[-1]] for run in (0, 1)] == pytest.approx([0.4, 0.65], abs=0.1)
    problem = of_step.problem.with_effects([*lag.effects, *step.effects])
    begin = carry_parameters(problem.layout, of_step.vector, lag.likelihood_fit.fitted.vector)
    events = np.array([s.is_event for s in problem.layout.parameters])
    begin[events] = (0.0, 0.65)
    missed = score_model(made.grounds.fit(problem, begin, step.likelihood_fit.noise), made.validation)
    assert missed.likelihood_fit.fitted.x[events][0] < 0.2
    found = with_events_of_parts(missed, "step_change", made.tried, made.grounds)
    assert found.log_evidence > missed.log_evidence + 10.0
    assert found.likelihood_fit.fitted.x[events] == pytest.approx([0.4, 0.65], abs=0.02)
    assert with_events_of_parts(found, "step_change", made.tried, made.grounds) is found
    assert with_events_of_parts(lag, "servo_lag", made.tried, made.grounds) is lag


def test_a_model_without_one_of_its_effects_is_fitted_once():
    made, _, (lag, bias) = grown("servo_lag", "gyro_bias")
    assert not drop_each(lag, made.tried, made.grounds)  # without its one effect it is the base
    made.grow(lag, forced=True)
    both = made.tried[frozenset([*lag.names, *bias.names])]
    assert drop_each(both, made.tried, made.grounds)
    assert not drop_each(both, made.tried, made.grounds)
    assert made.tried[LAG].log_likelihood > lag.log_likelihood - 0.5


def test_an_effect_proven_beside_a_small_one_stays_when_that_is_left_out():
    def model(names, *, error, evidence):
        errors = Errors(0.004 * error, 0.002 * error)
        return SimpleNamespace(
            names=names,
            effects=tuple(YAW[n] for n in names),
            log_evidence=evidence,
            log_likelihood=evidence,
            validation_log_density=np.zeros(1),
            selection_errors=errors,
            train=errors,
            own_moment=0.0,
            train_under=lambda _std: errors,
            unseen_under=lambda _std: (errors,),
            likelihood_fit=SimpleNamespace(noise_kind="disturbance"),
        )

    both, whole = ("stall", "current"), ("stall", "current", "delay")
    models = [
        model((), error=1.1, evidence=0.0),
        model(both[:1], error=2.0, evidence=60.0),
        model(both, error=1.1, evidence=55.0),
        model(("current",), error=3.0, evidence=9.0),
        model(whole, error=1.05, evidence=120.0),
        model(whole[::2], error=1.4, evidence=100.0),
        model(whole[1:], error=2.0, evidence=90.0),
    ]
    tried = Archive(frozenset(), {frozenset(h.names): h for h in models})
    assert core_of(models[4], tried, Noise(0.004, 0.002)) == frozenset(both)


def test_what_does_without_the_textbooks_numbers_is_screened_beside_it():
    assert [[c.name for c in e.coefficients] for e in mechanisms([YAW["current"]])] == [
        ["current_sin", "current_cos"],
        ["current_north", "current_east"],
    ]


def test_a_hull_that_its_sway_alone_holds_straight_is_left_without_it_from_the_base():
    made = search_for("servo_lag", "sway_coupling")
    base, (lag, sway) = made.base(), made.catalogue
    problem = base.likelihood_fit.fitted.problem.with_effects([lag, sway])
    held = {"a22": -3.0, "lag": 0.5, "cross_damping": 8.0, "cross_rate": 26.0}
    x = carry_parameters(problem.layout, base.likelihood_fit.fitted.vector)
    x[[problem.layout.names.index(name) for name in held]] = list(held.values())
    at = replace(base.likelihood_fit, fitted=replace(base.likelihood_fit.fitted, problem=problem, x=x))
    without = problem.with_effects([lag])
    assert not np.isfinite(cost_of(without, carry_parameters(without.layout, at.fitted.vector), at.noise))
    assert drop_each(replace(base, likelihood_fit=at), made.tried, made.grounds)
    left = made.tried[LAG]
    assert left.log_likelihood > base.log_likelihood + 100.0
