"""What a verdict must be whatever is hidden: consistent with its own table, and the same for the same flight told otherwise."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from truth.bank import make_case

from fieldsid.diagnosis import Diagnosis, diagnose
from fieldsid.diagnosis.thresholds import SUFFICIENT_ERROR_RATIO
from fieldsid.logs.run import Run
from fieldsid.models.axis import Axis

SEED = 4711
SLOW = [
    pytest.param(*of, marks=pytest.mark.slow)
    for of in (("none", 2), ("single", 12), ("single", 5), ("pair", 4), ("uncatalogued", 4))
]
CASES = (("single", 1), *SLOW)
ODD_IN_MIRROR = ("yaw_rad", "yaw_rate_rad_s", "rudder_rad", "roll_rad", "sway_m_s", "y_m")
"""Signals that change their sign where port and starboard are exchanged."""
Log = dict[str, np.ndarray]


@cache
def case(kind: str, index: int):
    return make_case(index, SEED, kind=kind)


def judged(training: list[Log], validation: list[Log], axis: str) -> Diagnosis:
    def runs(logs: list[Log], tag: str) -> list[Run]:
        return [
            Run(f"{tag}{i}", np.asarray(log["time_s"], float), {k: np.asarray(v, float) for k, v in log.items() if k != "time_s"})
            for i, log in enumerate(logs)
        ]

    return diagnose(runs(training, "train"), Axis(axis), runs(validation, "unseen"))


@cache
def found(kind: str, index: int) -> Diagnosis:
    c = case(kind, index)
    return judged(c.training, c.validation, c.axis)


def mirrored(log: Log) -> Log:
    return {k: -np.asarray(v, float) if k in ODD_IN_MIRROR else v for k, v in log.items()}


@pytest.mark.parametrize(("kind", "index"), CASES)
def test_what_is_named_is_the_most_probable_of_the_table_and_nothing_listed_is_better_in_all(kind, index):
    d, accepted = found(kind, index), set(case(kind, index).accepts)
    if kind == "single":
        assert any(accepted & set(c.effects) for c in d.candidates[:3])
    if d.verdict in ("effect", "undecided"):
        named = next(c for c in d.candidates if set(c.effects) == set(d.effects))
        assert named.probability == max(c.probability for c in d.candidates)
        assert named.probability > 0.05
        for c in d.candidates:
            assert not (
                c.score > named.score
                and c.errors.train.over(d.noise_floor) < named.errors.train.over(d.noise_floor)
                and c.errors.validation.over(d.noise_floor) < named.errors.validation.over(d.noise_floor)
            ), (named.effects, c.effects)
        assert d.final.validation.over(d.noise_floor) < d.base.validation.over(d.noise_floor)
    else:
        assert d.effects == ()


@pytest.mark.parametrize(("kind", "index"), CASES)
def test_probabilities_of_all_hypotheses_never_exceed_one(kind, index):
    d = found(kind, index)
    total = sum(c.probability for c in d.candidates)
    assert 0.0 <= total <= 1.0 + 1e-9
    assert total > 0.0 or not d.effects
    assert all(0.0 <= c.explained <= 1.0 for c in d.candidates)


@pytest.mark.parametrize(("kind", "index"), CASES)
def test_sufficient_is_said_only_within_fifteen_percent_of_the_noise(kind, index):
    d = found(kind, index)
    if d.verdict == "sufficient":
        assert max(e.over(d.noise_floor) for e in (d.base.train, d.base.validation)) <= SUFFICIENT_ERROR_RATIO + 0.005


@pytest.mark.parametrize(("kind", "index"), CASES)
def test_the_same_flight_told_otherwise_gets_the_same_verdict(kind, index):
    """The runs in another order, thrust in another unit and, of a yaw, port for starboard: at once, as each takes a search."""
    c, d = case(kind, index), found(kind, index)

    def told_otherwise(logs: list[Log]) -> list[Log]:
        scaled = [{k: 250.0 * v if k == "thrust" else v for k, v in log.items()} for log in reversed(logs)]
        return [mirrored(log) for log in scaled] if c.axis == "yaw" else scaled

    assert any("thrust" in log for log in c.training)
    again = judged(told_otherwise(c.training), told_otherwise(c.validation), c.axis)
    assert (again.verdict, set(again.effects)) == (d.verdict, set(d.effects))
