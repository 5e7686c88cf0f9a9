"""What correlated residuals are worth: as many independent ones as a first-order autoregression with their correlation leaves."""

from __future__ import annotations

from collections.abc import Sequence

from fieldsid.numerics.arrays import FloatArray

MAX_RHO = 0.98


def inflation(parts: Sequence[FloatArray]) -> float:
    """Return how many residuals, in parts of (n,) each, hold one independent one: (1 + rho) / (1 - rho)."""
    power = sum(float(p @ p) for p in parts)
    rho = min(max(sum(float(p[1:] @ p[:-1]) for p in parts) / max(power, 1e-30), 0.0), MAX_RHO)
    return (1.0 + rho) / (1.0 - rho)
