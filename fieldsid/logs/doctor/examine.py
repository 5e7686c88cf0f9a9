"""The import doctor: findings on a log that would spoil an identification, each with its number, limit and remedy."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from fieldsid.logs.convert.clock import GAP_FACTOR
from fieldsid.logs.convert.conditioning import MAIN, likely_unit
from fieldsid.logs.convert.times.time_column import FASTEST_S, SLOW_S
from fieldsid.logs.doctor.angle_and_rate import angle_findings
from fieldsid.logs.doctor.fin_findings import fin_findings, limit_findings
from fieldsid.logs.doctor.pair_findings import pair_findings
from fieldsid.logs.doctor.signal_findings import signal_findings
from fieldsid.logs.doctor.stated import Stated
from fieldsid.logs.run import FINS, LINES, Note, Run

JITTER_LIMIT = 0.2
"""Largest ratio of the standard deviation of the sampling step to its median."""


def examine(run: Run, fin_max_rad: Mapping[str, float] | None = None, stated: Stated | None = None) -> tuple[Note, ...]:
    """Return the findings on a run; `fin_max_rad` holds fin limits by signal, `stated` the units and signs of its mapping.

    The data of every note contain the measured `value` and its `limit`, where there is one.
    """
    # Invalid numbers in a damaged log may be near the largest float; an overflow is then compared as infinity.
    stated = stated or Stated()
    with np.errstate(over="ignore", invalid="ignore"):
        findings = [*_sampling(run, stated), *_fins(run, fin_max_rad or {})]
        for name in (s for s in run.signals if s not in LINES):
            findings += signal_findings(run, name, stated)
        faulty = {str(n.data.get("signal")) for n in findings}
        return (
            *findings,
            *angle_findings(run, stated, faulty),
            *pair_findings(run, stated),
            *fin_findings(run, stated),
        )


def _sampling(run: Run, stated: Stated) -> list[Note]:
    if len(run) < 3:
        return []
    steps = np.diff(run.time)
    median = float(np.median(steps))
    found = []
    if median > SLOW_S or median < FASTEST_S:
        # a clock in another unit has regular steps; a glider that logs rarely does not
        is_even, limit = float(np.std(steps)) < JITTER_LIMIT * median, SLOW_S if median > SLOW_S else FASTEST_S
        advice = (likely_unit(median) if is_even else "") or "log faster"
        if median < FASTEST_S:
            advice = "no vehicle's log is so fast; set its unit, as `unit: min`, `unit: h` or `unit: d`"
        message = f"time goes on by {median:.3g} s a sample (limit {limit:g} s): {advice}"
        found.append(Note("time_unit", message, {"value": median, "limit": limit}))
    wide = steps > GAP_FACTOR * median
    if wide.any():
        at = int(np.argmax(steps))
        message = (
            f"{int(wide.sum())} gaps in time, the longest {steps[at]:.3g} s from {run.time[at]:.2f} s on "
            f"(limit {GAP_FACTOR:g} x the step of {median:.3g} s); leave it out: `--to {run.time[at]:.2f}` or "
            f"`--from {run.time[at + 1]:.2f}`"
        )
        found.append(
            Note("time_gap", message, {"value": float(steps[at]), "limit": GAP_FACTOR * median, "count": int(wide.sum())})
        )
    jitter = float(np.std(steps[~wide])) / median
    if jitter > JITTER_LIMIT:
        message = (
            f"the sampling step varies by {100 * jitter:.0f} % (limit {100 * JITTER_LIMIT:.0f} %){stated.stamps(*run.signals)}"
        )
        found.append(Note("jitter", message, {"value": jitter, "limit": JITTER_LIMIT}))
    return found


def _fins(run: Run, limits: Mapping[str, float]) -> list[Note]:
    found = []
    if not any(run.has(f) for f in FINS):
        message = "no fin signal: nothing can be identified from this run; map `rudder_rad` or `elevator_rad`"
        found.append(Note("no_fin", message, {"signals": [s for s in run.signals if run.has(s)]}))
    if not any(run.has(s) for s in MAIN if s not in FINS):
        found.append(Note("no_motion", "neither an angle nor a rate of yaw or pitch is in the log; map one of them", {}))
    return [*found, *limit_findings(run, limits)]
