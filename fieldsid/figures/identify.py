"""The figure of a fit: measured and simulated angle, rate, fin and residual of one run, with the parameters above."""

from __future__ import annotations

from math import isfinite

from matplotlib.figure import Figure

from fieldsid.figures import correlation, motion, rls
from fieldsid.fitting.fit import Fit
from fieldsid.fitting.predict.goodness_of_fit import goodness_of_fit
from fieldsid.fitting.predict.predict import Prediction
from fieldsid.fitting.problem.estimator import History
from fieldsid.models.axis import NAMES
from fieldsid.models.model import Model
from fieldsid.rounding import with_error


def figure(fit: Fit, index: int = 0) -> Figure:
    """Return the figure of one of the fit's runs."""
    shown = fit.predictions[index]
    return motion.panels(view_of(shown, fit), heading(fit.model, shown.record.name), facts(fit, shown))


def residual_figure(fit: Fit, index: int = 0) -> Figure:
    """Return the correlations of the residuals of one of the fit's runs."""
    shown = fit.predictions[index]
    return correlation.figure(view_of(shown, fit), f"{shown.record.name}, {fit.model.axis.value}: what the model leaves")


def history_figure(fit: Fit, history: History) -> Figure:
    """Return the recursive estimates over time."""
    return rls.panels(history, fit.model.units, f"{', '.join(fit.model.runs)}, {fit.model.axis.value}: {fit.model.method}")


def view_of(shown: Prediction, fit: Fit) -> motion.MotionView:
    """Return the panels' view of a run: residuals are shown over the noise floor of the fit."""
    return motion.MotionView(shown.record, shown.angle, shown.rate, shown.fin, fit.floor.angle, fit.floor.rate)


def heading(model: Model, run: str) -> str:
    """Return the first line: run, axis and base parameters with their errors."""
    names = NAMES[model.axis]
    parts = (f"{n} = {with_error(model.values[n], model.std_error(n))} {model.units.get(n, '')}".rstrip() for n in names.base)
    at = f" at {model.law.reference:.2f} m/s" if len(model.runs) > 1 and isfinite(model.law.reference) else ""
    return f"{run}, {model.axis.value}: " + ", ".join(parts) + at


def facts(fit: Fit, shown: Prediction) -> str:
    """Return the second line: speed, method, effects, and how well the free run follows."""
    m, speed = goodness_of_fit([shown]), shown.record.speed
    words = [f"flown at {speed:.2f} m/s" if isfinite(speed) else "speed unknown", fit.model.method]
    words += list(fit.model.effects)
    fits = ((f"{n} fit {v:.1f} %") for n, v in (("angle", m.angle_fit), ("rate", m.rate_fit)) if isfinite(v))
    return ", ".join((*words, *fits))
