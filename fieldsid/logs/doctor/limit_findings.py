"""What in a run hangs on its vehicle: a fin that was commanded or measured beyond its limit."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from fieldsid.logs.run import Note, Run

BEYOND_SHARE = 0.05
"""Share of a run in which a command may be beyond the fin's limit."""
FIN_ZERO = 0.0175
"""How far off the zero of a fin may be, in rad: commands about a trim reach so far beyond the limit."""


def limit_findings(run: Run, fin_max_rad: Mapping[str, float]) -> list[Note]:
    """Return the findings on a run that hang on its vehicle: fins beyond the limits (rad) given for their signals."""
    return [note for fin, limit in fin_max_rad.items() for note in _beyond(run, fin, limit)]


def _beyond(run: Run, fin: str, limit: float) -> list[Note]:
    """Return that a fin was measured, or commanded for long, beyond its limit (rad)."""
    measured, stated = f"{fin.removesuffix('_rad')}_measured_rad", f"`{fin.removesuffix('_rad')}_max_rad` of vehicle.yaml"
    name = measured if run.has(measured) else fin
    if not run.has(name) or (share := _share(run, name, limit)) <= BEYOND_SHARE:
        return []
    reach = float(np.nanmax(np.abs(run[name])))
    message = (
        f"{name} goes to {reach:.3g} rad, beyond the fin's limit of {limit:.3g} rad for {100 * share:.0f} % of the run (limit "
        f"{100 * BEYOND_SHARE:.0f} %): "
    )
    data = {"signal": name, "value": share, "limit": BEYOND_SHARE, "reach_rad": reach}
    if name == measured:
        return [Note("fin_limit", f"{message}correct {stated}", data)]
    advice = f"where the fin goes so far, correct {stated}; where it stopped, the log does not show it: log the measured fin"
    return [Note("saturated", message + advice, data)]


def _share(run: Run, name: str, limit: float) -> float:
    return float(np.mean(np.abs(run[name][np.isfinite(run[name])]) > limit + FIN_ZERO))


def share_beyond(run: Run, fin: str, limit: float) -> float:
    """Return the share of a run in which a fin's command is beyond its limit (rad); one that is at it shows where the fin is.

    Nothing is hidden where the fin itself was measured.
    """
    if run.has(f"{fin.removesuffix('_rad')}_measured_rad") or fin.endswith("_measured_rad"):
        return 0.0
    return _share(run, fin, limit)
