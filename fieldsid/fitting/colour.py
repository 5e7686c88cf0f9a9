"""Which noise the residuals of a free run show: white, a disturbance moment, coloured sensor noise, or both."""

from __future__ import annotations

import numpy as np

from fieldsid.fitting.descent import dynamics_of
from fieldsid.fitting.problem import Problem
from fieldsid.fitting.restricted import best_noise
from fieldsid.fitting.whitening import is_white, whiten
from fieldsid.logs.run import FloatArray, Note
from fieldsid.models.model import Noise

__all__ = ["LAGS", "best_noise", "chi_square_tail", "chosen_noise", "dynamics_of", "ljung_box", "residuals_of", "whiteness"]

LAGS = 20
WHITE_ENOUGH = 0.01


def residuals_of(problem: Problem, x: FloatArray) -> list[FloatArray]:
    """Return the residual (2, n) of every run."""
    return [problem.residual(x, run)[0] for run in range(len(problem.records))]


def whiteness(problem: Problem, x: FloatArray, noise: Noise) -> float:
    """Return the p-value of the Ljung-Box statistic of the whitened residuals, the smaller of both channels doubled."""
    smallest = 1.0
    for channel in range(2):
        statistic, freedom = 0.0, 0
        for run, record in enumerate(problem.records):
            ok = (record.angle_ok, record.rate_ok)[channel]
            if ok.sum() < 4 * LAGS:
                continue
            residual, base = problem.residual(x, run)
            white, _ = whiten(record, noise, base.damping, base.stiffness, residual[None])
            statistic += ljung_box(white[0, channel][ok])
            freedom += LAGS
        if freedom:
            smallest = min(smallest, 2.0 * chi_square_tail(statistic, freedom))
    return min(smallest, 1.0)


def ljung_box(e: FloatArray) -> float:
    """Return the Ljung-Box statistic of a series over LAGS lags (chi-square with LAGS degrees when white)."""
    n = e.size
    centred = e - e.mean()
    power = float(centred @ centred)
    if power == 0.0:
        return 0.0
    lags = np.array([float(centred[lag:] @ centred[:-lag]) / power for lag in range(1, LAGS + 1)])
    return float(n * (n + 2) * np.sum(lags**2 / (n - np.arange(1, LAGS + 1))))


def chi_square_tail(statistic: float, freedom: int) -> float:
    """Return P(chi-square > statistic)."""
    from scipy.special import gammaincc

    return float(gammaincc(0.5 * freedom, 0.5 * statistic))


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
