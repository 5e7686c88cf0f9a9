"""The figure of a fit: measured and simulated angle, rate, fin and residual of one run, with the parameters above."""

from __future__ import annotations

from math import isfinite

from fieldsid.figures import correlation, motion, rls
from fieldsid.figures.panel import Picture
from fieldsid.fitting.fit import Fit
from fieldsid.fitting.predict.goodness_of_fit import goodness_of_fit
from fieldsid.fitting.predict.predict import Prediction
from fieldsid.fitting.problem.estimator import History


def figure(fit: Fit, index: int, says: str) -> Picture:
    """Return the figure of one of the fit's runs."""
    shown = fit.predictions[index]
    return Picture(f"{says}\n{facts(shown)}", (9.0, 8.2), (motion.panels([("simulated", "simulated", shown)], fit.floor),))


def residual_figure(fit: Fit, index: int) -> Picture:
    """Return the correlations of the residuals of one of the fit's runs."""
    shown = fit.predictions[index]
    return correlation.figure(shown, f"{shown.record.name}, {fit.model.axis.value}: what the model leaves")


def history_figure(fit: Fit, history: History) -> Picture:
    """Return the recursive estimates over time."""
    return rls.figure(history, fit.model.units, f"{', '.join(fit.model.runs)}, {fit.model.axis.value}: {fit.model.method}")


def facts(shown: Prediction) -> str:
    """Return the second line: the run, its speed, and how well the free run follows."""
    m, speed = goodness_of_fit([shown]), shown.record.speed
    fits = (f"{n} fit {v:.1f} %" for n, v in (("angle", m.angle_fit), ("rate", m.rate_fit)) if isfinite(v))
    return ", ".join((shown.record.name, f"flown at {speed:.2f} m/s" if isfinite(speed) else "speed unknown", *fits))
