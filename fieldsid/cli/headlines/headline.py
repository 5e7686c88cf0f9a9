"""What every result begins with: the verdict with its number, what it rests on, the next command ready to paste."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Headline:
    """The first lines of a result; next is empty only where nothing is left to do."""

    says: str
    rests_on: str
    next: str = ""

    @property
    def lines(self) -> tuple[str, ...]:
        """The lines as they are printed."""
        return (self.says, f"rests on {self.rests_on}", *([f"next: {self.next}"] if self.next else []))

    def record(self) -> dict[str, str]:
        """Return the lines as `--json` has them."""
        return {"says": self.says, "rests_on": self.rests_on, "next": self.next}
