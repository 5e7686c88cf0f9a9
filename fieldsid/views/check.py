"""One speed of a verification, in one line."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fieldsid.rounding import number
from fieldsid.views._row import row_view

if TYPE_CHECKING:
    from fieldsid.schedule.check import Check


def line(check: Check) -> str:
    """Return speed, margins and the step."""
    phase = f"phase margin {check.phase_deg:.0f} deg, {check.phase_least_deg:.0f} least over the set"
    step = f"overshoot {100 * check.steps[1].overshoot:.0f} %, settled in {number(check.settling, 3)} s"
    return f"{check.speed:.2f} m/s{', one constant gain' if check.constant else ''}: {phase}; {step}"


VIEW = row_view("check", line)
