"""Lines with their bands, laws with their exponent, and points that do not belong."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats
from truth.paper import PITCH, YAW

from fieldsid.models.axis import Axis
from fieldsid.plant.laws.axis_laws import fit_laws, law_notes
from fieldsid.plant.laws.parameter_law import authority_law, leave_one_out, other_law
from fieldsid.plant.laws.regression import fit_power_law, fit_powers
from fieldsid.plant.points import Point


def rows_of(table, names):
    return tuple(Point(f"row {i + 1}", r.speed, {n: getattr(r, n) for n in names}, {}) for i, r in enumerate(table))


@pytest.mark.parametrize(
    ("table", "axis", "names", "slope", "intercept"),
    [(YAW, Axis.YAW, ("a22", "b2", "C0"), 0.327, 0.228), (PITCH, Axis.PITCH, ("c22", "c23", "d2", "Cb"), 0.367, 0.564)],
    ids=["table2", "table3"],
)
def test_papers_tables_give_the_papers_lines(table, axis, names, slope, intercept):
    affine = fit_laws(axis, rows_of(table, names)).authority.candidate("affine")
    assert affine.coefficients == pytest.approx([intercept, slope], abs=5e-4)
    assert affine.r2 > 0.98


@pytest.mark.parametrize(("table", "axis", "name"), [(YAW, Axis.YAW, "b2"), (PITCH, Axis.PITCH, "d2")], ids=["yaw", "pitch"])
def test_papers_authority_is_not_u_squared_although_the_line_is_straight(table, axis, name):
    law = fit_laws(axis, rows_of(table, (name,))).authority
    assert law.exponent.interval95[1] < 2.0
    assert law.exponent.p_against_2 < 0.05
    assert "not u^2" in law.exponent.says
    assert any(n.code == "r2_proves_little" for n in law_notes(fit_laws(axis, rows_of(table, (name,)))))


@pytest.mark.parametrize(("intercept", "warned"), [(-0.05, True), (-1e-9, False)])
def test_a_law_crosses_zero_only_where_its_intercept_is_told_from_zero(intercept, warned):
    u = np.array([1.0, 1.4, 1.8, 2.2])
    b2 = intercept + 0.35 * u**2 + 1e-8 * np.array([1.0, -1.0, 0.0, 1.0])
    law = authority_law("b2", 1.0, u, b2, None, list("abcd"))
    assert ("law_crosses_zero" in {n.code for n in law.notes}) is warned


def test_line_agrees_with_scipys_regression_in_value_error_and_r2():
    u = np.array([1.0, 1.3, 1.7, 2.0, 2.4])
    y = 0.2 + 0.3 * u**2 + np.array([0.01, -0.02, 0.015, 0.0, -0.01])
    ours, theirs = fit_powers("affine", (0.0, 2.0), u, y, None), stats.linregress(u**2, y)
    assert ours.coefficients == pytest.approx([theirs.intercept, theirs.slope], rel=1e-12)
    assert np.sqrt(np.diag(ours.covariance)) == pytest.approx([theirs.intercept_stderr, theirs.stderr], rel=1e-10)
    assert ours.r2 == pytest.approx(theirs.rvalue**2, rel=1e-12)


def test_weights_let_a_point_with_a_large_error_pull_little():
    u, y = np.array([1.0, 1.5, 2.0, 2.5]), np.array([0.3, 0.3 * 2.25, 0.3 * 4.0, 0.3 * 6.25 + 1.0])
    error = np.array([0.01, 0.01, 0.01, 10.0])
    assert fit_powers("through_zero", (2.0,), u, y, error).coefficients[0] == pytest.approx(0.3, rel=1e-4)
    assert fit_powers("through_zero", (2.0,), u, y, None).coefficients[0] > 0.4


def test_band_covers_the_law_as_often_as_it_says():
    rng, u, hits = np.random.default_rng(5), np.linspace(1.0, 2.2, 6), 0
    for _ in range(400):
        line = fit_powers("affine", (0.0, 2.0), u, 0.2 + 0.3 * u**2 + 0.05 * rng.standard_normal(6), None)
        low, high = line.band(1.6)
        hits += int(low[0] <= 0.2 + 0.3 * 1.6**2 <= high[0])
    assert 0.92 <= hits / 400 <= 0.98


def test_exponent_interval_covers_the_true_exponent_as_often_as_it_says():
    rng, u, hits = np.random.default_rng(6), np.linspace(1.0, 2.2, 6), 0
    for _ in range(400):
        size = 0.4 * u**2 * (1.0 + 0.04 * rng.standard_normal(6))
        low, high = authority_law("b2", -1.0, u, -size, None, list("abcdef")).exponent.interval95
        hits += int(low <= 2.0 <= high)
    assert 0.92 <= hits / 400 <= 0.98


def test_power_law_gives_back_its_own_exponent():
    u = np.array([0.8, 1.2, 1.9])
    assert fit_power_law(u, 0.7 * u**1.68, None).coefficients == pytest.approx([np.log(0.7), 1.68])


def test_a_point_that_does_not_belong_is_named_and_the_others_are_not():
    u = np.linspace(1.0, 2.4, 8)
    size = 0.2 + 0.3 * u**2 + 0.004 * np.array([1, -1, 1, -1, -1, 1, -1, 1])
    size[3] += 0.25
    labels = [f"run {i}" for i in range(8)]
    law = authority_law("b2", 1.0, u, size, None, labels)
    assert [p.name for p in law.points if not p.belongs] == ["run 3"]


@pytest.mark.parametrize("shift", [0.0, 1e-16, -1e-16])
def test_of_four_points_none_is_judged_by_the_one_degree_that_is_left(shift):
    u = np.array([1.0, 1.4, 1.8, 2.2])
    law = authority_law("b2", -1.0, u, -np.array([0.7, 1.3 + shift, 2.4, 3.1]), None, list("abcd"))
    assert all(p.belongs for p in law.points)
    assert {p.limit for p in law.points} == {np.inf}


def test_of_points_on_a_line_none_is_off_by_the_arithmetic():
    u = np.linspace(1.0, 2.4, 8)
    law = authority_law("b2", 1.0, u, 0.2 + 0.3 * u**2, None, list("abcdefgh"))
    assert all(abs(p.studentised) < 0.01 for p in law.points)


def test_deletion_residual_agrees_with_the_textbook_formula():
    rng, u = np.random.default_rng(2), np.linspace(1.0, 2.0, 7)
    y = 0.1 + 0.3 * u**2 + 0.02 * rng.standard_normal(7)
    line = fit_powers("affine", (0.0, 2.0), u, y, None)
    x = line.columns(u)
    hat, e = np.diag(x @ np.linalg.inv(x.T @ x) @ x.T), y - line.at(u)
    s2 = (e @ e - e**2 / (1 - hat)) / (7 - 2 - 1)
    found = [p.studentised for p in leave_one_out(line, u, y, None, [str(i) for i in range(7)])]
    assert found == pytest.approx(e / np.sqrt(s2 * (1 - hat)), rel=1e-9)


def test_damping_that_rises_is_a_line_and_one_that_scatters_a_constant():
    u = np.linspace(1.0, 2.2, 6)
    scatter = 0.03 * np.array([1, -1, 0.5, -0.5, 1, -1])
    assert other_law("c22", u, 1.8 + 0.35 * u + scatter, None, list("abcdef")).chosen in ("linear", "affine")
    assert other_law("a22", u, 1.05 + scatter, None, list("abcdef")).chosen == "constant"
