"""The recursive estimate as the vehicle flies: constant memory, NumPy alone where numba is not there."""

from fieldsid.online.identifier import OnlineEstimate, OnlineIdentifier

__all__ = ["OnlineEstimate", "OnlineIdentifier"]
