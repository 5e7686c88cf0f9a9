"""The import doctor: what in a log would spoil an identification, each finding with its number, limit and remedy."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from fieldsid.logs.conditioning import MAIN
from fieldsid.logs.doctor_pairs import pair_findings
from fieldsid.logs.doctor_signals import signal_findings
from fieldsid.logs.run import Note, Run

JITTER_LIMIT = 0.2
"""Standard deviation of the sampling step over its median."""
GAP_FACTOR = 2.5
"""A step longer than this many medians is a gap."""
_FINS = ("rudder_rad", "elevator_rad", "rudder_measured_rad", "elevator_measured_rad")


def examine(run: Run, fin_max_rad: Mapping[str, float] | None = None) -> tuple[Note, ...]:
    """Return the findings on a run; `fin_max_rad` gives fin limits by signal, for saturation.

    Every note has in its data the `value` measured and its `limit`, where there is one.
    """
    # Garbage in a damaged log may be near the largest float; what overflows then is compared as infinity.
    with np.errstate(over="ignore", invalid="ignore"):
        findings = [*_sampling(run), *_fins(run, fin_max_rad or {})]
        for name in run.signals:
            findings += signal_findings(run, name)
        return (*findings, *pair_findings(run))


def _sampling(run: Run) -> list[Note]:
    if len(run) < 3:
        return []
    steps = np.diff(run.time)
    median = float(np.median(steps))
    found = []
    wide = steps > GAP_FACTOR * median
    if wide.any():
        at = int(np.argmax(steps))
        message = (
            f"{int(wide.sum())} gaps in time, the longest {steps[at]:.3g} s from {run.time[at]:.2f} s on "
            f"(limit {GAP_FACTOR:g} x the step of {median:.3g} s); leave it out with `--from` and `--to`"
        )
        found.append(
            Note("time_gap", message, {"value": float(steps[at]), "limit": GAP_FACTOR * median, "count": int(wide.sum())})
        )
    jitter = float(np.std(steps[~wide])) / median
    if jitter > JITTER_LIMIT:
        message = (
            f"the sampling step varies by {100 * jitter:.0f} % (limit {100 * JITTER_LIMIT:.0f} %); "
            "use header stamps in the mapping where the log has them: `stamp: header`"
        )
        found.append(Note("jitter", message, {"value": jitter, "limit": JITTER_LIMIT}))
    return found


def _fins(run: Run, limits: Mapping[str, float]) -> list[Note]:
    found = []
    if not any(run.has(f) for f in _FINS):
        message = "no fin signal: nothing can be identified from this run; map `rudder_rad` or `elevator_rad`"
        found.append(Note("no_fin", message, {"signals": [s for s in run.signals if run.has(s)]}))
    if not any(run.has(s) for s in MAIN if s not in _FINS):
        found.append(Note("no_motion", "neither an angle nor a rate of yaw or pitch is in the log; map one of them", {}))
    for fin, limit in limits.items():
        if not run.has(fin):
            continue
        values = np.abs(run[fin][np.isfinite(run[fin])])
        share = float(np.mean(values >= 0.99 * limit))
        if share > 0.05:
            message = (
                f"{fin} is at its limit of {limit:.3g} rad for {100 * share:.0f} % of the run (limit 5 %); use smaller pulses"
            )
            found.append(Note("saturated", message, {"signal": fin, "value": share, "limit": 0.05}))
    return found
