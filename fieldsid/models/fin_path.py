"""The fin's path over the sampling intervals, which records hold and actuator effects change."""

from __future__ import annotations

from dataclasses import dataclass

from fieldsid.display import Brief
from fieldsid.numerics.arrays import FloatArray


@dataclass(frozen=True, slots=True, repr=False)
class FinPath(Brief):
    """Fin angle over each sampling interval, straight from `start` to `end`, both (n-1,) in rad.

    A path that bends or jumps inside an interval is the line of its mean and its first moment. Where the line may pass what
    the fin itself passes, first and last, (n-1,) in rad, are where the fin is as the interval begins and ends.
    """

    start: FloatArray
    end: FloatArray
    first: FloatArray | None = None
    last: FloatArray | None = None

    @property
    def mean(self) -> FloatArray:
        """Mean over each interval, (n-1,)."""
        return 0.5 * (self.start + self.end)

    def moved(self, by: float) -> FinPath:
        """Return the path of a fin that stands off by so much, in rad."""
        ends = (None if side is None else side + by for side in (self.first, self.last))
        return FinPath(self.start + by, self.end + by, *ends)
