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
"""Share by which runs of one speed differ as measured, without that meaning anything."""
MIN_TRIM_LAW_ERROR_GAIN = 2.0
"""What the product of both channels' errors must fall by for a trim that does not go with the speed as it does as a rule."""


def possible_trims(groups: SpeedGroups, *, varying: bool = False) -> tuple[bool, ...]:
    """Return whether the trim may go with the authority, what it does as a rule first: in yaw it does and need not.

    In pitch a moment that goes with the speed is an effect of its own. At one speed nothing tells, unless the runs miss it by
    more than a speed sensor does, or an effect lets the authority vary within a run.
    """
    return (True, False) if groups.trim_of_fin and (varying or speeds_differ_in_group(groups)) else (groups.trim_of_fin,)


def speeds_differ_in_group(groups: SpeedGroups) -> bool:
    """Whether the runs were flown at speeds that differ by more than they do as measured."""
    return float(np.ptp(groups.run_speeds)) > SPEED_SCATTER_SHARE * groups.speeds[groups.reference]


def groups_by_trim(records: Sequence[Record]) -> SpeedGroups:
    """Return the speed groups of records with the trim's law under which the base model's free run errs least."""
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
