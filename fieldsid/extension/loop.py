"""The loop in one record: where the first model of a line fails, what was added, and how the error fell, an effect a step."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import degrees
from typing import Annotated

from fieldsid.comparison.compare import Comparison
from fieldsid.comparison.localize import Place
from fieldsid.diagnosis.records import Errors, Pair
from fieldsid.display import Brief
from fieldsid.extension.lineage import Generation
from fieldsid.models.model import Noise
from fieldsid.records.keys import Key, Number
from fieldsid.rounding import MANY


@dataclass(frozen=True, slots=True)
class LoopStep:
    """A model of the line: what was added, and its error over the noise floor on the runs fitted to and on unseen ones.

    In a log without noise the errors are over those of the first model; `says` has them in their units there.
    """

    added: Annotated[str, Key("What was added; of the first model its effects.")]
    fitted: Annotated[Number, Key("The error on the runs fitted to.")]
    unseen: Annotated[Number, Key("The error on unseen runs.")]
    says: tuple[str, str]


@dataclass(frozen=True, slots=True, repr=False)
class Loop(Brief):
    """The same run by the first model of a line and by its last, and the line."""

    before: Comparison
    after: Comparison
    line: tuple[Generation, ...]

    @property
    def run(self) -> Annotated[str, Key()]:
        """The run that it is shown on."""
        return self.before.run

    @property
    def start(self) -> str:
        """The first model in words."""
        return ", ".join(self.before.model.effects) or "plain model"

    @property
    def added(self) -> Annotated[tuple[str, ...], Key()]:
        """The effects that were added, in their order."""
        return tuple(name for g in self.line if g.step for name in g.step.gain.added)

    @property
    def where(self) -> Annotated[tuple[Place, ...], Key()]:
        """Where the first model's leading channel fails, the most first."""
        return tuple(p for p in self.before.where if p.beyond > 0.0)

    @property
    def is_noiseless(self) -> bool:
        """Whether there is no noise floor that errors could be told over."""
        return self.before.over_noise >= MANY

    @property
    def steps(self) -> Annotated[tuple[LoopStep, ...], Key()]:
        """The errors before the first addition and after each."""
        gains = [g.step.gain for g in self.line if g.step]
        pairs = [(self.start, gains[0].before, gains[0].noise_floor)]
        pairs += [(f"+ {', '.join(g.added)}", g.after, g.noise_floor) for g in gains]
        return tuple(_step(name, pair, floor, gains[0].before if self.is_noiseless else None) for name, pair, floor in pairs)

    def left_by(self, found: Comparison) -> str:
        """Return in words what one of the two models leaves of the run."""
        if not self.is_noiseless:
            return f"error {found.over_noise:.2f} x the noise"
        leading = next(c for c in found.channels if c.name == self.before.leading.name)
        return f"{leading.name} fit {leading.fit:.1f} %"


def _step(name: str, pair: Pair, floor: Noise, first: Pair | None) -> LoopStep:
    def side(errors: Errors, of: Errors | None) -> tuple[float, str]:
        over = errors.over(floor if of is None else Noise(of.angle_rms_rad, of.rate_rms_rad_s))
        return over, f"{over:.2f} x" if of is None else errors.sized("deg", degrees(1.0))

    fitted, fitted_says = side(pair.train, None if first is None else first.train)
    unseen, unseen_says = side(pair.validation, None if first is None else first.validation)
    return LoopStep(name, fitted, unseen, (fitted_says, unseen_says))


def loop_of(line: Sequence[Generation], first: Sequence[Comparison], last: Sequence[Comparison]) -> Loop | None:
    """Return the loop of a line by the comparisons of its first and of its last model with the same runs; None where it has none.

    It is shown on the run that the first model fails most on, of those that the last was not fitted to where there are any.
    """
    pairs = [(b, a) for b in first for a in last if a.run == b.run]
    unseen = [(b, a) for b, a in pairs if b.run not in a.model.runs]
    if not pairs or not any(g.step for g in line):
        return None
    before, after = max(unseen or pairs, key=lambda pair: pair[0].badness)
    return Loop(before, after, tuple(line))
