"""Whether the trim of runs at several speeds is a bent fin's, which goes with the authority, or a moment that stays."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fieldsid.fitting.descent import descend
from fieldsid.fitting.layout import Groups, layout_of, speed_groups
from fieldsid.fitting.noise import floor_of
from fieldsid.fitting.problem import Problem
from fieldsid.fitting.start import start_vector
from fieldsid.fitting.weights import white_weights
from fieldsid.models.record import Record

SCATTER = 0.003
"""Share by which runs of one speed differ as measured, without that meaning anything."""
UNUSUAL = 2.0
"""What the product of both channels' errors must fall by for a trim that does not go with the speed as it does as a rule."""


def possible_trims(groups: Groups, *, varying: bool = False) -> tuple[bool, ...]:
    """Return whether the trim may go with the authority, what it does as a rule first: in yaw it does and need not.

    In pitch a moment that goes with the speed is an effect of its own. At one speed nothing tells, unless the runs miss it by
    more than a speed sensor does, or an effect lets the authority vary within a run.
    """
    return (True, False) if groups.trim_of_fin and (varying or miss_their_speed(groups)) else (groups.trim_of_fin,)


def miss_their_speed(groups: Groups) -> bool:
    """Whether the runs were flown at speeds that differ by more than they do as measured."""
    return float(np.ptp(groups.run_speeds)) > SCATTER * groups.speeds[groups.reference]


def groups_by_trim(records: Sequence[Record]) -> Groups:
    """Return the speed groups of records with the trim's law under which the base model's free run errs least."""
    usual = speed_groups(records)
    trims = possible_trims(usual)
    if len(trims) == 1:
        return usual
    found = [speed_groups(records, trim_of_fin=trim) for trim in trims]
    return min(found, key=lambda g: _error(records, g) * (1.0 if g == usual else UNUSUAL))


def _error(records: Sequence[Record], groups: Groups) -> float:
    """Return the product of both channels' free-run errors at the base model's best."""
    problem = Problem(tuple(records), layout_of(records, records[0].axis, (), groups))
    x = descend(problem, start_vector(records, problem.layout), floor_of(records)).x
    weights = white_weights(problem, x)
    return weights.angle * weights.rate
