"""Selection of the kind of noise of free-run residuals: white, a disturbance moment, coloured sensor noise, or both."""

from __future__ import annotations

from fieldsid.fitting.covariance.reml import select_noise
from fieldsid.fitting.problem.problem import Problem
from fieldsid.logs.run import Note
from fieldsid.models.model import Noise
from fieldsid.noise.noise_kinds import NOISE_KINDS
from fieldsid.noise.whiten import is_white, whiten
from fieldsid.numerics.arrays import FloatArray
from fieldsid.numerics.ljung_box import MIN_WHITENESS_P, ljung_box_p
from fieldsid.rounding import p_value


def residuals_of(problem: Problem, x: FloatArray) -> list[FloatArray]:
    """Return the residual (2, n) of every run."""
    return [problem.residual(x, run)[0] for run in range(len(problem.records))]


def residual_whiteness(problem: Problem, x: FloatArray, noise: Noise) -> float:
    """Return the p-value of the Ljung-Box statistic of the whitened residuals, the smaller of both channels doubled."""
    whites: tuple[list[FloatArray], ...] = ([], [])
    for run, record in enumerate(problem.records):
        residual, base = problem.residual(x, run)
        white, _ = whiten(record, noise, base.damping, base.stiffness, residual[None])
        for channel, series in enumerate(whites):
            series.append(white[0, channel][record.ok[channel]])
    return min(1.0, 2.0 * min(map(ljung_box_p, whites)))


def chosen_noise(problem: Problem, x: FloatArray, weights: Noise) -> tuple[str, Noise, tuple[Note, ...]]:
    """Return the kind of noise for the standard errors, the noise, and notes; white where the residuals are white."""
    p = residual_whiteness(problem, x, weights)
    if p >= MIN_WHITENESS_P and is_white(weights):
        return "white", weights, ()
    noise_kind, noise, _ = select_noise(problem, x, weights)
    return (
        noise_kind,
        noise,
        (Note("coloured_residuals", _words(noise_kind, p), {"p": p, "limit": MIN_WHITENESS_P, "family": noise_kind}),),
    )


def _words(noise_kind: str, p: float) -> str:
    says = NOISE_KINDS[noise_kind].says
    return (
        f"residuals are not white ({p_value(p)}): {says}, and the standard errors are those of that noise; "
        "an effect that the model lacks leaves such residuals too: `sysid diagnose`"
    )
