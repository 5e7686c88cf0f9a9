"""The cause of an authority that is not significant: feedback, little excitation, correlation with other parameters, or a misfit.

The standard error of the authority is compared with what it would be without each cause:
    a controller moves the fin in response to the motion                         -> feedback
    the fin's history explains little of the motion's power                      -> little excitation
    with the other parameters known, 1 / sqrt((C^-1)_bb), it is significant      -> collinear, with the one that helps most
    with the sensors' noise alone, sqrt((J' W J)^-1_bb), it is significant       -> misfit: the residuals exceed that noise
C is the covariance of the shared parameters under the noise model fitted to the residuals.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from fieldsid.fitting.checks.closed_loop import closed_loop_note
from fieldsid.fitting.fin_history import share_of_fin
from fieldsid.fitting.optimise.levenberg_marquardt import covariance, levenberg_marquardt
from fieldsid.fitting.problem.estimator import Solution
from fieldsid.fitting.problem.problem import Problem
from fieldsid.logs.run import Note
from fieldsid.models.model import Noise
from fieldsid.numerics.arrays import FloatArray
from fieldsid.rounding import number_against

MIN_STD_ERRORS = 3.0
"""Standard errors below which an authority is not significant."""
MIN_FIN_SHARE = 1.0 / 3.0
"""Share of the motion's power explained by the fin, below which other causes dominate. By chance the fin explains up to a quarter
of a disturbance with a correlation time of one second in a record of half a minute."""
MAX_CONFOUNDED = 3


def authority_check(problem: Problem, solution: Solution, floor: Noise, slot: int) -> Note | None:
    """Return the note on an authority that is not significant, with the cause; None where it is significant."""
    value, error = float(solution.x[slot]), float(np.sqrt(max(solution.covariance[slot, slot], 0.0)))
    if error == 0.0 or abs(value) >= MIN_STD_ERRORS * error:
        return None
    stated = f"{problem.layout.shown(problem.layout.names[slot])} = {value:.2g} +/- {error:.2g} 1/s^2"
    estimate = f"{stated} {far_from_zero(value, error)}"
    data = {"parameter": problem.layout.names[slot], "value": value, "std_error": error, "limit": MIN_STD_ERRORS}
    runs = [problem.records[run].name for run in _runs_of(problem, slot) if any(closed_loop_note(problem.records[run]))]
    if runs:
        return Note(
            "authority_unclear",
            f"{estimate}: a controller flies the fin of {', '.join(runs)}, and what it did is not told from what it answered to; "
            "fly pulses on top of it, or with it off",
            {**data, "causes": ["feedback"], "runs": runs},
        )
    share = max(share_of_fin(problem.records[run]) for run in _runs_of(problem, slot))
    if share < MIN_FIN_SHARE:
        return Note(
            "not_excited",
            f"{estimate}: the fin hardly moved the vehicle, at most {100 * share:.0f} % of the motion's power follows it (limit "
            f"{100 * MIN_FIN_SHARE:.0f} %); fly larger or longer pulses",
            {**data, "causes": ["not_excited"], "share": share},
        )
    causes = dict(_causes(problem, solution, floor, slot))
    # such an error is that of a disturbance which leaves as much, and what the model leaves may be none: it says nothing of zero
    said = stated if "misfit" in causes else estimate
    return Note("authority_unclear", f"{said}: {'; '.join(causes.values())}", {**data, "causes": list(causes)})


def far_from_zero(value: float, error: float) -> str:
    """Return in words how far a value that is not significant is from zero."""
    if abs(value) < 2.0 * error:  # its 95 % interval holds zero
        return "cannot be told from zero"
    return f"is {number_against(abs(value) / error, MIN_STD_ERRORS)} standard errors from zero, less than {MIN_STD_ERRORS:g}"


def _causes(problem: Problem, solution: Solution, floor: Noise, slot: int) -> Iterator[tuple[str, str]]:
    """Yield a code and a sentence for each cause without which the authority would be significant, else for little excitation."""
    enough = abs(float(solution.x[slot])) / MIN_STD_ERRORS
    confounded, known = confounded_with(solution.covariance, slot, enough)
    names = " and ".join(problem.layout.shown(problem.layout.names[i]) for i in confounded)
    sensors = levenberg_marquardt(problem, solution.x, floor, max_iterations=0)
    alone = float(np.sqrt(covariance(sensors.normal)[slot, slot]))
    if known <= enough:
        yield "collinear", f"this motion does not tell it from {names} (its error is {known:.2g} with {names} known)"
    if alone <= enough:
        error_ratio = np.sqrt(sensors.cost / max(sum(int(r.ok.sum()) for r in problem.records), 1))
        remains = f"the model leaves {error_ratio:.1f} x the sensors' noise (its error is {alone:.2g} at that noise alone)"
        yield "misfit", f"{remains}, and `sysid diagnose` tells whether an effect is missing"
    if min(known, alone) > enough:
        together = f", and {known:.2g} with {names} known" if confounded else ""
        yield "too_little", f"its error is {alone:.2g} even at the sensors' noise alone{together}; fly larger or longer pulses"


def confounded_with(known: FloatArray, slot: int, enough: float) -> tuple[list[int], float]:
    """Return the fewest parameters that, if known, lower a parameter's standard error to `enough`, and that error.

    `known` is a covariance (S, S); parameters are added greedily. Where a few do not suffice, all that were added are returned.
    """
    rest = known.copy()
    taken: list[int] = []
    while rest[slot, slot] > enough**2 and len(taken) < MAX_CONFOUNDED:
        variance = np.where(np.diag(rest) > 0.0, np.diag(rest), np.inf)
        gain = rest[slot] ** 2 / variance
        gain[[slot, *taken]] = 0.0
        best = int(np.argmax(gain))
        if gain[best] <= 0.0:
            break
        taken.append(best)
        rest = rest - np.outer(rest[best], rest[best]) / rest[best, best]
    return taken, float(np.sqrt(max(rest[slot, slot], 0.0)))


def _runs_of(problem: Problem, slot: int) -> list[int]:
    """Return the runs whose authority is the parameter at `slot`."""
    name = problem.layout.names[slot]
    return [run for run in range(len(problem.records)) if problem.authority_of(run) == name]
