"""The recursive estimate as the vehicle flies: constant memory, NumPy alone where numba is not there."""

from fieldsid.online.estimate import OnlineEstimate
from fieldsid.online.identifier import OnlineIdentifier

__all__ = ["OnlineEstimate", "OnlineIdentifier"]
