"""The verdict on an effect that explains little of a large error."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from fieldsid.diagnosis import verdict
from fieldsid.models.effect import effect_named
from fieldsid.models.model import Noise

FLOOR = Noise(angle=0.005, rate=0.005)


def errors(ratio):
    return SimpleNamespace(mean=ratio, over=lambda _floor: ratio)


def judged(monkeypatch, before, after, p, *, noiseless=False, settled=None, named=("servo_lag",), signals=1.0):
    monkeypatch.setattr(verdict, "reported_noise_floor", lambda *_of: FLOOR)
    monkeypatch.setattr(verdict, "rivals_of", lambda *_of: ())
    monkeypatch.setattr(verdict, "added_effects", lambda *_of: named)
    base = SimpleNamespace(
        names=(),
        selection_errors=errors(before),
        train=errors(before),
        own_moment=0.0,
        log_evidence=0.0,
        unseen_under=lambda _std: (errors(before), errors(before)),
    )
    found = SimpleNamespace(
        names=named,
        effects=[effect_named(n) for n in named],
        selection_errors=errors(after),
        train=errors(after),
        validation=(),
        validation_errors=errors(after),
        own_moment=0.0,
        log_evidence=50.0,
        unseen_under=lambda _std: (errors(after), errors(settled or after)),
    )
    search = SimpleNamespace(floor=FLOOR, root=frozenset(), known=(), base=lambda: base, is_noiseless=noiseless)
    left = SimpleNamespace(p=p, dependence=p, signals=signals)
    return verdict.verdict_of(search, found, left, SimpleNamespace(noise=FLOOR)).word


@pytest.mark.parametrize(("p", "word"), [(0.6, "disturbed"), (1e-4, "unexplained")])
def test_an_effect_that_leaves_more_of_a_large_error_than_it_explains_is_not_what_is_missing(monkeypatch, p, word):
    assert judged(monkeypatch, 3.5, 3.3, p) == word


@pytest.mark.parametrize(("before", "after"), [(3.5, 1.6), (1.45, 1.4), (3.5, 2.4)])
def test_one_that_explains_most_of_it_or_leaves_little_is_named(monkeypatch, before, after):
    assert judged(monkeypatch, before, after, 0.6) == "effect"


def test_without_noise_no_floor_says_what_is_large(monkeypatch):
    assert judged(monkeypatch, 3.5, 3.3, 0.6, noiseless=True) == "effect"


@pytest.mark.parametrize(("settled", "word"), [(1.1, "effect"), (12.0, "unexplained")])
def test_an_error_that_the_fitted_runs_leave_open_counts_with_the_numbers_of_all_runs(monkeypatch, settled, word):
    assert judged(monkeypatch, 7.0, 12.8, 1e-9, settled=settled) == word


@pytest.mark.parametrize(
    ("named", "signals", "word"),
    [
        (("wave",), 1e-6, "unexplained"), (("wave",), 0.3, "effect"), (("roll_coupling",), 1e-6, "effect"),
        (("wave", "servo_lag"), 1e-6, "effect"),
    ],
    ids=str,
)  # fmt: skip
def test_a_wave_alone_is_named_where_what_is_left_follows_no_measured_signal(monkeypatch, named, signals, word):
    """Also where what is left is no larger than a sufficient model may leave."""
    assert judged(monkeypatch, 1.5, 1.1, 0.6, named=named, signals=signals) == word
