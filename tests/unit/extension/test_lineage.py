"""A line of models: read back as it was written, found after a move, and every file that is no longer the same is named."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import hidden_lag
import pytest
from cli.trial import vehicle

from fieldsid.diagnosis.records import Errors, Pair
from fieldsid.errors import ArtifactError
from fieldsid.extension.extend import Extension, Gain
from fieldsid.extension.lineage import CHANGED, INTACT, MISSING, history_of, kept_by, parent_of, save_extension
from fieldsid.logs import load_run, save_run
from fieldsid.models.axis import Axis
from fieldsid.models.model import Noise, load_model, save_model


def gain(added, before, after):
    pairs = [Pair(Errors(e, float("nan")), Errors(1.1 * e, float("nan"))) for e in (before, after)]
    return Gain(added, *pairs, Noise(0.005, 0.004), unseen=True, learned_on=("a",), judged_on=("b",))


@pytest.fixture
def line(tmp_path):
    """Three models in a folder, each extended from the one before, the first addition made from a log."""
    log = save_run(hidden_lag.flown("a", hidden_lag.maneuvers.pulses(hidden_lag.CLOCK.time), 1.4, 1), tmp_path / "a.parquet")
    paths = [save_model(vehicle(Axis.YAW), tmp_path / "m.yaml")]
    effects, values = (), {}
    for name, value, before, after in (("lag", 0.3, 0.03, 0.01), ("quadratic", 0.5, 0.01, 0.006)):
        effects, values = (*effects, {"lag": "servo_lag", "quadratic": "quadratic_damping"}[name]), values | {name: value}
        model = vehicle(Axis.YAW, *effects, **values)
        paths.append(
            save_extension(
                Extension(model, gain(effects[-1:], before, after), 50.0),
                paths[-1].with_name(f"{paths[-1].stem}+{effects[-1]}.yaml"),
                parent=paths[-1],
                training=[load_run(log)],
            )
        )
    return paths


def test_a_line_is_read_back_oldest_first_with_its_errors(line):
    found = history_of(line[-1])
    assert [g.path for g in found] == line
    assert [g.effects for g in found] == [(), ("servo_lag",), ("servo_lag", "quadratic_damping")]
    assert {g.state for g in found} == {INTACT}
    first = found[1].step
    assert first.gain.added == ("servo_lag",)
    assert first.gain.before.validation.angle_rms_rad == pytest.approx(0.033)
    assert first.gain.over_floor == pytest.approx((6.6, 2.2))
    assert first.kept_by == "unseen"
    assert first.changed_data == ()


def test_a_channel_that_was_not_measured_is_left_out_of_the_error(line):
    pair = history_of(line[1])[-1].step.gain.after
    assert pair.train.rate_rms_rad_s != pair.train.rate_rms_rad_s


def test_a_model_without_parent_is_a_line_of_one(line):
    (only,) = history_of(line[0])
    assert only.step is None
    assert parent_of(line[0]) is None


def test_a_folder_may_be_moved_as_a_whole(line, tmp_path):
    moved = tmp_path / "elsewhere"
    moved.mkdir()
    for path in line:
        path.rename(moved / path.name)
    found = history_of(moved / line[-1].name)
    assert [g.state for g in found] == [INTACT] * 3
    assert found[0].path == moved / "m.yaml"


def test_a_parent_that_changed_is_named(line):
    save_model(replace(load_model(line[0]), runs=("other",)), line[0], force=True)
    assert [g.state for g in history_of(line[-1])] == [CHANGED, INTACT, INTACT]
    assert parent_of(line[1]).state == CHANGED


def test_a_parent_that_is_missing_ends_the_line_with_what_its_child_knows(line):
    line[1].unlink()
    found = history_of(line[-1])
    assert [(g.state, g.effects) for g in found] == [(MISSING, ("servo_lag",)), (INTACT, ("servo_lag", "quadratic_damping"))]


def test_a_log_that_changed_since_is_named(line, tmp_path):
    with (tmp_path / "a.parquet").open("ab") as stream:
        stream.write(b"more")
    assert history_of(line[-1])[1].step.changed_data == (str(tmp_path / "a.parquet"),)


def test_a_damaged_account_of_an_extension_is_refused(line):
    text = line[1].read_text().replace("kept_by", "kept_for")
    line[1].write_text(text)
    with pytest.raises(ArtifactError, match="does not say completely how it was extended"):
        history_of(line[1])


@pytest.mark.parametrize(("step", "whole", "reason"), [(True, True, "unseen"), (False, True, "set"), (False, False, "--keep")])
def test_a_step_that_does_not_pay_is_kept_for_the_set_where_that_pays(step, whole, reason):
    one, both = (SimpleNamespace(pays=pays, gain=SimpleNamespace(unseen=True)) for pays in (step, whole))
    assert kept_by(one, both) == reason
