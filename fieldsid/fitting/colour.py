"""Which noise the residuals of a free run show: white, a disturbance moment, coloured sensor noise, or both."""

from __future__ import annotations

from fieldsid.fitting.descent import dynamics_of
from fieldsid.fitting.problem import Problem
from fieldsid.fitting.restricted import best_noise
from fieldsid.fitting.tails import chi_square_tail
from fieldsid.fitting.whiteness import LAGS, WHITE_ENOUGH, ljung_box
from fieldsid.fitting.whitening import is_white, whiten
from fieldsid.logs.run import FloatArray, Note
from fieldsid.models.model import Noise

__all__ = ["LAGS", "best_noise", "chosen_noise", "dynamics_of", "ljung_box", "residuals_of", "whiteness"]


def residuals_of(problem: Problem, x: FloatArray) -> list[FloatArray]:
    """Return the residual (2, n) of every run."""
    return [problem.residual(x, run)[0] for run in range(len(problem.records))]


def whiteness(problem: Problem, x: FloatArray, noise: Noise) -> float:
    """Return the p-value of the Ljung-Box statistic of the whitened residuals, the smaller of both channels doubled."""
    smallest = 1.0
    for channel in range(2):
        statistic, freedom = 0.0, 0
        for run, record in enumerate(problem.records):
            ok = record.ok[channel]
            if ok.sum() < 4 * LAGS:
                continue
            residual, base = problem.residual(x, run)
            white, _ = whiten(record, noise, base.damping, base.stiffness, residual[None])
            statistic += ljung_box(white[0, channel][ok])
            freedom += LAGS
        if freedom:
            smallest = min(smallest, 2.0 * chi_square_tail(statistic, freedom))
    return min(smallest, 1.0)


def chosen_noise(problem: Problem, x: FloatArray, weights: Noise) -> tuple[str, Noise, tuple[Note, ...]]:
    """Return the noise the standard errors are computed with, and its family: white when the residuals are."""
    p = whiteness(problem, x, weights)
    if p >= WHITE_ENOUGH and is_white(weights):
        return "white", weights, ()
    family, noise, _ = best_noise(problem, x, weights)
    return family, noise, (Note("coloured_residuals", _words(family, p), {"p": p, "limit": WHITE_ENOUGH, "family": family}),)


def _words(family: str, p: float) -> str:
    kinds = {
        "white": "no coloured noise model improves on white noise",
        "disturbance": "a disturbance moment explains them best",
        "coloured": "coloured sensor noise explains them best",
        "both": "a disturbance moment with coloured sensor noise explains them best",
    }
    return f"residuals are not white (p = {p:.2g}): {kinds[family]}; the standard errors allow for it"
