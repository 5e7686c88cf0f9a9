"""What a search has tried is kept by spec: nothing is lost when another model stands for the same effects."""

from __future__ import annotations

from dataclasses import replace

import hidden_lag
import numpy as np
import pytest

from fieldsid.diagnosis.evidence.scored_model import ScoredModel
from fieldsid.diagnosis.search.archive import Archive
from fieldsid.diagnosis.search.model_spec import Assumptions, ModelSpec
from fieldsid.diagnosis.search.search import Search
from fieldsid.effects import all_effects
from fieldsid.models.axis import Axis
from fieldsid.models.effect import with_variant
from fieldsid.models.record import record_of

LAG = frozenset({"servo_lag"})
AT_SEA, COLOURED = Assumptions("disturbance", True), Assumptions("sensors", True)


@pytest.fixture(scope="module")
def base() -> ScoredModel:
    """The model without effects of runs with a hidden lag."""
    training, unseen = hidden_lag.runs()
    learned, checked = (tuple(record_of(r, Axis.YAW) for r in runs) for runs in (training, [unseen]))
    return Search(learned, checked, Axis.YAW, []).base()


def lagging(base: ScoredModel, *, variant: bool = False, evidence: float = 0.0, assumptions: Assumptions = AT_SEA) -> ScoredModel:
    """A model of a servo's lag with a stated gain in evidence: nothing is fitted, only what identifies it is right."""
    lag = all_effects(Axis.YAW)["servo_lag"]
    effect = with_variant(lag, lag.variants[0]) if variant else lag
    problem = base.likelihood_fit.fitted.problem.with_effects([effect])
    groups = replace(problem.layout.groups, trim_of_fin=assumptions.trim_of_fin)
    problem = replace(problem, layout=replace(problem.layout, groups=groups))
    fitted = replace(base.likelihood_fit.fitted, problem=problem)
    fit = replace(base.likelihood_fit, fitted=fitted, noise_kind=assumptions.noise_kind)
    return replace(base, likelihood_fit=fit, validation_log_density=np.array([evidence]))


def test_a_spec_tells_variants_speed_laws_trims_and_noise_apart(base: ScoredModel) -> None:
    plain = ModelSpec.of(lagging(base))
    assert plain == ModelSpec.of(lagging(base, evidence=7.0))
    others = [
        ModelSpec.of(lagging(base, variant=True)),
        ModelSpec.of(lagging(base, assumptions=COLOURED)),
        ModelSpec.of(lagging(base, assumptions=Assumptions("disturbance", False))),
        replace(plain, by_law=not plain.by_law),
        replace(plain, snapped=not plain.snapped),
    ]
    assert len({plain, *others}) == 6
    assert {spec.names for spec in others} == {LAG}


def test_the_textbook_variant_is_kept_when_another_takes_its_place(base: ScoredModel) -> None:
    tried = Archive(assumptions=AT_SEA)
    tried[LAG] = plain = lagging(base)
    tried[LAG] = formed = lagging(base, variant=True)
    assert tried[LAG] is formed
    assert tried.models[ModelSpec.of(plain)] is plain
    assert len(tried) == 1


def test_only_models_of_the_same_assumptions_are_seen_together(base: ScoredModel) -> None:
    tried = Archive(assumptions=AT_SEA)
    tried[LAG] = at_sea = lagging(base)
    tried.progress.expanded.add(LAG)
    tried.assumptions = COLOURED
    assert LAG not in tried
    assert not tried.progress.expanded
    tried[LAG] = lagging(base, assumptions=COLOURED)
    tried.assumptions = AT_SEA
    assert tried[LAG] is at_sea
    assert tried.progress.expanded == {LAG}
    assert tried.noise_kinds == {"disturbance", "sensors"}


def test_output_error_fits_are_shared_by_the_kinds_of_noise_and_not_by_the_trim_laws(base: ScoredModel) -> None:
    tried = Archive(assumptions=AT_SEA)
    tried.free_runs.screened.add(LAG)
    tried.assumptions = COLOURED
    assert tried.free_runs.screened == {LAG}
    tried.assumptions = Assumptions("disturbance", False)
    assert not tried.free_runs.screened


def test_what_is_removed_stands_for_nothing(base: ScoredModel) -> None:
    tried = Archive(assumptions=AT_SEA)
    tried[LAG] = lagging(base)
    del tried[LAG]
    assert LAG not in tried
    with pytest.raises(KeyError):
        _ = tried[LAG]
