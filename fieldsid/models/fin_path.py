"""The fin's path over the sampling intervals, which a record has and actuator effects transform."""

from __future__ import annotations

from dataclasses import dataclass

from fieldsid.display import Brief
from fieldsid.numerics.arrays import FloatArray


@dataclass(frozen=True, slots=True, repr=False)
class FinPath(Brief):
    """Fin angle over each sampling interval, linear from `start` to `end`, both (n-1,) in rad.

    A path that bends or jumps inside an interval is replaced by the line with the same mean and first moment. The ends of that
    line may lie outside the path: `first` and `last`, (n-1,) in rad, are then the fin angles at the ends of the interval.
    """

    start: FloatArray
    end: FloatArray
    first: FloatArray | None = None
    last: FloatArray | None = None

    @property
    def mean(self) -> FloatArray:
        """Mean over each interval, (n-1,)."""
        return 0.5 * (self.start + self.end)

    def shifted(self, offset: float) -> FinPath:
        """Return the path with an offset in rad added to the fin angle."""
        ends = (None if side is None else side + offset for side in (self.first, self.last))
        return FinPath(self.start + offset, self.end + offset, *ends)
