"""The user's own effect: what is read, what is refused and where, and what is said when it goes wrong in flight."""

from __future__ import annotations

import os
import pickle
from pathlib import Path
from types import MappingProxyType

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fieldsid.effects import add_effects, all_effects, forget_effects, pick_effect
from fieldsid.effects._expression import parse
from fieldsid.effects._user_file import SIGNAL_OF, effect_of, load_user_effect
from fieldsid.effects._user_folder import add_user_effects
from fieldsid.errors import EffectError, UsageError
from fieldsid.models.axis import Axis
from fieldsid.models.effect import Motion, Stage
from fieldsid.models.record import Record
from fieldsid.registry import refused

TEMPLATE = Path(__file__).resolve().parents[3] / "templates" / "effect.yaml"
K = {"k": {"unit": "1/rad", "low": -5.0, "high": 5.0, "start": 0.1}}
TIME = np.arange(10.0, 20.0, 0.5)


@pytest.fixture(autouse=True)
def _forget():
    yield
    forget_effects()


def spec(moment: str = "-k * r * abs(r)", **more):
    return {"name": "own_drag", "moment": moment, "coefficients": K, **more}


def made(moment: str = "-k * r * abs(r)", **more):
    return effect_of(spec(moment, **more), origin="test")


def record(**signals) -> Record:
    none, ok = np.zeros(TIME.size), np.ones(TIME.size, bool)
    helpers = MappingProxyType({k: np.asarray(v, float) for k, v in signals.items()})
    return Record("made", Axis.YAW, TIME, none + 0.2, True, False, none, none, ok, ok, none, ~ok, helpers, 1.5)


def moment_of(text: str, *, rate=0.5, k=2.0, **signals) -> np.ndarray:
    motion = Motion(np.full(TIME.size, 0.3), np.full(TIME.size, rate))
    return made(text).moment(motion, {"k": k}, record(**signals))


def test_the_template_is_an_effect_that_needs_roll():
    effect = load_user_effect(TEMPLATE)
    assert effect.stage is Stage.HYDRODYNAMICS
    assert effect.axes == (Axis.YAW,)
    assert effect.needs == ("roll",)
    assert effect.coefficients[0].unit == "1/(rad s)"
    assert effect.origin == str(TEMPLATE)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("-k * r * abs(r)", -0.5),
        ("k * rate ** 2 - 1", -0.5),
        ("k * min(max(r, -0.1), 0.1)", 0.2),
        ("k * sin(psi) / cos(angle)", 2.0 * np.tan(0.3)),
        ("k * sign(delta) * sqrt(fin + 0.05)", 1.0),
        ("k * exp(0 * t) * tanh(0) + 1e-1", 0.1),
        ("k * +r - -r", 1.5),
        ("k", 2.0),
        ("k * phi + z * u - thrust", 2.0 * 0.1 + 3.0 * 2.0 - 7.0),
    ],
)
def test_expressions_are_worth_what_they_say(text, expected):
    full = {n: np.full(TIME.size, x) for n, x in {"roll": 0.1, "depth": 3.0, "surge": 2.0, "thrust": 7.0}.items()}
    np.testing.assert_allclose(moment_of(text, **full), expected)


def test_time_counts_from_the_first_sample():
    np.testing.assert_allclose(moment_of("k * t"), 2.0 * (TIME - 10.0))


def test_the_names_used_say_axis_and_needs():
    assert made("k * q * theta").axes == (Axis.PITCH,)
    assert made("k * rate").axes == (Axis.YAW, Axis.PITCH)
    assert made("k * u * phi * z * thrust").needs == ("surge", "roll", "depth", "thrust")


@pytest.mark.parametrize(("name", "state"), [("v", "sway_coupling"), ("w", "heave_coupling"), ("cross", "sway_coupling")])
def test_a_moment_of_the_hulls_own_cross_speed_is_refused_with_the_effect_that_has_it_as_a_state(name, state):
    with pytest.raises(EffectError, match=f"`{name}` cannot drive a moment") as caught:
        made(f"k * u * {name}")
    assert caught.value.found == f"k * u * {name}"
    assert f"`{state}`" in caught.value.hint


def test_a_coefficient_cannot_be_called_as_the_cross_speed_is():
    with pytest.raises(EffectError, match="has the name of a signal"):
        made("v * r", coefficients={"v": K["k"]})


def test_an_effect_of_ones_own_is_picklable_and_works_after_it():
    effect = pickle.loads(pickle.dumps(made()))  # noqa: S301
    motion = Motion(np.zeros(TIME.size), np.full(TIME.size, -2.0))
    np.testing.assert_allclose(effect.moment(motion, {"k": 1.0}, record()), 4.0)


@pytest.mark.parametrize(
    ("text", "column", "word"),
    [
        ("k * rr", 4, "did you mean `r`"),
        ("k * abs(kk)", 8, "no signal or coefficient `kk`"),
        ("k * sine(r)", 4, "did you mean `sin`"),
        ("k * r ^ 2", 0, "`**`"),
        ("k * (r", 4, "cannot be read here"),
        ("k * r.real", 4, "a dot"),
        ("k * r[0]", 4, "an index"),
        ("k * (r > 1)", 5, "a comparison"),
        ("__import__('os').system('true')", 0, "only the listed functions"),
        ("(lambda: k)()", 0, "only the listed functions"),
        ("k * 'text'", 4, "not a plain number"),
        ("k * 1j", 4, "not a plain number"),
        ("k * True", 4, "not a plain number"),
        ("k * 1e999", 4, "not a plain number"),
        ("k * abs", 4, "needs (...)"),
        ("k * min(r)", 4, "takes 2 arguments"),
        ("k * sin(x=r)", 4, "takes 1 argument"),
        ("k if r else 1", 0, "`if`"),
        ("[k for k in r]", 0, "not allowed"),
        ("k % r", 0, "operator Mod"),
        ("not k", 0, "not allowed"),
    ],
)
def test_whatever_is_not_arithmetic_is_refused_with_its_place(text, column, word):
    with pytest.raises(EffectError) as caught:
        made(text)
    assert word in str(caught.value)
    shown, caret = caught.value.found.split("\n")
    assert shown == text
    assert caret.index("^") == column


@pytest.mark.parametrize("text", ["", "   ", "k + " * 200 + "k", "(" * 240 + "k" + ")" * 240, "-" * 490 + "k", "k\0"])
def test_an_empty_endless_or_mangled_expression_is_refused_or_read_without_a_crash(text):
    try:
        names = parse(text, ["k"]).names
    except EffectError as error:
        names = {"k"} if error.hint else set()
    assert names == {"k"}


@settings(max_examples=200, deadline=None)
@given(st.text(alphabet="krtu0123456789.+-*/()^ ,absin_[]{}'\"\n:=", max_size=60))
def test_no_text_gets_past_the_parser_but_arithmetic(text):
    try:
        expression = parse(text, (*SIGNAL_OF, "k"))
    except EffectError:
        return
    try:
        shape = expression.at(dict.fromkeys(expression.names, np.ones(3)), np.arange(3.0)).shape
    except EffectError as error:
        shape = (3,) if "divides by zero" in str(error) else ()
    assert shape == (3,)


def test_a_division_by_zero_names_time_and_place():
    surge = np.ones(TIME.size)
    surge[4] = 0.0
    with pytest.raises(EffectError, match=r"divides by zero at t = 12.000 s: `u` is 0") as caught:
        moment_of("k * r / u", surge=surge)
    assert caught.value.found.endswith("\n" + " " * len("k * r / ") + "^")


def test_a_root_of_a_negative_number_names_the_time_and_the_values():
    with pytest.raises(EffectError, match=r"is not a number: nan rad/s\^2 at t = 10.000 s") as caught:
        moment_of("k * sqrt(r)", rate=-1.0)
    assert "r = -1" in caught.value.found


def test_growth_without_bound_names_the_time_and_the_value():
    with pytest.raises(EffectError, match=r"grows without bound: 4.405e\+04 rad/s\^2 at t = 12.000 s"):
        moment_of("k * exp(5 * t)")


@pytest.mark.parametrize(
    ("change", "word"),
    [
        ({"coefficients": {}}, "must map each name"),
        ({"coefficients": {"k": 3}}, "must have unit"),
        ({"coefficients": {"k": {"unit": "1", "low": 1, "high": 0, "start": 0}}}, "low < high"),
        ({"coefficients": {"k": {"unit": "1", "low": 0, "high": 1, "start": 2}}}, "start between them"),
        ({"coefficients": {"k": {"unit": "1", "low": 0, "high": 1}}}, "lacks `start`"),
        ({"coefficients": {"k": {"unit": "1", "low": "a", "high": 1, "start": 0}}}, "must be a number"),
        ({"coefficients": {"k": {"unit": "1", "lo": 0, "high": 1, "start": 0}}}, "did you mean `low`"),
        ({"coefficients": {"r": K["k"]}}, "name of a signal"),
        ({"coefficients": {"sin": K["k"]}}, "name of a signal or function"),
        ({"coefficients": {**K, "m": K["k"]}}, "`m` is not used"),
        ({"coefficients": {"a b": K["k"]}}, "letters, digits"),
        ({"name": "Bad Name"}, "letters, digits"),
        ({"moment": 3.0}, "must be text"),
        ({"moment": "k * r * q"}, "mixes yaw and pitch"),
        ({"axes": ["pitch"]}, "yaw signals only"),
        ({"axes": ["roll"]}, "must list yaw, pitch"),
        ({"momnet": "k"}, "did you mean `moment`"),
        ({"excited_by": 3}, "list of names"),
    ],
)
def test_a_wrong_description_is_refused_by_its_key(change, word):
    with pytest.raises(EffectError) as caught:
        effect_of(spec() | change, origin="test")
    assert word in str(caught.value)


def test_a_coefficient_must_not_take_a_base_parameters_name():
    with pytest.raises(EffectError, match="base parameter"):
        effect_of({"name": "own", "moment": "b2 * r", "coefficients": {"b2": K["k"]}}, origin="test")


def folder_of(path: Path, text: str) -> tuple[set[str], list[str]]:
    """Return the user's effects that are known once a second file says so, and what is wrong with the others."""
    (path / "two.yml").write_text(text)
    forget_effects()
    add_user_effects(path)
    return {n for n, e in all_effects().items() if e.origin != "built in"}, [error.what for error in refused()]


ONE = "name: one\nmoment: '-one_k*r'\ncoefficients: {one_k: {unit: 1/s, low: 0, high: 1, start: 0.1}}\n"


def test_a_folder_gives_its_effects_and_a_broken_file_only_its_error(tmp_path):
    add_user_effects(tmp_path / "absent")
    assert refused() == ()
    (tmp_path / "one.yaml").write_text(ONE)
    (tmp_path / "notes.txt").write_text("not an effect")
    assert folder_of(tmp_path, ONE.replace("one", "two")) == ({"one", "two"}, [])
    names, errors = folder_of(tmp_path, ONE.replace("one", "two").replace("*r", "*rr"))
    assert (names, errors) == ({"one"}, [f"`{tmp_path}/two.yml`: there is no signal or coefficient `rr`"])
    with pytest.raises(EffectError, match=r"two.yml`: there is no signal"):
        pick_effect("two")
    assert folder_of(tmp_path, "name: [one\n") == ({"one"}, [f"`{tmp_path}/two.yml` is not valid YAML"])
    assert folder_of(tmp_path, ONE + 'source: "\\UFFFFFFFF"\n') == (
        {"one"},
        [f"`{tmp_path}/two.yml` holds a value that YAML cannot read"],
    )


def test_neither_of_two_files_that_give_one_name_is_taken(tmp_path):
    (tmp_path / "one.yaml").write_text(ONE)
    assert folder_of(tmp_path, ONE) == (set(), ["2 files give an effect named 'one'"])
    with pytest.raises(EffectError, match="2 files give") as caught:
        pick_effect("one")
    assert caught.value.found == f"{tmp_path}/one.yaml and {tmp_path}/two.yml"


def test_a_folder_or_a_file_that_the_system_does_not_give_is_kept_as_an_error(tmp_path, monkeypatch):
    (tmp_path / "one.yaml").write_text(ONE)

    def denied(*_arguments, **_options):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(os, "open", denied)
    assert folder_of(tmp_path, ONE)[1] == [f"`{tmp_path}/{n}` cannot be read: Permission denied" for n in ("one.yaml", "two.yml")]
    monkeypatch.setattr(Path, "iterdir", denied)
    assert folder_of(tmp_path, ONE)[1] == [f"the folder `{tmp_path}` cannot be read: Permission denied"]


@pytest.mark.parametrize("name", ["lambda", "Bad-Name", "none", "9x", "", "a" * 41, 7])
def test_a_name_no_effect_can_have_is_refused_with_one_it_can_have(name):
    with pytest.raises(EffectError) as caught:
        effect_of(spec() | {"name": name}, origin="test")
    better = caught.value.hint.removeprefix("call it `").removesuffix("`")
    assert effect_of(spec() | {"name": better}, origin="test").name == better


def test_an_own_effect_is_found_by_name_until_it_is_forgotten():
    add_effects([made()])
    assert pick_effect("own_drag").origin == "test"
    assert "own_drag" in all_effects(Axis.YAW)
    assert "own_drag" not in all_effects(Axis.PITCH)
    add_effects([made(says="read again")])
    assert pick_effect("own_drag").says == "read again"
    forget_effects()
    with pytest.raises(UsageError, match="no effect named"):
        pick_effect("own_drag")


def test_a_taken_name_is_refused():
    with pytest.raises(EffectError, match="'stall' is taken"):
        add_effects([effect_of(spec() | {"name": "stall"}, origin="test")])
    lag = {"name": "own", "moment": "lag * r", "coefficients": {"lag": K["k"]}}
    with pytest.raises(EffectError, match="a name of effect 'servo_lag'") as caught:
        add_effects([effect_of(lag, origin="test")])
    assert "`own_lag`" in caught.value.hint


def test_a_mistyped_name_is_answered_with_the_near_one():
    with pytest.raises(UsageError, match="did you mean `servo_lag`"):
        pick_effect("servo_lagg")


@pytest.mark.skipif(os.geteuid() == 0, reason="root reads every file")
def test_a_file_that_cannot_be_read_is_named(tmp_path):
    path = tmp_path / "own.yaml"
    path.write_text("name: own")
    path.chmod(0)
    with pytest.raises(EffectError, match="cannot be read"):
        load_user_effect(path)
