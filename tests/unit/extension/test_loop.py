"""The loop: where the first model fails, what was added, and the error step by step; drawn without an empty panel."""

from __future__ import annotations

from pathlib import Path

import pytest
from cli import trial

from fieldsid.comparison.compare import compare_one
from fieldsid.diagnosis.records import Errors, Pair
from fieldsid.extension.extend import Gain
from fieldsid.extension.lineage import INTACT, Generation, Step, loop_of
from fieldsid.figures.drawn import rendered
from fieldsid.figures.loop import figure, panels
from fieldsid.logs import load_run
from fieldsid.models.axis import Axis
from fieldsid.models.model import Noise
from fieldsid.reporting.chart import bars

LAG = {"lag": 0.35}
FLOOR = Noise(0.005, 0.004)


def step(added, before, after):
    pairs = [Pair(Errors(e * 0.005, e * 0.004), Errors(1.1 * e * 0.005, 1.1 * e * 0.004)) for e in (before, after)]
    gain = Gain((added,), *pairs, FLOOR, unseen=True, learned_on=("a",), judged_on=("b",))
    return Generation(Path(f"{added}.yaml"), (added,), INTACT, Step(gain, "unseen"))


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    """The loop of a vehicle whose lag the plain model lacks, over two steps."""
    run = load_run(trial.flown(tmp_path_factory.mktemp("loop"), hidden=("servo_lag", LAG)))
    before, after = compare_one(trial.vehicle(Axis.YAW), run), compare_one(trial.vehicle(Axis.YAW, "servo_lag", **LAG), run)
    line = (Generation(Path("m.yaml"), (), INTACT, None), step("servo_lag", 6.0, 1.5), step("deadband", 1.5, 1.0))
    return loop_of(line, [before], [after])


def test_it_has_an_effect_a_step_on_fitted_and_on_unseen_runs(found):
    assert [(s.added, round(s.fitted, 2), round(s.unseen, 2)) for s in found.steps] == [
        ("plain model", 6.0, 6.6),
        ("+ servo_lag", 1.5, 1.65),
        ("+ deadband", 1.0, 1.1),
    ]
    assert found.added == ("servo_lag", "deadband")


def test_it_is_told_where_the_first_model_fails_and_the_last_is_the_noise(found):
    assert found.where[0].beyond == max(p.beyond for p in found.where)
    assert found.before.over_noise > 3.0
    assert found.after.over_noise < 1.2


def test_no_panel_of_the_figure_is_empty_and_what_stands_out_is_the_longest(found):
    top, bottom, places, fall = rendered(figure(found)).axes
    assert all(ax.has_data() for ax in (top, places, bottom, fall))
    widths = {bar.get_facecolor(): bar.get_width() for bar in places.patches}
    assert len(widths) == 2
    assert max(bar.get_width() for bar in places.patches) == places.patches[0].get_width()
    assert not any("rad" in label.get_text() for label in places.get_yticklabels())


def test_the_report_has_a_bar_and_a_ring_for_each_step(found):
    drawn = bars(panels(found)[-1], "steps")
    assert drawn.count("<rect") == drawn.count('class="ring"') == 3
    assert "+ deadband" in drawn


def test_a_line_that_nothing_was_added_to_has_none(found):
    assert loop_of(found.line[:1], [found.before], [found.after]) is None
