"""A current that the fitted runs take for a trim, as they are all flown along one heading, and the unseen ones are not."""

from __future__ import annotations

import numpy as np
import pytest
from truth import maneuvers
from truth.logbook import flown
from truth.noise import Clock
from truth.physics import Physics

from fieldsid.diagnosis.diagnose import diagnose
from fieldsid.diagnosis.evidence.acceptance import validation_error_ratio
from fieldsid.diagnosis.moves.unseen_screen import moves_of_all_runs
from fieldsid.diagnosis.search.search import Search
from fieldsid.diagnosis.thresholds import MAX_VALIDATION_ERROR_RATIO
from fieldsid.effects import all_effects
from fieldsid.logs.run import Run
from fieldsid.models.axis import Axis
from fieldsid.models.record import record_of

CLOCK = Clock(0.1, 400)
HULL = Physics(damping=1.1, authority=-1.2, trim=0.004, nominal_speed=1.4, median_speed=1.4, current_sin=0.012)


def run(name, maneuver, angle, seed):
    log = flown(HULL, CLOCK, maneuver, angle_noise=0.005, rate_noise=0.005, seed=seed, angle=angle)
    log.pop("thrust")
    return Run(name, log.pop("time_s"), log)


@pytest.fixture(scope="module")
def logs():
    pulses = maneuvers.pulses(CLOCK.time)
    fitted = [run("along_1", pulses, 0.0, 1), run("along_2", pulses, 0.05, 2)]
    return fitted, [run("across", maneuvers.zigzag(CLOCK.time, 0.2, 0.3), np.pi / 2.0, 3)]


def test_it_proposes_what_only_the_unseen_runs_show(logs):
    fitted, unseen = ([record_of(r, Axis.YAW) for r in of] for of in logs)
    effects = [e for e in all_effects(Axis.YAW).values() if e.name in ("current", "stall", "deadband", "servo_lag")]
    search = Search(tuple(fitted), tuple(unseen), Axis.YAW, effects)
    base = search.base()
    assert validation_error_ratio(base, search.floor) > MAX_VALIDATION_ERROR_RATIO
    moves = moves_of_all_runs(base, effects, search.parallel)
    assert moves[0].screened.effect.name == "current"
    assert moves[0].screened.problem.records == base.likelihood_fit.fitted.problem.records
    values = dict(zip(moves[0].screened.problem.layout.names, moves[0].screened.start.tolist(), strict=False))
    assert values["current_sin"] == pytest.approx(HULL.current_sin, rel=0.3)


@pytest.mark.slow
def test_a_current_along_one_heading_is_found_by_the_runs_across(logs):
    fitted, unseen = logs
    found = diagnose(fitted, Axis.YAW, unseen)
    assert found.effects == ("current",)
