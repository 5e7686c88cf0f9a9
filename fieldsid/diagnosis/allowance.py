"""What a search may work out before it goes on only with what it has found: nobody on a boat waits for the last percent."""

from __future__ import annotations

from dataclasses import dataclass, field

from fieldsid.fitting.effort import done

MOST = 3500
"""Times each run may be flown, linearised or filtered, on average, before nothing more is begun."""


@dataclass(slots=True)
class Allowance:
    """What a search over some runs may work out, and whether something was left untried for it."""

    runs: int
    most: float
    ended: bool = False
    began: int = field(default_factory=done)

    def lasts(self) -> bool:
        """Whether something of it is left; if not, what is asked for is left untried."""
        lasts = done() - self.began < self.most * self.runs
        self.ended = self.ended or not lasts
        return lasts
