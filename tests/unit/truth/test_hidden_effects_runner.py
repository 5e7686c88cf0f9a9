"""The runner of the blind bank counts right: an oracle scores full marks, one that always cries wolf does not."""

from __future__ import annotations

import importlib.util
import sys
import types
from pathlib import Path
from types import SimpleNamespace

import pytest
from truth.bank import make_case

SCRIPT = Path(__file__).resolve().parents[2] / "benchmarks" / "hidden_effects.py"


@pytest.fixture
def runner():
    spec = importlib.util.spec_from_file_location("hidden_effects_script", SCRIPT)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def answering(monkeypatch, answer):
    """Put a diagnosis in place that answers by itself."""
    module = types.ModuleType("fieldsid.diagnosis")
    module.diagnose = lambda training, axis, validation=(): answer(training, axis, validation)
    monkeypatch.setitem(sys.modules, "fieldsid.diagnosis", module)


def said(verdict, effects, floor):
    rms = SimpleNamespace(angle_rms_rad=floor["angle_rad"], rate_rms_rad_s=floor["rate_rad_s"])
    ranked = [SimpleNamespace(effect=e, probability=0.9) for e in effects]
    return SimpleNamespace(
        verdict=verdict, effects=effects, candidates=ranked, noise_floor=floor, final=SimpleNamespace(validation=rms)
    )


@pytest.mark.slow
def test_an_oracle_gets_every_case_right(runner, monkeypatch, capsys):
    truths = {c.validation[0]["surge_m_s"][0]: c for c in (make_case(i, 6) for i in range(6))}

    def oracle(_training, _axis, validation):
        case = truths[validation[0]["surge_m_s"][0]]
        return said(min(case.expected), list(case.effects), case.floor)

    answering(monkeypatch, oracle)
    assert runner.main(["--cases", "6", "--seed", "6"]) == 0
    out = capsys.readouterr().out
    assert "0 misses" in out
    assert "1.000" in out


def test_one_that_always_says_delay_is_a_false_alarm_and_a_miss(runner, monkeypatch, capsys):
    floor = {"angle_rad": 1.0, "rate_rad_s": 1.0}
    answering(monkeypatch, lambda *_: said("effect", ["delay"], floor))
    runner.main(["--cases", "3", "--seed", "6", "--kind", "none"])
    out = capsys.readouterr().out
    assert "3 misses" in out
    assert "(3/3)" in next(line for line in out.splitlines() if line.startswith("false alarm"))


def test_a_crash_is_counted_and_shown(runner, monkeypatch, capsys):
    def crash(*_):
        raise ValueError("lost the plot")

    answering(monkeypatch, crash)
    runner.main(["--cases", "1", "--seed", "6", "--kind", "none"])
    out = capsys.readouterr().out
    assert "lost the plot" in out
    assert "crashed" in out
