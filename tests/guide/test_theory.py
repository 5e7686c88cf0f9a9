"""The numbers that the page on the theory gives are the code's, its worked example and its table of a turn's error too."""

from __future__ import annotations

import re

import pytest
from guide.make import GUIDE

from fieldsid.diagnosis import thresholds
from fieldsid.diagnosis.moves import speed_law_search
from fieldsid.fitting import auto_method
from fieldsid.fitting.checks import parameter_checks, score_tests
from fieldsid.fitting.covariance import reml
from fieldsid.fitting.predict import speed_correction
from fieldsid.fitting.problem import parameters
from fieldsid.models.effect import effect_named
from fieldsid.noise import own_moment
from fieldsid.schedule import verify
from fieldsid.turning import model_error, paper_formulas, radius

PAGE = (GUIDE / "theory.md").read_text()
WORDS = " ".join(PAGE.split())
NUMBERS = {
    "prior log odds against an effect": thresholds.ALTERNATIVE_LOG_ODDS,
    "share the free-run error must fall to": thresholds.MAX_ERROR_RATIO,
    "log evidence is divided by, for a probability": thresholds.EVIDENCE_TEMPERATURE,
    "log evidence within which hypotheses are rivals": thresholds.RIVAL_LOG_ODDS,
    "factor of error within which hypotheses predict alike": thresholds.EQUAL_ERROR_RATIO,
    "error over the floor that is visible": thresholds.SUFFICIENT_ERROR_RATIO,
    "p-value below which what is left is no disturbance": thresholds.MIN_P_VALUE,
    "error over the floor below which only a relation counts": thresholds.GUSTY_ERROR_RATIO,
    "unseen over fitted error beyond which no sea is taken for granted": thresholds.MAX_VALIDATION_ERROR_RATIO,
    "share of the excess below which a search looks further": thresholds.MIN_EXPLAINED_SHARE,
    "share of the excess that counts as most of it": thresholds.MAIN_EXPLAINED_SHARE,
    "error that right effects leave, as a share of the base's": thresholds.MISFIT_SHARE,
    "log likelihood per number of a noise kind": reml.PENALTY_PER_PARAMETER,
    "p-value below which `auto` takes no residual for a disturbance": auto_method.MIN_P_VALUE,
    "free-run error of `pem` over that of output error, for `auto`, where a test rejects": auto_method.MAX_FREE_RUN_RATIO,
    "share that a measured speed is off by": speed_correction.MEASURED_SPEED_STD_ERROR,
    "dead band in which the middle of a fin lies, rad": own_moment.DEAD_BAND_RAD,
    "share of the damping that an ignored delay moves at least": score_tests.MIN_BIAS,
    "correlation that is said": parameter_checks.MAX_CORRELATION,
    "width of a group of speeds, log": parameters.GROUP_WIDTH,
    "the same while models are compared": speed_law_search.FINE_GROUP_WIDTH,
    "time constants of the u-turn's ramp": paper_formulas.RISE_TIME_CONSTANTS,
    "share of a turn's rate that counts as reached": model_error.MIN_COVERED_SHARE,
    "draws of a turn": radius.RADIUS_DRAWS,
    "draws of a schedule": verify.VERIFY_DRAWS,
}


def test_the_page_gives_the_codes_numbers():
    section = PAGE.partition("## The numbers in these rules")[2].partition("\n## ")[0]
    given = {name: float(value) for name, value in re.findall(r"^\| ([^|]+) \| ([0-9.]+) \|$", section, re.MULTILINE)}
    assert given == {name: float(value) for name, value in NUMBERS.items()}


def test_the_worked_u_turn_is_the_formulas():
    turn = paper_formulas.u_turn(1.0, 1.0, -0.55, 0.26)
    assert f"`r_max` = {turn.yaw_rate_max:.3f} rad/s" in WORDS
    assert f"R = {turn.radius:.2f} m" in WORDS


ROWS = {
    "u-turn formula": ((), True),
    "settled circle, no effect that shapes the turn": ((), False),
    "settled circle, with sway, quadratic or cross-flow drag": ((effect_named("sway_coupling"),), False),
}


@pytest.mark.parametrize("row", ROWS)
@pytest.mark.parametrize(("f", "h", "d"), [(0.0, 0.0, 0.0), (0.4, 0.2, 0.1), (0.2, 0.7, 0.5)])
def test_the_table_of_a_turns_doubt_is_the_codes(row, f, h, d):
    mean, sd = re.search(rf"^\| {re.escape(row)} \| (.*) \| (.*) \|$", PAGE, re.MULTILINE).groups()
    reach = model_error.DataCoverage(fin=1.0 - d, rate=1.0 - f, hold=1.0 - h, speed_flown=True)
    effects, formula = ROWS[row]
    found = model_error.model_error(effects, reach, formula=formula)
    assert found.mean == pytest.approx(value_of(mean, f, h, d))
    assert found.sd == pytest.approx(value_of(sd, f, h, d))


def value_of(text, f, h, d):
    """The value of one of the page's sums."""
    terms = re.findall(r"([0-9.]+)(?: (f|h|d|max\(f, h\)))?", text)
    return sum(float(number) * {"": 1.0, "f": f, "h": h, "d": d, "max(f, h)": max(f, h)}[of] for number, of in terms)
