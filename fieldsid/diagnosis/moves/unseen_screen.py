"""Effects that only the validation runs show: screened on all runs together, and started from there.

Where the fitted runs are followed to the noise and the unseen ones far from it, a screen of the fitted runs finds nothing: a
current along one heading is a trim. What an addition is worth is still said by the training runs' fit of it and its predictive
density; here it is only proposed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from fieldsid.diagnosis.evidence.likelihood_fit import fit_output_error
from fieldsid.diagnosis.evidence.scored_model import ScoredModel
from fieldsid.diagnosis.moves.add_effect import (
    MAX_EFFECTS_LATER,
    MIN_OUTPUT_ERROR_COST_SHARE,
    SearchMove,
    first_few,
    iterate_points,
    mechanisms,
)
from fieldsid.diagnosis.parallel_map import ParallelMap
from fieldsid.fitting.initial.effect_screen import carry_parameters, linearise_at, screen_points, with_effect
from fieldsid.fitting.problem.parameters import layout_of, speed_groups
from fieldsid.fitting.problem.problem import Problem
from fieldsid.models.effect import Effect


def moves_of_all_runs(parent: ScoredModel, left: Sequence[Effect], parallel: ParallelMap) -> list[SearchMove]:
    """Return a move for each effect that lowers the output error of training and validation runs together, at most a few."""
    fitted = parent.reported_fit
    old, records = fitted.problem.layout, (*fitted.problem.records, *parent.validation)
    groups = speed_groups(records, snapped=old.groups.snapped, trim_of_fin=old.groups.trim_of_fin)
    layout = layout_of(records, old.axis, old.effects, replace(groups, by_law=True))
    problem = Problem(records, layout, fitted.problem.evaluations)
    start = carry_parameters(layout, (old, fitted.x))
    found = fit_output_error(problem, start, fitted.weights)
    ground = linearise_at(found.problem, found.x, found.weights)
    points = sorted(parallel.map(lambda e: screen_points(ground, e), mechanisms(left)), key=lambda p: p[0].predicted_cost)
    worth = (1.0 - MIN_OUTPUT_ERROR_COST_SHARE) * ground.cost
    first = first_few(points, MAX_EFFECTS_LATER, lambda p: p[0].effect)
    likely = [p[:1] for p in first if p[0].predicted_cost < worth]
    moves = []
    for screened in parallel.map(lambda p: iterate_points(ground, p), likely):
        coefficients = dict(zip(screened.problem.layout.names, screened.start.tolist(), strict=False))
        alone, x = with_effect(fitted.problem, fitted.x, screened.effect, coefficients)
        at = replace(screened, problem=alone, point=x, start=x)
        moves.append(SearchMove(at, ground, by_output_error=False, parent=parent))
    return moves
