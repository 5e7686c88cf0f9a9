"""The numbers that the page on the theory gives are the code's, its worked example and its table of a turn's error too."""

from __future__ import annotations

import re

import pytest
from guide.make import GUIDE

from fieldsid.diagnosis import hypothesis, remainder, verdict, worth
from fieldsid.fitting import choice, layout, own_speed, remarks, restricted, suspects
from fieldsid.schedule import verify
from fieldsid.turning import doubt, formulas, radius

PAGE = (GUIDE / "theory.md").read_text()
WORDS = " ".join(PAGE.split())
NUMBERS = {
    "prior log odds against an effect": hypothesis.PRIOR_ODDS,
    "share the free-run error must fall to": worth.MATTERS,
    "less of it for a third and each further effect": worth.MATTERS_MORE,
    "log evidence is divided by, for a probability": verdict.TEMPER,
    "log evidence within which hypotheses are rivals": verdict.RIVAL,
    "factor of error within which hypotheses predict alike": worth.ALIKE,
    "error over the floor that is visible": verdict.VISIBLE,
    "p-value below which what is left is no disturbance": remainder.BEYOND_CHANCE,
    "error over the floor below which only a relation counts": verdict.FAINT,
    "error over the floor beyond which no sea is taken for granted": verdict.STORM,
    "unseen over fitted error beyond which none is": worth.WORSE,
    "share of the excess that an effect must explain": verdict.MOSTLY,
    "log likelihood per number of a noise kind": restricted.GAIN_NEEDED,
    "share of the slow residual that follows the fin, for `auto`": choice.FOLLOWS,
    "free-run error of `pem` over that of output error, for `auto`": choice.WORST_FREE_RUN,
    "share that a measured speed is off by": own_speed.MEASURED,
    "shortest delay that is said, s": suspects.LEAST_DELAY_S,
    "correlation that is said": remarks.HIGHEST_CORRELATION,
    "width of a group of speeds, log": layout.GROUP_WIDTH,
    "time constants of the u-turn's ramp": formulas.RAMP,
    "share of a turn's rate that counts as reached": doubt.REACHED,
    "draws of a turn": radius.DRAWS,
    "draws of a schedule": verify.DRAWS,
}


def test_the_page_gives_the_codes_numbers():
    section = PAGE.partition("## The numbers in these rules")[2].partition("\n## ")[0]
    given = {name: float(value) for name, value in re.findall(r"^\| ([^|]+) \| ([0-9.]+) \|$", section, re.MULTILINE)}
    assert given == {name: float(value) for name, value in NUMBERS.items()}


@pytest.mark.parametrize("share", [0.7, 0.6, 0.3])
def test_the_page_says_what_an_effect_must_explain(share):
    (p,) = (p for enough, p in verdict.BESIDE if enough == share)
    (said,) = re.findall(rf"less than {100 * share:.0f} % (?:of the excess error [a-z- ]* below|and) ([0-9.e-]+[0-9])", WORDS)
    assert float(said) == p


def test_the_worked_u_turn_is_the_formulas():
    turn = formulas.u_turn(1.0, 1.0, -0.55, 0.26)
    assert f"`r_max` = {turn.yaw_rate_max:.3f} rad/s" in WORDS
    assert f"R = {turn.radius:.2f} m" in WORDS


ROWS = {
    "u-turn formula": ((), True),
    "settled circle, no effect that shapes the turn": ((), False),
    "settled circle, with sway, quadratic or cross-flow drag": (("sway_coupling",), False),
}


@pytest.mark.parametrize("row", ROWS)
@pytest.mark.parametrize(("f", "h", "d"), [(0.0, 0.0, 0.0), (0.4, 0.2, 0.1), (0.2, 0.7, 0.5)])
def test_the_table_of_a_turns_doubt_is_the_codes(row, f, h, d):
    mean, sd = re.search(rf"^\| {re.escape(row)} \| (.*) \| (.*) \|$", PAGE, re.MULTILINE).groups()
    reach = doubt.Reach(fin=1.0 - d, rate=1.0 - f, hold=1.0 - h, speed_flown=True)
    effects, formula = ROWS[row]
    found = doubt.doubt_of(effects, reach, formula=formula)
    assert found.mean == pytest.approx(value_of(mean, f, h, d))
    assert found.sd == pytest.approx(value_of(sd, f, h, d))


def value_of(text, f, h, d):
    """The value of one of the page's sums."""
    terms = re.findall(r"([0-9.]+)(?: (f|h|d|max\(f, h\)))?", text)
    return sum(float(number) * {"": 1.0, "f": f, "h": h, "d": d, "max(f, h)": max(f, h)}[of] for number, of in terms)
