"""Whether the trim of runs at several speeds is an offset of the fin, which scales with the authority, or a constant moment."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fieldsid.fitting.initial.equation_error import equation_error_start
from fieldsid.fitting.optimise.levenberg_marquardt import levenberg_marquardt
from fieldsid.fitting.optimise.residual_weights import white_weights
from fieldsid.fitting.problem.parameters import SpeedGroups, layout_of, speed_groups
from fieldsid.fitting.problem.problem import Problem
from fieldsid.models.record import Record
from fieldsid.noise.white_floor import white_noise_floor

SPEED_SCATTER_SHARE = 0.003
"""Relative difference of measured speeds within which runs count as flown at one speed."""
MIN_TRIM_LAW_ERROR_GAIN = 2.0
"""Factor by which the product of both channels' errors must fall for the unusual speed law of the trim to be taken."""


def possible_trims(groups: SpeedGroups, *, varying: bool = False) -> tuple[bool, ...]:
    """Return the possible answers to whether the trim scales with the authority, the usual one first.

    In yaw it usually does but need not; in pitch a moment that depends on the speed is an effect. At one speed only the usual
    answer is returned, unless the speeds of the runs differ by more than a speed sensor's error (or `varying`: an effect lets the
    authority vary within a run).
    """
    return (True, False) if groups.trim_of_fin and (varying or speeds_differ_in_group(groups)) else (groups.trim_of_fin,)


def speeds_differ_in_group(groups: SpeedGroups) -> bool:
    """Whether the speeds of the runs differ by more than the error of their measurement."""
    return float(np.ptp(groups.run_speeds)) > SPEED_SCATTER_SHARE * groups.speeds[groups.reference]


def groups_by_trim(records: Sequence[Record]) -> SpeedGroups:
    """Return the speed groups of records, with the speed law of the trim under which the base model has the least error."""
    usual = speed_groups(records)
    trims = possible_trims(usual)
    if len(trims) == 1:
        return usual
    found = [speed_groups(records, trim_of_fin=trim) for trim in trims]
    return min(found, key=lambda g: _error(records, g) * (1.0 if g == usual else MIN_TRIM_LAW_ERROR_GAIN))


def _error(records: Sequence[Record], groups: SpeedGroups) -> float:
    """Return the product of both channels' free-run errors at the base model's best."""
    problem = Problem(tuple(records), layout_of(records, records[0].axis, (), groups))
    x = levenberg_marquardt(problem, equation_error_start(records, problem.layout), white_noise_floor(records)).x
    weights = white_weights(problem, x)
    return weights.angle * weights.rate
