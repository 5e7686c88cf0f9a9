"""Tables, models and fit files become one source of parameters against speed; what cannot be meant is refused."""

from __future__ import annotations

import io
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import norm

from fieldsid.errors import ArtifactError, DataError, FieldsidError, UsageError
from fieldsid.models.axis import Axis
from fieldsid.models.model import Model, Noise, save_model
from fieldsid.models.speed_law import SpeedLaw
from fieldsid.plant.laws.axis_laws import load_laws, save_laws
from fieldsid.plant.parameter_source import draw_values, load_parameter_source, logs_of, source_of_models
from fieldsid.plant.points import distinct_speeds, intended_speeds
from fieldsid.plant.table import read_table
from fieldsid.records.named_inputs import inputs_of

TABLE = """thrust_percent,speed_m_s,a22,b2,C0,b2_std_error
60,1.0,1.1,-0.6,-0.01,0.02
80,1.6,1.0,-1.1,-0.01,0.03
90,2.1,1.1,-1.8,0,0.05
"""


def written(folder, text, name="table.csv"):
    path = folder / name
    path.write_text(text)
    return path


def yaw_model(speed=1.5, effects=(), **values):
    own = {"a22": 1.2, "b2": -1.0, "C0": 0.01} | values
    free = tuple(own)
    covariance = np.diag([(0.02 * abs(v)) ** 2 for v in own.values()])
    known = {"speed_low": speed, "speed_high": speed, "fin_max": 0.26, "rate_max": 0.2, "held_s": 2.0}
    return Model(Axis.YAW, effects, own, dict.fromkeys(own, ""), free, covariance, SpeedLaw(speed), Noise(0.005, 0.005), known)


def test_extra_columns_are_passed_over_and_errors_are_taken(tmp_path):
    axis, points = read_table(written(tmp_path, TABLE))
    assert axis is Axis.YAW
    assert [p.speed for p in points] == [1.0, 1.6, 2.1]
    assert points[0].values == {"a22": 1.1, "b2": -0.6, "C0": -0.01}
    assert points[1].std_errors == {"b2": 0.03}


def test_models_are_the_same_source_in_whatever_order_they_are_given():
    models = {"slow": yaw_model(1.0), "fast_a": yaw_model(2.0), "fast_b": yaw_model(2.0, b2=-1.2)}
    there = source_of_models(list(models.values()), list(models))
    back = source_of_models(list(models.values())[::-1], list(models)[::-1])
    assert there.names == back.names == ("slow", "fast_a", "fast_b")
    assert [m.values for m in there.models] == [m.values for m in back.models]


def test_dash_reads_standard_input(monkeypatch):
    monkeypatch.setattr("sys.stdin", io.StringIO(TABLE))
    assert load_parameter_source([Path("-")]).speeds == pytest.approx([1.0, 1.6, 2.1])


def test_fin_offset_column_stands_in_for_an_absent_trim(tmp_path):
    _, points = read_table(written(tmp_path, "speed_m_s,a22,b2,delta_r0_rad\n1.37,2.15,-1.62,-0.064\n"))
    assert points[0].values["C0"] == pytest.approx(-1.62 * -0.064)


@pytest.mark.parametrize(
    ("text", "word"),
    [
        ("", "not a table"),
        ("a22,b2\n1,2\n", "speed_m_s"),
        ("speed_m_s,foo\n1,2\n", "one axis"),
        ("speed_m_s,b2,d2\n1,2,3\n", "one axis"),
        ("speed_m_s,b2\n1,x\n", "line 2"),
        ("speed_m_s,b2\n1,1\n-1,2\n", "line 3"),
        ("speed_m_s,b2\n", "no rows"),
    ],
)
def test_a_table_that_cannot_be_meant_is_refused_with_three_parts(tmp_path, text, word):
    with pytest.raises(DataError) as caught:
        read_table(written(tmp_path, text))
    assert word in caught.value.what
    assert caught.value.found
    assert caught.value.hint


def test_one_speed_only_gives_no_law_but_shows_the_point(tmp_path):
    source = load_parameter_source([written(tmp_path, "speed_m_s,a22,b2\n1.50,1.0,-0.8\n1.51,1.0,-0.82\n")])
    assert source.laws is None
    with pytest.raises(DataError) as caught:
        source.fitted()
    assert "one speed only" in caught.value.what
    assert "b2 = -0.8" in caught.value.found


def test_authority_of_opposite_signs_is_refused_naming_the_rows(tmp_path):
    with pytest.raises(DataError, match="sign of b2") as caught:
        load_parameter_source([written(tmp_path, TABLE.replace("-1.1,", "1.1,"))])
    assert "row 2: b2 = 1.1" in caught.value.found


def authority_model(speed, b2, error):
    values = {"a22": 1.0, "b2": b2, "C0": 0.0}
    covariance = np.diag([0.01, error**2, 1e-6])
    return Model(Axis.YAW, (), values, {}, tuple(values), covariance, SpeedLaw(speed), Noise(0.01, 0.01))


def test_a_model_whose_fin_has_no_known_sign_is_left_out_where_it_disagrees():
    models = [authority_model(1.0, -0.5, 0.02), authority_model(1.5, 20.0, 750.0), authority_model(2.0, -2.0, 0.05)]
    source = source_of_models(models, ["a", "b", "c"])
    assert source.left_out == ("b",)
    assert list(source.speeds) == [1.0, 2.0]
    alike = source_of_models([models[0], authority_model(1.5, -1.0, 5.0)], ["a", "b"])
    assert alike.left_out == ()
    with pytest.raises(DataError, match="sign of b2"):
        source_of_models([models[0], authority_model(1.5, 20.0, 2.0)], ["a", "b"])


def joint_model(speeds, b2s, error):
    """Return a model of two speed groups, the later one its reference."""
    (low, high), (at_low, at_high) = speeds, b2s
    model = authority_model(high, at_high, error)
    info = {"law_parameters": {f"b2@{low:.3g}": {"std_error": error}}}
    return replace(model, law=SpeedLaw(high, points=((low, at_low), (high, at_high))), info=info)


def test_a_joint_model_that_disagrees_at_one_of_its_speeds_is_left_out_and_weak_ones_that_agree_stay():
    models = [
        authority_model(1.0, -0.5, 0.02),
        joint_model((1.2, 1.5), (0.003, -0.001), 0.4),
        joint_model((1.6, 2.0), (-0.4, -0.6), 0.5),
    ]
    source = source_of_models(models, ["a", "b", "c"])
    assert source.left_out == ("b",)
    assert source.speeds.tolist() == [1.0, 1.6, 2.0]
    with pytest.raises(DataError, match="sign of b2"):  # each knows its sign at one speed, and not the same
        source_of_models([models[0], joint_model((1.2, 1.5), (0.3, 0.4), 0.05)], ["a", "b"])
    with pytest.raises(DataError, match="sign of b2"):  # none knows
        source_of_models(models[1:], ["b", "c"])


@pytest.mark.parametrize(("t_values", "kept"), [((-2.5, -3.0, -1.0), ["a", "c"]), ((2.5, 3.0, 1.0), ["b"])])
def test_where_no_model_knows_the_sign_of_its_fin_the_runs_of_all_tell_it(t_values, kept):
    unclear = [authority_model(1.0, -0.5, 0.4), authority_model(1.5, 20.0, 750.0), authority_model(2.0, -2.0, 5.0)]
    models = [replace(m, trained={"fin_t": t}) for m, t in zip(unclear, t_values, strict=True)]
    source = source_of_models(models, ["a", "b", "c"])
    assert list(source.names) == kept
    assert sorted((*source.names, *source.left_out)) == ["a", "b", "c"]


def test_runs_that_do_not_tell_the_sign_of_the_fin_leave_it_refused():
    unclear = [authority_model(1.0, -0.5, 0.4), authority_model(1.5, 20.0, 750.0)]
    with pytest.raises(DataError, match="sign of b2"):
        source_of_models([replace(m, trained={"fin_t": -1.5}) for m in unclear], ["a", "b"])


def test_a_model_that_is_left_out_stays_so_in_a_fit_file_and_is_named(tmp_path):
    odd = joint_model((1.2, 1.5), (0.003, -0.001), 0.4)
    given = {"odd": odd, "a": authority_model(1.0, -0.5, 0.02), "c": authority_model(2.0, -2.0, 0.05)}
    paths = [save_model(m, tmp_path / f"{n}.yaml") for n, m in given.items()]
    source = load_parameter_source(paths)
    assert [p.stem for p in source.paths] == ["a", "c", "odd"]
    laws = source.fitted()
    assert [n.code for n in laws.notes] == ["model_left_out"]
    again = load_parameter_source([save_laws(laws, tmp_path / "law.yaml", models=source.paths)])
    assert again.left_out == ("odd",)
    assert again.names == ("a", "c")


def test_models_of_two_axes_are_refused(tmp_path):
    yaw = save_model(yaw_model(), tmp_path / "yaw.yaml")
    pitch = Model(
        Axis.PITCH, (), {"c22": 1.0, "c23": 0.1, "d2": 1.0, "Cb": 0.0}, {}, (), np.zeros((0, 0)), SpeedLaw(1.5), Noise(0.01, 0.01)
    )  # fmt: skip
    with pytest.raises(DataError, match="one axis"):
        load_parameter_source([yaw, save_model(pitch, tmp_path / "pitch.yaml")])


def test_a_model_without_speed_is_refused(tmp_path):
    path = save_model(yaw_model(speed=float("nan")), tmp_path / "model.yaml")
    with pytest.raises(DataError, match="does not know its speed"):
        load_parameter_source([path])


def test_models_give_points_with_their_errors(tmp_path):
    paths = [save_model(yaw_model(u, b2=-0.4 * u**2), tmp_path / f"m{i}.yaml") for i, u in enumerate((1.0, 1.5, 2.0))]
    source = load_parameter_source(paths)
    assert source.speeds == pytest.approx([1.0, 1.5, 2.0])
    assert source.points[2].std_errors["b2"] == pytest.approx(0.02 * 1.6)
    assert source.laws.authority.chosen == "through_zero"
    assert source.laws.authority.exponent.value == pytest.approx(2.0)


def test_laws_come_back_from_their_file(tmp_path):
    source = load_parameter_source([written(tmp_path, TABLE)])
    path = save_laws(source.laws, tmp_path / "law.yaml", inputs=[tmp_path / "table.csv"])
    again = load_laws(path)
    assert again.at(1.3) == pytest.approx(source.laws.at(1.3), rel=1e-5)
    assert again.std(1.3) == pytest.approx(source.laws.std(1.3), rel=1e-4)
    assert load_parameter_source([path]).base_at(1.9) == pytest.approx(source.laws.at(1.9), rel=1e-5)


def test_a_fit_file_with_a_missing_key_is_refused(tmp_path):
    path = save_laws(load_parameter_source([written(tmp_path, TABLE)]).laws, tmp_path / "law.yaml")
    path.write_text(path.read_text().replace("chosen:", "chose:"))
    with pytest.raises(ArtifactError, match="not a complete fit file"):
        load_laws(path)


def test_a_fit_file_carries_its_models_with_effects_covariance_and_logs(tmp_path):
    log = tmp_path / "log.csv"
    log.write_text("x\n")
    paths = []
    for i, u in enumerate((1.0, 2.0)):
        (tmp_path / str(i)).mkdir()  # two models of one name
        model = yaw_model(u, ("servo_lag",), b2=-0.4 * u**2, lag=0.3)
        paths.append(save_model(model, tmp_path / str(i) / "model.yaml", inputs=[log]))
    path = save_laws(load_parameter_source(paths).laws, tmp_path / "law.yaml", models=paths)
    given, carried = load_parameter_source(paths), load_parameter_source([path])
    assert [m.effects for m in carried.models] == [("servo_lag",)] * 2
    for one, other in zip(given.models, carried.models, strict=True):
        assert one.values == other.values
        assert np.array_equal(one.covariance, other.covariance)
    assert logs_of([path]) == logs_of(paths) == ((str(log), log, None),)


def test_logs_are_found_from_another_folder_and_where_the_trial_was_moved_to(tmp_path, monkeypatch):
    (tmp_path / "day" / "models").mkdir(parents=True)
    (tmp_path / "day" / "runs").mkdir()
    (tmp_path / "day" / "runs" / "log.csv").write_text("x\n")
    monkeypatch.chdir(tmp_path / "day")
    save_model(yaw_model(1.0, ()), Path("models/m.yaml"), inputs=[Path("runs/log.csv")])
    assert logs_of([Path("models/m.yaml")]) == (("runs/log.csv", Path("runs/log.csv"), None),)
    monkeypatch.chdir(tmp_path / "day" / "models")
    assert logs_of([Path("m.yaml")]) == (("runs/log.csv", Path("../runs/log.csv"), None),)
    assert inputs_of(Path("m.yaml")) == (Path("../runs/log.csv"),)
    (tmp_path / "day" / "final" / "speeds").mkdir(parents=True)
    monkeypatch.chdir(tmp_path)
    save_model(yaw_model(1.0, ()), Path("day/final/speeds/m.yaml"), inputs=[Path("day/runs/log.csv")])
    monkeypatch.chdir(tmp_path / "day")  # named from the folder that contains the trial
    assert logs_of([Path("final/speeds/m.yaml")]) == (("day/runs/log.csv", Path("runs/log.csv"), None),)
    monkeypatch.chdir(tmp_path)
    (tmp_path / "day").rename(tmp_path / "moved")
    assert logs_of([Path("moved/models/m.yaml")]) == (("runs/log.csv", Path("moved/runs/log.csv"), None),)
    (tmp_path / "moved" / "runs" / "log.csv").write_text("another\n")
    assert logs_of([Path("moved/models/m.yaml")]) == (("runs/log.csv", None, None),)  # what is there now is another
    assert inputs_of(Path("moved/models/m.yaml")) == ()


def test_a_fit_file_that_does_not_say_what_its_models_carry_is_refused(tmp_path):
    path = save_laws(load_parameter_source([written(tmp_path, TABLE)]).laws, tmp_path / "law.yaml")
    path.write_text(path.read_text().replace("models: []", ""))
    with pytest.raises(ArtifactError, match="effects would be lost") as error:
        load_parameter_source([path])
    assert f"-o {path} --force" in error.value.hint


def test_own_law_overrides_points_and_laws(tmp_path):
    source = load_parameter_source([written(tmp_path, TABLE)], laws=["b2=-0.2,-0.3", "a22=1"])
    assert source.base_at(1.6)["b2"] == pytest.approx(-0.2 - 0.3 * 1.6**2)
    assert source.base_at(1.6)["a22"] == 1.0
    assert source.base_at(1.6)["C0"] == -0.01


@pytest.mark.parametrize("text", ["b2", "b2=x", "q=1", "b2=1,2,3"])
def test_an_own_law_that_cannot_be_meant_is_refused(tmp_path, text):
    with pytest.raises(UsageError, match="--law"):
        load_parameter_source([written(tmp_path, TABLE)], laws=[text])


def test_a_table_with_models_is_refused(tmp_path):
    with pytest.raises(UsageError, match="stands alone"):
        load_parameter_source([written(tmp_path, TABLE), tmp_path / "m.yaml"])


def test_draws_have_the_models_covariance_and_the_first_is_the_model():
    model = yaw_model()
    draws, exponent = draw_values(model, 4000, np.random.default_rng(1))
    assert draws[0] == dict(model.values)
    assert exponent[0] == 1.0
    spread = np.std([d["a22"] for d in draws])
    assert spread == pytest.approx(0.024, rel=0.05)


def test_neighbouring_models_share_a_speed_between_them(tmp_path):
    paths = [save_model(yaw_model(u), tmp_path / f"m{i}.yaml") for i, u in enumerate((2.0, 1.0))]
    source = load_parameter_source(paths)
    assert source.near(1.0) == [(0, 1.0)]
    assert source.near(5.0) == [(1, 1.0)]
    shares = dict(source.near(np.sqrt(2.0)))
    assert shares == pytest.approx({0: 0.5, 1: 0.5})
    assert source.supports(1.5)
    assert not source.supports(2.2)


@given(st.lists(st.floats(0.2, 5.0), min_size=1, max_size=8))
def test_speeds_within_three_percent_count_once(speeds):
    count = distinct_speeds(np.array(speeds))
    assert 1 <= count <= len(set(speeds))


@given(st.text(max_size=200))
def test_any_text_is_a_table_or_a_three_part_error(text):
    stdin = io.StringIO(text)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("sys.stdin", stdin)
        found = outcome(Path("-"))
    assert found == "a table" or all(found)


def outcome(path):
    """`a table`, or the first and last part of the error."""
    try:
        read_table(path)
    except FieldsidError as error:
        return (error.what, error.hint)
    return "a table"


def test_a_draw_outside_the_bounds_is_rejected_and_none_lies_on_one(tmp_path):
    model = replace(yaw_model(effects=("quadratic_damping",), quadratic=0.1), covariance=np.diag([0.4, 0.2, 0.01, 0.3]) ** 2)
    draws, _ = draw_values(model, 800, np.random.default_rng(1))
    quadratic = np.array([d["quadratic"] for d in draws])
    assert len(draws) == 800
    assert quadratic.min() > 0.0
    assert np.unique(quadratic).size == 800
    source = load_parameter_source([save_model(model, tmp_path / "m.yaml")])
    assert source.share_rejected(model.law.reference, 400, 1) == pytest.approx(norm.cdf(-1.0 / 3.0), abs=0.06)


def test_a_tables_draws_keep_the_sign_of_damping_and_authority_and_none_lies_on_a_bound(tmp_path):
    head = "speed_m_s,a22,b2,C0,a22_std_error,b2_std_error,C0_std_error"
    text = f"{head}\n1.0,0.8,-0.6,0.01,0.4,0.1,0.0\n1.5,1.2,-1.4,0.01,0.1,0.1,0.0\n"
    source = load_parameter_source([written(tmp_path, text)])
    drawn = source.base_draws(1.0, 2000, np.random.default_rng(1))
    assert drawn["a22"][0] == 0.8
    assert drawn["a22"].min() > 0.04
    assert np.unique(drawn["a22"]).size == 2000
    assert source.share_rejected(1.0, 2000, 1) == pytest.approx(norm.cdf(0.05 * 2.0 - 2.0), abs=0.02)
    assert source.share_rejected(1.5, 200, 1) == 0.0


@pytest.mark.parametrize(
    ("flown", "meant"),
    [
        ([0.972, 0.999, 1.02], [1.0]),
        ([1.407, 0.996, 1.79], [1.0, 1.4, 1.8]),
        ([1.234], [1.23]),
        ([1.0, 1.04, 1.08, 1.12], [1.02, 1.1]),
    ],
)
def test_speeds_that_were_asked_for_are_read_off_those_that_were_flown(flown, meant):
    assert intended_speeds(np.array(flown)) == meant
