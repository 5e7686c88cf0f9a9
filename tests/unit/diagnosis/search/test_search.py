"""What a search keeps of several ends of one hypothesis: that of most evidence on all runs, not of the best fit."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import hidden_lag
import numpy as np
import pytest

from fieldsid.diagnosis.data.applicable_effects import applicable_effects
from fieldsid.diagnosis.evidence.acceptance import lacks
from fieldsid.diagnosis.evidence.likelihood_fit import likelihood_at, measured_count
from fieldsid.diagnosis.evidence.scored_model import score_model
from fieldsid.diagnosis.records import Errors
from fieldsid.diagnosis.search import move_evaluation, search, search_state
from fieldsid.diagnosis.search.add_effect import (
    Addition,
    by_effects,
    foremost,
    likelihood_linearisation,
    may_gain,
    mechanisms,
    screen_additions,
)
from fieldsid.diagnosis.search.search import Search
from fieldsid.diagnosis.thresholds import ALTERNATIVE_LOG_ODDS, EVIDENCE_TEMPERATURE
from fieldsid.effects import all_effects
from fieldsid.fitting.initial.effect_screen import carry_parameters
from fieldsid.models.axis import Axis
from fieldsid.models.model import Noise
from fieldsid.models.record import record_of


def patch(monkeypatch, name, value):
    """Replace a name in every file of the search that uses it."""
    for part in (search, move_evaluation, search_state):
        if hasattr(part, name):
            monkeypatch.setattr(part, name, value)


def search_for(*names):
    """A search for some effects on the runs of the hidden lag."""
    training, unseen = hidden_lag.runs()
    records = [[record_of(r, Axis.YAW) for r in runs] for runs in (training, [unseen])]
    effects = all_effects(Axis.YAW)
    catalogue, _ = applicable_effects([effects[n] for n in names], [*records[0], *records[1]])
    return Search(*records, Axis.YAW, catalogue)


def with_children(*names):
    """A search for a lag, a dead time and a bias with its base and the children of some of them."""
    made, effects = search_for("servo_lag", "delay", "gyro_bias"), all_effects(Axis.YAW)
    base, asked = made.base(), [effects[n] for n in names]
    made._try_added([Addition(base, asked)])
    return made, base, [made.tried[frozenset([n])] for n in names]


def with_a_bias_after_a_delay():
    """A search for a lag, a dead time and a bias that has fitted the dead time, then the bias with it, and the model of both."""
    made, _, (parent,) = with_children("delay")
    made._try_added([Addition(parent, [all_effects(Axis.YAW)["gyro_bias"]])])
    return made, made.tried[frozenset(["delay", "gyro_bias"])]


@pytest.fixture(scope="module")
def base():
    """A search with its base judged."""
    made = search_for("servo_lag")
    made.base()
    return made


@pytest.fixture
def other_ends(monkeypatch):
    """Make what is judged from now on predict unseen runs so much better than it does."""

    def by(much):
        real = search_state.score_model
        patch(
            monkeypatch,
            "score_model",
            lambda *of: replace(h := real(*of), validation_log_density=h.validation_log_density + much),
        )

    return by


@pytest.mark.parametrize("seen", [True, False], ids=["seen to first order", "too long for that"])
def test_an_effect_is_exchanged_for_what_it_may_be_mistaken_for_beside_the_others(monkeypatch, seen):
    if not seen:
        monkeypatch.setattr(Search, "_to_rival", lambda _self, h, *_: Addition(h, []))
    made, parent = with_a_bias_after_a_delay()
    monkeypatch.setattr(Search, "_most_evident", lambda _self: parent)
    assert frozenset(["gyro_bias", "servo_lag"]) not in made.tried
    made.budget.most = made.budget.where_unexplained = 0.0  # what is named last is asked for whatever was spent before
    made._exchange_for_lookalikes(parent)
    lagged = made.tried[frozenset(["gyro_bias", "servo_lag"])]
    assert lagged.log_evidence > parent.log_evidence
    assert lagged.model.values["lag"] == pytest.approx(hidden_lag.LAG, rel=0.2)


def test_what_is_not_accepted_is_exchanged_for_nothing(monkeypatch):
    made, parent = with_a_bias_after_a_delay()
    monkeypatch.setattr(Search, "core_of", lambda *_: frozenset(["gyro_bias"]))
    made._exchange_for_lookalikes(parent)
    assert frozenset(["gyro_bias", "servo_lag"]) not in made.tried


def test_what_comes_to_lead_by_an_exchange_is_exchanged_in_its_turn_whatever_was_spent(monkeypatch):
    made, _, leaders = with_children("delay", "servo_lag", "gyro_bias")
    asked = []
    monkeypatch.setattr(Search, "_most_evident", lambda _self: leaders[min(len(asked), 2)])
    monkeypatch.setattr(Search, "_exchange_for_lookalikes", lambda _self, h: asked.append(h.names))
    for name in ("_exchange_for_variants", "_drop_each", "share_own_moments", "_expand"):
        monkeypatch.setattr(Search, name, lambda *_: None)
    made.budget.most = made.budget.where_unexplained = 0.0
    made._exchange_leaders()
    assert asked == [("delay",), ("servo_lag",)]


@pytest.mark.parametrize(("new", "ahead", "asked"), [("servo_lag", 2.9, 1), ("servo_lag", 3.1, 2), ("gyro_bias", 2.9, 2)])
def test_a_rival_with_one_effect_for_another_that_it_is_mistaken_for_needs_no_exchange_of_its_own(monkeypatch, new, ahead, asked):
    made, _, (first, second) = with_children("delay", new)
    per_run = (first.log_evidence + ahead - second.log_evidence) / len(second.validation_log_density)
    leaders = first, replace(second, validation_log_density=second.validation_log_density + per_run)
    exchanged = []
    monkeypatch.setattr(Search, "_most_evident", lambda _self: leaders[min(len(exchanged), 1)])
    monkeypatch.setattr(Search, "_exchange_for_lookalikes", lambda _self, h: exchanged.append(h.names))
    for name in ("_exchange_for_variants", "_drop_each", "share_own_moments", "_expand"):
        monkeypatch.setattr(Search, name, lambda *_: None)
    made._exchange_leaders()
    assert exchanged == [h.names for h in leaders[:asked]]


def test_what_comes_to_lead_by_what_promised_most_is_exchanged_in_its_turn(monkeypatch):
    made, _, (lag, bias) = with_children("servo_lag", "gyro_bias")
    exchanged, found = [], [lag]
    monkeypatch.setattr(Search, "_most_evident", lambda _self: found[-1])
    monkeypatch.setattr(Search, "_is_expandable", lambda *_: True)
    monkeypatch.setattr(Search, "_add_most_promising", lambda *_: found.append(bias))
    monkeypatch.setattr(Search, "_exchange_for_lookalikes", lambda _self, h: exchanged.append(h.names))
    monkeypatch.setattr(Search, "leaves_visible_error", lambda _self: False)
    for name in ("_expand", "_grow_rivals", "_exchange_for_variants", "_drop_each"):
        monkeypatch.setattr(Search, name, lambda *_: False)
    made.budget.most = made.budget.where_unexplained = 0.0
    made.best()
    assert exchanged == [("servo_lag",), ("gyro_bias",)]


def test_an_accepted_set_that_predicts_as_well_is_grown_beside_the_most_evident(monkeypatch):
    made, base, (best, _) = with_children("servo_lag", "delay")
    monkeypatch.setattr(Search, "_most_evident", lambda _self: best)
    monkeypatch.setattr(search, "MISSING_ERROR_RATIO", 20.0)  # a dead time leaves more than that of so slow a servo
    assert made._predicts_as_well(made.tried[frozenset(["delay"])], best)
    assert not made._predicts_as_well(base, best)
    made._grow_rivals()
    assert frozenset(["delay", "servo_lag"]) not in made.tried  # it lacks far more evidence than a small effect could bring
    monkeypatch.setattr(search, "RIVAL_LOG_ODDS", best.log_evidence - made.tried[frozenset(["delay"])].log_evidence)
    monkeypatch.setattr(Search, "_may_come_near", lambda *_: True)
    made._grow_rivals()
    assert frozenset(["delay", "servo_lag"]) in made.tried


def test_what_was_not_expanded_is_fitted_with_what_promises_most():
    made = search_for("servo_lag", "delay", "gyro_bias")
    made._add_most_promising(made.base())
    assert frozenset(["servo_lag"]) in made.tried
    assert frozenset(["gyro_bias"]) not in made.tried  # there is none


def test_beside_an_effect_nothing_is_added_that_it_may_be_mistaken_for():
    made, _, (delayed,) = with_children("delay")
    made._add_most_promising(delayed)
    assert frozenset(["delay", "servo_lag"]) not in made.tried


@pytest.mark.parametrize("expanded", [False, True])
def test_that_is_done_where_the_model_found_was_not_expanded(monkeypatch, expanded):
    added = []
    monkeypatch.setattr(Search, "_add_most_promising", lambda _self, h: added.append(h.names))
    monkeypatch.setattr(Search, "_is_expandable", lambda _self, h: not expanded and h.names == ("servo_lag",))
    search_for("servo_lag").best()
    assert added == ([] if expanded else [("servo_lag",)])


@pytest.mark.parametrize("visible", [True, False])
def test_beside_a_child_that_leaves_no_visible_error_one_that_explains_little_is_not_refined(monkeypatch, visible):
    made, parent, (lag, delay, bias) = with_children("servo_lag", "delay", "gyro_bias")
    monkeypatch.setattr(move_evaluation, "SUFFICIENT_ERROR_RATIO", 0.0 if visible else np.inf)
    # a dead time explains little of so slow a servo
    monkeypatch.setattr(Search, "explained_share", lambda _self, _before, h: 0.6 if h is delay else 0.4)
    worth = [made._is_worth_refining(h, lag, parent) for h in (lag, delay, bias)]
    assert worth == [True, True, visible]
    assert made._leading(made.root) == [frozenset(h.names) for h, good in zip((lag, delay, bias), worth, strict=True) if good]


@pytest.mark.parametrize("ends", [False, True])
def test_the_best_of_a_models_children_is_fitted_with_what_others_have_added(monkeypatch, ends):
    made, base, children = with_children("servo_lag", "gyro_bias")
    monkeypatch.setattr(search, "gains_any_evidence", lambda *_: True)
    monkeypatch.setattr(search, "may_gain", lambda *_: True)  # there is no such bias
    monkeypatch.setattr(search, "leaves_error", lambda *_: not ends)
    monkeypatch.setattr(search, "prefer_output_error", lambda h, _floor: pytest.fail(f"{h.names} gain nothing"))
    made._join_children(children, base)
    joined = frozenset(["servo_lag", "gyro_bias"])
    assert (joined in made.tried) is not ends
    if not ends:
        assert made.tried[joined].model.values["lag"] == pytest.approx(hidden_lag.LAG, rel=0.2)


@pytest.mark.parametrize("promises", [False, True])
def test_what_promises_no_evidence_beside_the_best_is_not_joined_to_it(monkeypatch, promises):
    made, base, (lag, bias) = with_children("servo_lag", "gyro_bias")
    assert may_gain(base, likelihood_linearisation(base), lag.effects[0])
    assert not may_gain(lag, likelihood_linearisation(lag), bias.effects[0])
    monkeypatch.setattr(search, "may_gain", lambda *_: promises)
    (joined,) = made._joined(lag, [bias])
    assert (joined is lag) is not promises


def test_a_model_lacks_no_more_evidence_than_on_the_training_runs_in_proportion(base):
    h = base.base()
    more = replace(h, validation_log_density=h.validation_log_density + 100.0)
    assert lacks(h, more) == 0.0
    fit = more.likelihood_fit
    both = replace(more, likelihood_fit=replace(fit, log_likelihood=fit.log_likelihood + 10.0))
    share = measured_count(base.records) / measured_count((*base.records, *base.validation))
    assert lacks(h, both) == pytest.approx(10.0 / share)
    assert lacks(both, h) == pytest.approx(-100.0 * len(h.validation_log_density) - 10.0)


@pytest.mark.parametrize("behind", [0.0, 1e4])
def test_what_cannot_come_near_a_model_is_not_kept(behind):
    made = search_for("servo_lag", "delay")
    base, lag = made.base(), all_effects(Axis.YAW)["servo_lag"]
    near = replace(base, complexity_penalty=base.complexity_penalty - behind)
    made._try_added([Addition(base, [lag], near=near)])
    assert (frozenset(["servo_lag"]) in made.tried) is (behind == 0.0)


def test_models_without_children_are_joined_with_nothing(base):
    tried = len(base.tried)
    base._join_children([], base.base())
    assert len(base.tried) == tried


def test_an_effect_pays_its_prior_odds_at_the_temperature_of_the_evidence(base):
    lag, alone = base.catalogue[0], base.base()
    base._try_added([Addition(alone, [lag], flown=False, anew=True)])
    paid = base.tried[frozenset(["servo_lag"])].complexity_penalty - alone.complexity_penalty
    prior = EVIDENCE_TEMPERATURE * ALTERNATIVE_LOG_ODDS
    assert prior < paid < prior + 0.5 * np.log(2 * sum(r.time.size for r in base.records))
    assert base.tried[frozenset(["servo_lag"])].trial_penalty - alone.trial_penalty == pytest.approx(paid - ALTERNATIVE_LOG_ODDS)


def test_a_model_moved_to_fewer_effects_has_the_numbers_it_had_and_the_likelihood_there(base):
    lag = base.catalogue[0]
    base._try_added([Addition(base.base(), [lag], flown=False, anew=True)])
    fast = base.tried[frozenset(["servo_lag"])]
    moved = base._moved(fast, [])
    assert moved.names == ()
    shared = moved.likelihood_fit.fitted
    for name, value in zip(shared.problem.layout.names, shared.x, strict=False):
        assert value == pytest.approx(fast.likelihood_model.values[name], rel=1e-12)
    assert moved.likelihood_fit.log_likelihood < base.base().likelihood_fit.log_likelihood + 1.0


def test_a_model_that_diverges_is_not_expanded(base):
    h = base.base()
    base.tried.progress.expanded.discard(base.root)
    assert base._is_expandable(h)
    assert not base._is_expandable(replace(h, validation_log_density=np.full(1, -np.inf)))


def test_a_model_that_diverges_has_no_moves(base):
    h = base.base()
    lost = replace(h, likelihood_fit=replace(h.likelihood_fit, log_likelihood=-np.inf))
    some, none = screen_additions([Addition(h, base.catalogue), Addition(lost, base.catalogue)], base.parallel)
    assert some
    assert not none


@pytest.mark.parametrize(("unseen", "kept"), [(-300.0, False), (1.0, True)])
def test_a_better_fit_is_kept_where_unseen_runs_agree(base, other_ends, unseen, kept):
    other_ends(unseen)
    before = base.tried[base.root]
    fits = replace(before.likelihood_fit, log_likelihood=before.likelihood_fit.log_likelihood + 5.0)
    found = base._keep(fits)
    assert (found is not before) == kept
    base.tried[base.root] = before


@pytest.mark.parametrize(("unseen", "kept"), [(-300.0, False), (1.0, True)])
def test_an_end_that_a_child_has_led_to_is_kept_where_unseen_runs_agree(base, other_ends, monkeypatch, unseen, kept):
    other_ends(unseen)
    before = base.tried[base.root]
    child = SimpleNamespace(log_evidence=before.log_evidence + 100.0)
    monkeypatch.setattr(type(base), "_children", lambda _self, _key: [child])
    fits = replace(before.likelihood_fit, log_likelihood=before.likelihood_fit.log_likelihood + 5.0)
    monkeypatch.setattr(type(base), "_fit_from", lambda *_of: fits)
    patch(monkeypatch, "prefer_output_error", lambda h, *_more: h)
    monkeypatch.setattr(type(base), "_keep", lambda _self, judged: judged)
    assert base._takes_refit(base.root, fits) == kept
    assert (base.tried[base.root] is not before) == kept
    base.tried[base.root] = before


def test_an_effect_proven_beside_a_small_one_stays_when_that_is_left_out(base, monkeypatch):
    def model(names, *, error, evidence):
        errors = Errors(0.004 * error, 0.002 * error)
        effects = tuple(all_effects(Axis.YAW)[n] for n in names)
        return SimpleNamespace(
            names=names,
            effects=effects,
            log_evidence=evidence,
            log_likelihood=evidence,
            validation_log_density=np.zeros(1),
            selection_errors=errors,
            train=errors,
            own_moment=0.0,
            train_under=lambda _std: errors,
            unseen_under=lambda _std: (errors,),
        )

    both, whole = ("stall", "current"), ("stall", "current", "delay")
    tried = [
        model(both[:1], error=2.0, evidence=60.0),
        model(both, error=1.1, evidence=55.0),
        model(("current",), error=3.0, evidence=9.0),
    ]
    tried += [
        model(whole, error=1.05, evidence=120.0),
        model(whole[::2], error=1.4, evidence=100.0),
        model(whole[1:], error=2.0, evidence=90.0),
    ]
    work = SimpleNamespace(
        known=(),
        tried={frozenset(h.names): h for h in tried},
        floor=Noise(0.004, 0.002),
        root=frozenset(),
        _least_to_explain=lambda _floor: 1.15,
    )
    work._without_each = lambda h: search_state.SearchState._without_each(work, h)
    assert search_state.SearchState.core_of(work, tried[3]) == set(both)
    assert search_state.SearchState.core_of(work, tried[1]) == {"stall"}


def test_an_actuator_and_a_state_of_the_hull_are_fitted_together_from_the_base(monkeypatch):
    made = search_for("servo_lag", "sway_coupling", "gyro_bias")
    sway, starts = next(e for e in made.catalogue if e.name == "sway_coupling"), []
    base = made.base()
    made._try_added([Addition(base, [sway])])
    real = search.fit_maximum_likelihood

    def fit(problem, start, *more, rival):
        starts.append(dict(zip(problem.layout.names, start, strict=False)))
        return real(problem, start, *more, rival=rival)

    monkeypatch.setattr(search, "fit_maximum_likelihood", fit)
    monkeypatch.setattr(made.parallel, "map", lambda function, items: [function(i) for i in items])
    pairs = made._all_in_series()
    assert [(a.name, b.name) for a, b in pairs] == [("sway_coupling", "servo_lag")]
    made._fit_pairs(pairs)
    assert len({(start["cross_damping"], start["cross_rate"]) for start in starts}) == len(starts) == search.MAX_STARTS_IN_SERIES
    for start in starts:
        assert start["lag"] == pytest.approx(0.15)
        assert start["a22"] == pytest.approx(base.likelihood_model.values["a22"])
    assert frozenset(["servo_lag", "sway_coupling"]) in made.tried


@pytest.mark.parametrize("gains", [True, False])
def test_a_pair_in_series_that_its_state_makes_likelier_is_tried_with_what_the_leading_model_has(monkeypatch, gains):
    made, pair = search_for("servo_lag", "sway_coupling", "gyro_bias"), frozenset(["servo_lag", "sway_coupling"])
    made.base()
    made._try_added([Addition(made.base(), made.catalogue)])
    made._fit_pairs(made._all_in_series())
    leading = made._moved(made._most_evident(), [e for e in made.catalogue if e.name in ("servo_lag", "gyro_bias")])
    tried = []

    def other_variant(self, asked):
        (request,) = asked
        assert (frozenset(request.model.names), request.effects) == (pair, {"sway_coupling"})
        if gains:
            self.tried[pair] = replace(request.model)

    monkeypatch.setattr(Search, "_try_variants", other_variant)
    monkeypatch.setattr(Search, "_most_evident", lambda _self: leading)
    monkeypatch.setattr(
        Search, "_try_added", lambda _self, asked: tried.extend((a.parent, [e.name for e in a.effects], a.near) for a in asked)
    )
    monkeypatch.setattr(Search, "_join_children", lambda _self, _children, parent: tried.append(parent))
    made.tried.progress.expanded.add(pair)
    made._vary_states_in_series()
    assert tried == ([(made.tried[pair], ["gyro_bias"], leading), made.tried[pair]] if gains else [])
    assert (pair in made.tried.progress.expanded) is not gains


def test_a_model_that_is_less_likely_than_a_part_of_it_is_fitted_again_from_there():
    made, _, (lag, bias) = with_children("servo_lag", "gyro_bias")
    problem = lag.likelihood_fit.fitted.problem.with_effects([*lag.effects, *bias.effects])
    both = frozenset(["servo_lag", "gyro_bias"])
    # an end at which nothing lags, as if its optimum had been missed
    far = carry_parameters(problem.layout, bias.likelihood_fit.fitted.vector, otherwise={"lag": 0.0})
    missed = replace(lag.likelihood_fit, fitted=replace(lag.likelihood_fit.fitted, problem=problem, x=far))
    missed = replace(missed, log_likelihood=likelihood_at(problem, far, lag.likelihood_fit))
    made.tried[both] = score_model(missed, made.validation)
    assert made.tried[both].log_likelihood < lag.log_likelihood - 10.0
    assert {part.names for part in made._parts(made.tried[both])} == {("servo_lag",), ("gyro_bias",)}
    made._fit_from_parts()
    found = made.tried[both]
    assert found.log_likelihood > lag.log_likelihood - 0.5
    assert found.model.values["lag"] == pytest.approx(lag.model.values["lag"], rel=0.05)
    made._fit_from_parts()  # that is done once
    assert made.tried[both] is found


@pytest.mark.parametrize(
    ("evidence", "train", "unseen", "stays"),
    [(-1.0, 2.0, 2.0, True), (-9.0, 2.0, 2.0, False), (-9.0, 1.7, 1.7, True), (-9.0, 1.7, 2.0, False), (-9.0, 2.0, 1.7, False)],
)
def test_a_child_stays_in_question_by_its_evidence_or_by_a_clearly_lower_error(evidence, train, unseen, stays):
    def child(evidence, train, unseen):
        errors = (Errors(0.004 * over, 0.002 * over) for over in (train, unseen))
        return SimpleNamespace(log_evidence=evidence, **dict(zip(("train", "selection_errors"), errors, strict=True)))

    work = SimpleNamespace(floor=Noise(0.004, 0.002))
    best, other = child(0.0, 2.0, 2.0), child(evidence, train, unseen)
    assert move_evaluation.MoveEvaluation._stays_in_question(work, other, best) is stays


def test_what_does_without_the_textbooks_numbers_is_screened_beside_it():
    effects = all_effects(Axis.YAW)
    assert [[c.name for c in e.coefficients] for e in mechanisms([effects["current"]])] == [
        ["current_sin", "current_cos"],
        ["current_north", "current_east"],
    ]
    assert mechanisms([effects["crossflow_drag"]]) == [effects["crossflow_drag"]]


def test_a_hull_that_its_sway_alone_holds_straight_is_left_without_it_from_the_base():
    made = search_for("servo_lag", "sway_coupling")
    base, (lag, sway) = made.base(), made.catalogue
    problem = base.likelihood_fit.fitted.problem.with_effects([lag, sway])
    held = {"a22": -3.0, "lag": 0.5, "cross_damping": 8.0, "cross_rate": 26.0}
    x = carry_parameters(problem.layout, base.likelihood_fit.fitted.vector)
    x[[problem.layout.names.index(name) for name in held]] = list(held.values())
    at = replace(base.likelihood_fit, fitted=replace(base.likelihood_fit.fitted, problem=problem, x=x))
    without = problem.with_effects([lag])
    assert not np.isfinite(likelihood_at(without, carry_parameters(without.layout, at.fitted.vector), at))
    left = made._drop_effect(replace(base, likelihood_fit=at), sway)
    assert left.names == ("servo_lag",)
    assert left.log_likelihood > base.log_likelihood + 100.0


@pytest.mark.parametrize("left", [1.1, 1.3])
def test_what_promises_less_is_fitted_where_the_first_leave_a_visible_error_or_are_mistaken_for_it(monkeypatch, left):
    made = search_for("servo_lag", "delay", "gyro_bias")
    base = made.base()
    [found] = screen_additions([Addition(base, made.catalogue)], made.parallel)
    groups = by_effects(found)
    monkeypatch.setattr(move_evaluation, "FOREMOST_EFFECTS", 1)
    monkeypatch.setattr(move_evaluation, "worst_error", lambda *_: left)
    made._evaluate_foremost(made.root, groups)
    assert [group[0].screened.effect.name for group in foremost(groups, 1)] == ["servo_lag"]
    fitted = {n for key in made.tried for n in key}
    assert fitted == ({"servo_lag", "delay"} if left < 1.15 else {"servo_lag", "delay", "gyro_bias"})


def test_the_foremost_are_those_that_come_first_on_either_screen():
    made = search_for("servo_lag", "delay", "gyro_bias")
    [found] = screen_additions([Addition(made.base(), made.catalogue, flown=False)], made.parallel)
    whitened = [replace(move, by_output_error=False) for move in found if not move.by_output_error]
    flown = [
        replace(move, by_output_error=True, screened=replace(move.screened, predicted_cost=1.0 - 0.1 * i))
        for i, move in enumerate(whitened)
    ]
    groups = by_effects([*whitened, *flown])
    last, first = flown[-1].screened.effect.name, foremost(by_effects(whitened), 1)[0][0].screened.effect.name
    assert {group[0].screened.effect.name for group in foremost(groups, 1)} == {first, last}
    assert foremost(groups, 5) == groups


def test_additions_to_several_models_are_screened_and_fitted_at_once_and_two_ways_to_a_set_are_one():
    made, _, (lag, bias) = with_children("servo_lag", "gyro_bias")
    effects = {e.name: e for e in made.catalogue}
    apart = [Addition(lag, [effects["gyro_bias"]]), Addition(bias, [effects["servo_lag"]])]
    for addition in apart:
        made._try_added([addition])
    one_by_one = made.tried[frozenset(["servo_lag", "gyro_bias"])]
    other, _, (lag, bias) = with_children("servo_lag", "gyro_bias")
    other._try_added([Addition(lag, [effects["gyro_bias"]]), Addition(bias, [effects["servo_lag"]])])
    both = other.tried[frozenset(["servo_lag", "gyro_bias"])]
    assert both.log_evidence == pytest.approx(one_by_one.log_evidence, abs=0.5)
