"""A robust geometric fit of a circle to a track, whose centre drifts with a steady current.

Minimises sum rho(d_i), d_i = |p_i - c - w t_i| - R, over centre c, radius R and current w (Gander, Golub & Strebel 1994
for the geometric distance; Huber's rho for outliers). A linear fit by the heading gives a start for any current. The standard
error is corrected for the autocorrelation of the residuals.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from fieldsid.display import Brief
from fieldsid.errors import DataError
from fieldsid.numerics.arrays import ROUNDING_SHARE, FloatArray
from fieldsid.numerics.white_noise import MEDIAN_OF_NORMAL
from fieldsid.plant.laws.regression import t_factor
from fieldsid.records.keys import Key, Number

HUBER = 1.345
LEAST_SAMPLES = 12
MAX_REWEIGHTINGS = 12
LEAST_TURN_RAD = 1.5
"""Turned angle below which, about a quarter circle, radius and centre cannot be distinguished."""
LEAST_TURN_FOR_CURRENT_RAD = 5.0
"""Turned angle below which a current cannot be distinguished from a shift of the centre."""


@dataclass(frozen=True, slots=True, repr=False)
class Circle(Brief):
    """A fitted circle: radius and its standard error (m), centre at t = 0 (m), current (m/s), residual (n,) m."""

    radius: Annotated[float, Key("Radius of the circle, current taken out.", "radius_m")]
    radius_std_error: Annotated[Number, Key("Its standard error.", "std_error_m")]
    centre: Annotated[tuple[float, float], Key("North and east of the centre.", "centre_m")]
    current: Annotated[tuple[float, float], Key("North and east of the current.", "current_m_s")]
    residual: FloatArray
    turned: Annotated[float, Key("Angle that was turned.", "turned_rad")]
    effective_samples: float

    @property
    def interval95(self) -> Annotated[tuple[float, float], Key()]:
        """The 95 % interval of the radius, m."""
        half = t_factor(round(self.effective_samples)) * self.radius_std_error
        return self.radius - half, self.radius + half


def fit_circle(time: FloatArray, x: FloatArray, y: FloatArray, heading: FloatArray) -> Circle:
    """Fit a circle, and from LEAST_TURN_FOR_CURRENT_RAD on the current, to a track and its unwrapped heading, (n,) in s, m, rad.

    Raises DataError when there are too few samples or too short an arc.
    """
    ok = np.isfinite(x) & np.isfinite(y) & np.isfinite(heading)
    t, track = time[ok] - time[ok][0] if ok.any() else time[:0], np.stack([x[ok], y[ok]], axis=1)
    if t.size < LEAST_SAMPLES:
        raise DataError(
            "too few positions for a circle",
            found=f"{t.size}, at least {LEAST_SAMPLES}",
            hint="give a run with x_m and y_m throughout the turn",
        )
    middle = track.mean(axis=0)
    scale = float(np.sqrt(np.mean(np.sum((track - middle) ** 2, axis=1))))
    if not scale > ROUNDING_SHARE * float(np.max(np.abs(track))):
        raise DataError(
            "the track does not leave its first position, no circle",
            found=f"{t.size} positions alike",
            hint="give the run of a turn",
        )
    points = (track - middle) / scale
    start = _by_heading(points, t / (float(t[-1]) or 1.0), heading[ok])
    turned = float(abs(heading[ok][-1] - heading[ok][0]))
    if turned < LEAST_TURN_RAD:
        raise DataError(
            "the settled part of the turn is too short an arc for a circle",
            found=f"{np.degrees(turned):.0f} deg, at least {np.degrees(LEAST_TURN_RAD):.0f}",
            hint="fly the turn on, one and a half times round: `sysid plan --axis yaw --radius`",
        )
    free = 5 if turned >= LEAST_TURN_FOR_CURRENT_RAD else 3
    return _refined(t, track, middle, scale, start, free, turned)


def _refined(
    t: FloatArray, track: FloatArray, middle: FloatArray, scale: float, start: FloatArray, free: int, turned: float
) -> Circle:
    from scipy.optimize import least_squares

    span = float(t[-1]) or 1.0
    points, share = (track - middle) / scale, t / span

    def distances(p: FloatArray) -> FloatArray:
        full = np.concatenate([p, np.zeros(5 - p.size)])  # cx, cy, R, wx, wy
        away = points - full[:2] - share[:, None] * full[3:]
        return np.asarray(np.hypot(away[:, 0], away[:, 1]) - full[2])

    best = start[:free]
    for _ in range(4):
        spread = max(_robust_sd(distances(best)), 1e-9)
        fit = least_squares(
            distances, best, loss="huber", f_scale=HUBER * spread, x_scale="jac", xtol=1e-14, ftol=1e-14, gtol=1e-14
        )
        best = np.asarray(fit.x)
    residual = distances(best)
    size = _effective_samples(residual)
    jac = np.asarray(fit.jac, dtype=np.float64)
    inverse = np.linalg.pinv(jac.T @ jac)
    error = _robust_sd(residual) * float(np.sqrt(inverse[2, 2] * t.size / max(size - free, 1.0)))
    full = np.concatenate([best, np.zeros(5 - free)])
    return Circle(
        radius=float(abs(full[2]) * scale),
        radius_std_error=error * scale,
        centre=(float(full[0] * scale + middle[0]), float(full[1] * scale + middle[1])),
        current=(float(full[3] * scale / span), float(full[4] * scale / span)),
        residual=residual * scale,
        turned=turned,
        effective_samples=size,
    )


def _by_heading(points: FloatArray, share: FloatArray, heading: FloatArray) -> FloatArray:
    """Return (cx, cy, R, wx, wy): x = cx + wx t + p sin + q cos, y = cy + wy t - p cos + q sin of the heading.

    Linear in all parameters; least absolute deviations by reweighting, so that outliers among the fixes have little influence.
    """
    one, zero, sin, cos = np.ones_like(share), np.zeros_like(share), np.sin(heading), np.cos(heading)
    along = np.stack([one, zero, share, zero, sin, cos], axis=1)
    across = np.stack([zero, one, zero, share, -cos, sin], axis=1)
    columns, values = np.concatenate([along, across]), np.concatenate([points[:, 0], points[:, 1]])
    weight = np.ones_like(values)
    for _ in range(MAX_REWEIGHTINGS):
        root = np.sqrt(weight)[:, None]
        found = np.linalg.lstsq(columns * root, values * root[:, 0], rcond=None)[0]
        weight = 1.0 / np.maximum(np.abs(values - columns @ found), 1e-3)
    return np.array([found[0], found[1], np.hypot(found[4], found[5]), found[2], found[3]])


def _robust_sd(residual: FloatArray) -> float:
    return float(np.median(np.abs(residual - np.median(residual)))) / MEDIAN_OF_NORMAL


def _effective_samples(residual: FloatArray) -> float:
    """Return the number of independent samples in correlated residuals (n,), the smaller of two estimates.

    One is n / (1 + 2 sum of the autocorrelation), the sum cut where it is below its noise; the other is that of an AR(1) whose
    coefficient is corrected for bias (Kendall 1954), which underestimates the correlation of coloured plus white noise.
    """
    centred = residual - residual.mean()
    power = float(centred @ centred)
    if power <= 0.0:
        return float(residual.size)
    total = 1.0
    for lag in range(1, residual.size // 2):
        rho = float(centred[:-lag] @ centred[lag:]) / power
        if rho < 2.0 / np.sqrt(residual.size):
            break
        total += 2.0 * rho
    size = residual.size
    rho = float(centred[1:] @ centred[:-1]) / power
    rho = min(max(rho + (1.0 + 4.0 * rho) / size, 0.0), 0.995)
    return max(min(size / total, size * (1.0 - rho) / (1.0 + rho)), 2.0)
