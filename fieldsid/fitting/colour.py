"""Which noise the residuals of a free run show: white, a disturbance moment, coloured sensor noise, or both."""

from __future__ import annotations

from fieldsid.fitting.problem import Problem
from fieldsid.fitting.restricted import best_noise
from fieldsid.fitting.whiteness import WHITE_ENOUGH, white_p
from fieldsid.fitting.whitening import is_white, whiten
from fieldsid.logs.run import FloatArray, Note
from fieldsid.models.model import Noise


def residuals_of(problem: Problem, x: FloatArray) -> list[FloatArray]:
    """Return the residual (2, n) of every run."""
    return [problem.residual(x, run)[0] for run in range(len(problem.records))]


def whiteness(problem: Problem, x: FloatArray, noise: Noise) -> float:
    """Return the p-value of the Ljung-Box statistic of the whitened residuals, the smaller of both channels doubled."""
    whites: tuple[list[FloatArray], ...] = ([], [])
    for run, record in enumerate(problem.records):
        residual, base = problem.residual(x, run)
        white, _ = whiten(record, noise, base.damping, base.stiffness, residual[None])
        for channel, series in enumerate(whites):
            series.append(white[0, channel][record.ok[channel]])
    return min(1.0, 2.0 * min(map(white_p, whites)))


def chosen_noise(problem: Problem, x: FloatArray, weights: Noise) -> tuple[str, Noise, tuple[Note, ...]]:
    """Return the noise the standard errors are computed with, and its family: white when the residuals are."""
    p = whiteness(problem, x, weights)
    if p >= WHITE_ENOUGH and is_white(weights):
        return "white", weights, ()
    family, noise, _ = best_noise(problem, x, weights)
    return family, noise, (Note("coloured_residuals", _words(family, p), {"p": p, "limit": WHITE_ENOUGH, "family": family}),)


def _words(family: str, p: float) -> str:
    kinds = {
        "white": "no coloured noise fits them better than white noise",
        "disturbance": "of the noises compared a disturbance moment fits them best",
        "coloured": "of the noises compared coloured sensor noise fits them best",
        "both": "of the noises compared a disturbance moment with coloured sensor noise fits them best",
    }
    return (
        f"residuals are not white (p = {p:.2g}): {kinds[family]}, and the standard errors are those of that noise; "
        "an effect that the model lacks leaves such residuals too: `sysid diagnose`"
    )
