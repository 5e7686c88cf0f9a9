"""The accepted effects of models, and the log evidence of each accepted set."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from fieldsid.diagnosis.evidence.acceptance import is_accepted, lowers_error, worst_error
from fieldsid.diagnosis.evidence.noise_kind import sensor_noise
from fieldsid.diagnosis.evidence.scored_model import ScoredModel
from fieldsid.diagnosis.moves.archive import Archive, Names
from fieldsid.diagnosis.thresholds import EXPLAINED_ERROR_RATIO, SUFFICIENT_ERROR_RATIO
from fieldsid.models.model import Noise


@dataclass(frozen=True, slots=True)
class AcceptedSets:
    """The accepted sets of an archive over a noise floor, at the time of the call."""

    evidences: Mapping[Names, float]
    """The log evidence of each accepted set: log sum exp over the models whose accepted effects are that set."""

    @classmethod
    def of(cls, tried: Archive, floor: Noise) -> AcceptedSets:
        """Return the accepted sets of an archive that contains the base."""
        sums: dict[Names, float] = {}
        for h in tried.ranked():
            core = core_of(h, tried, floor)
            sums[core] = float(np.logaddexp(sums.get(core, -np.inf), h.log_evidence))
        return cls(sums)

    @property
    def best(self) -> Names:
        """The set of the highest log evidence."""
        return max(self.evidences, key=lambda k: self.evidences[k])


def core_of(h: ScoredModel, tried: Archive, floor: Noise) -> Names:
    """Return the accepted effects of a model: effects without which the model is as good are removed, one at a time.

    An effect that gains evidence together with all the others is kept where it lowers the error, even if it gains none after a
    small effect has been removed, because the disturbance may then fit both.
    """
    base = tried[tried.known]
    over = sensor_noise(floor, base)
    # where the base has a visible error, any error above the noise must be explained; else only a visible one
    least = EXPLAINED_ERROR_RATIO if worst_error(base, over) > SUFFICIENT_ERROR_RATIO else SUFFICIENT_ERROR_RATIO
    proven = {name for name, w in tried.without_each(h) if is_accepted(w, h, over, least)}

    def is_needed(name: str, without: ScoredModel) -> bool:
        return is_accepted(without, h, over, least) or (name in proven and lowers_error(without, h, over, least))

    while superfluous := [w for name, w in tried.without_each(h) if not is_needed(name, w)]:
        h = max(superfluous, key=lambda w: w.log_evidence)
    return frozenset(h.names)
