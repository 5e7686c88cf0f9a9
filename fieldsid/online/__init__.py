"""The recursive estimate during the flight: its memory is constant, and it runs with NumPy alone where numba is missing."""

from fieldsid.online.estimate import OnlineEstimate
from fieldsid.online.identifier import OnlineIdentifier

__all__ = ["OnlineEstimate", "OnlineIdentifier"]
