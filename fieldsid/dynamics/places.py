"""The places of the drives and of the constants in the arrays that the compiled kernels (numerics/jit.py) take."""

from __future__ import annotations

DRIVES = ("damping", "stiffness", "moment_start", "moment_end", "cross_factor", "cross_push")
CONSTANTS = (
    "quadratic", "heading_sin", "heading_cos", "righting_sin", "righting_cos", "cross_damping", "cross_rate", "cross_quadratic",
    "beyond_square", "heading_sin2", "heading_cos2", "heading_turn", "cross_share", "strip_moment", "strip_force", "strip_flow",
)  # fmt: skip
(
    QUADRATIC, HEADING_SIN, HEADING_COS, RIGHTING_SIN, RIGHTING_COS, CROSS_DAMPING, CROSS_RATE, CROSS_QUADRATIC,
    BEYOND_SQUARE, HEADING_SIN2, HEADING_COS2, HEADING_TURN, CROSS_SHARE, STRIP_MOMENT, STRIP_FORCE, STRIP_FLOW,
) = range(len(CONSTANTS))  # fmt: skip
