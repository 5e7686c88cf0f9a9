"""What a search has tried: one model stands for each set of effects, and its parts and children are found by their names."""

from __future__ import annotations

from dataclasses import replace

import hidden_lag
import numpy as np
import pytest

from fieldsid.diagnosis.evidence.scored_model import ScoredModel
from fieldsid.diagnosis.moves.archive import Archive
from fieldsid.diagnosis.search.search import Search
from fieldsid.effects import all_effects
from fieldsid.models.axis import Axis
from fieldsid.models.effect import with_variant
from fieldsid.models.record import record_of

LAG, BOTH, ROOT = frozenset({"servo_lag"}), frozenset({"servo_lag", "stall"}), frozenset[str]()
YAW = all_effects(Axis.YAW)


@pytest.fixture(scope="module")
def base() -> ScoredModel:
    """The model without effects of runs with a hidden lag."""
    training, unseen = hidden_lag.runs()
    learned, checked = (tuple(record_of(r, Axis.YAW) for r in runs) for runs in (training, [unseen]))
    return Search(learned, checked, Axis.YAW, []).base()


def model(base: ScoredModel, *names: str, evidence: float = 0.0, formed: str = "") -> ScoredModel:
    """A model of some effects with a stated gain in evidence, one of them in a variant: nothing is fitted."""
    effects = [with_variant(YAW[n], YAW[n].variants[0]) if n == formed else YAW[n] for n in names]
    problem = base.likelihood_fit.fitted.problem.with_effects(effects)
    fit = replace(base.likelihood_fit, fitted=replace(base.likelihood_fit.fitted, problem=problem))
    return replace(base, likelihood_fit=fit, validation_log_density=np.array([evidence]))


def archive(base: ScoredModel, *models: ScoredModel) -> Archive:
    return Archive(ROOT, {frozenset(h.names): h for h in (base, *models)})


def test_what_is_removed_stands_for_nothing(base):
    tried = archive(base, model(base, "servo_lag"))
    del tried[LAG]
    assert list(tried) == [ROOT]
    with pytest.raises(KeyError):
        _ = tried[LAG]


def test_children_come_by_their_evidence_and_what_diverges_is_not_ranked(base):
    lag, stall = model(base, "servo_lag", evidence=5.0), model(base, "stall", evidence=9.0)
    lost, both = model(base, "delay", evidence=-np.inf), model(base, "servo_lag", "stall", evidence=7.0)
    tried = archive(base, lag, stall, lost, both)
    assert tried.children(ROOT) == [stall, lag, lost]
    assert tried.children(LAG) == [both]
    assert lost not in tried.ranked()
    assert tried.most_evident() is max((base, stall), key=lambda h: h.log_evidence)


def test_a_model_is_thinned_again_once_its_evidence_has_grown(base):
    tried = archive(base, both := model(base, "servo_lag", "stall", evidence=3.0))
    assert not tried.is_thinned(both)
    tried.thinned[BOTH] = both.log_evidence
    assert tried.is_thinned(both)
    assert not tried.is_thinned(model(base, "servo_lag", "stall", evidence=4.0))
