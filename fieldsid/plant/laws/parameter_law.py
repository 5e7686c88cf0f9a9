"""The law of one parameter over speed: candidate laws, the exponent with its test, and the outliers among the points.

Authority is proportional to u^2 by physics (lift of the fin), so its law is fitted against u^2 and the exponent of |b| = k u^e is
tested against 2. Damping is proportional to u, the trim to u^2 (asymmetric hull) or constant (buoyancy). Outliers are found by
externally studentised residuals (Cook & Weisberg 1982, chapter 2) against Bonferroni's limit.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
import numpy.typing as npt

from fieldsid.display import Brief
from fieldsid.logs.run import Note
from fieldsid.numerics.arrays import ROUNDING_SHARE, FloatArray
from fieldsid.numerics.tail_probabilities import student_tail
from fieldsid.plant.laws.regression import Regression, fit_power_law, fit_powers, rounding_of, t_factor
from fieldsid.records.keys import Interval, Key, Number
from fieldsid.rounding import nine_digits, p_value

MIN_DEGREES_OF_FREEDOM = 2
"""Degrees of freedom of the other points' scatter from which on a point is tested: with one, points that are collinear by chance
(as rounded digits make them) have next to no scatter, and the studentised residual of the next point can be of any size."""
AUTHORITY = (("affine", (0.0, 2.0)), ("through_zero", (2.0,)))
OTHERS = (("constant", (0.0,)), ("linear", (0.0, 1.0)), ("affine", (0.0, 2.0)))


@dataclass(frozen=True, slots=True)
class Exponent:
    """The e of |b| = k u^e with its 95 % interval, and the two-sided p of e = 2."""

    value: Annotated[float, Key("The estimate.")]
    std_error: Annotated[Number, Key("Its standard error.")]
    interval95: Annotated[Interval, Key("Its 95 % interval.")]
    p_against_2: Annotated[Number, Key("Two-sided p-value of e = 2; null where two speeds fit any.")]

    @property
    def says(self) -> Annotated[str, Key()]:
        """One sentence for the reader."""
        low, high = self.interval95
        spread = f"u^{self.value:.2f} (95 % {low:.2f} .. {high:.2f})"
        if not np.isfinite(self.p_against_2):
            return f"{spread}: two speeds fit any exponent, so nothing is tested"
        if self.p_against_2 < 0.05:
            return (
                f"{spread}: not u^2 ({p_value(self.p_against_2)}); something is missing from the model or moves with speed "
                "(lag, sway, r|r|, thrust): `sysid diagnose` finds which"
            )
        return f"{spread}: u^2 is not refuted ({p_value(self.p_against_2)}); a high R^2 alone would not have shown that"


@dataclass(frozen=True, slots=True, repr=False)
class PointCheck(Brief):
    """The leave-one-out check of a point: the law of the others at its speed, and its externally studentised residual.

    A point beyond `limit` is an outlier; `limit` is infinite where there are too few points to test.
    """

    name: Annotated[str, Key("The point.")]
    speed: Annotated[float, Key("Its speed.", "speed_m_s")]
    value: Annotated[float, Key("Its value, times the sign.")]
    predicted_without: Annotated[float, Key("What the law of the others gives there.")]
    leading_coefficient_without: Annotated[float, Key("The leading coefficient of that law.")]
    studentised: Annotated[Number, Key("How far off it is, externally studentised.")]
    limit: Annotated[Number, Key("Bonferroni's limit.")]

    @property
    def belongs(self) -> Annotated[bool, Key()]:
        """Whether the point is within the limit."""
        return not abs(self.studentised) > self.limit


@dataclass(frozen=True, slots=True, repr=False)
class ParameterLaw(Brief):
    """A parameter's law: `sign` times the chosen one of the `candidates`; magnitudes (n,) at speeds (n,)."""

    name: str
    sign: Annotated[float, Key("-1 where the parameter is negative.")]
    speeds: FloatArray
    values: FloatArray
    std_errors: FloatArray | None
    candidates: tuple[Regression, ...]
    chosen: Annotated[str, Key("The candidate that the next commands take.")]
    exponent: Annotated[
        Exponent | None, Key("The exponent of the authority, with its test against 2; null for the other parameters.")
    ]
    points: Annotated[tuple[PointCheck, ...], Key("Each point against the law of the others.", "leave_one_out")]
    notes: tuple[Note, ...] = ()

    @property
    def weighted(self) -> Annotated[bool, Key()]:
        """Whether the points' standard errors weigh them."""
        return self.std_errors is not None

    @property
    def slope(self) -> Annotated[float | None, Key()]:
        """Slope of the affine law against u^2."""
        return self._affine(1)

    @property
    def intercept(self) -> Annotated[float | None, Key()]:
        """Its intercept."""
        return self._affine(0)

    @property
    def by_kind(self) -> Annotated[Mapping[str, Regression], Key(name="candidates")]:
        """All that were fitted."""
        return {c.kind: c for c in self.candidates}

    def _affine(self, place: int) -> float | None:
        return next((float(c.coefficients[place]) for c in self.candidates if c.kind == "affine"), None)

    @property
    def line(self) -> Regression:
        """The chosen candidate, of the magnitude."""
        return self.candidate(self.chosen)

    def candidate(self, kind: str) -> Regression:
        """Return a candidate by its kind."""
        return next(c for c in self.candidates if c.kind == kind)

    def at(self, speed: npt.ArrayLike) -> FloatArray:
        """Return the signed parameter (n,) at speeds (n,)."""
        return self.sign * self.line.at(speed)


def authority_law(
    name: str, sign: float, speeds: FloatArray, values: FloatArray, std_errors: FloatArray | None, labels: Sequence[str]
) -> ParameterLaw:
    """Return the law of a control authority against u^2; values (n,) are signed, all of `sign`."""
    size = np.abs(values)
    lines = [fit_powers(k, p, speeds, size, std_errors) for k, p in AUTHORITY if len(p) <= size.size]
    power = fit_power_law(speeds, size, std_errors)
    chosen = _authority_choice(lines)
    return ParameterLaw(
        name, sign, speeds, size, std_errors, (*lines, power), chosen, _exponent(power),
        leave_one_out(lines[0], speeds, size, std_errors, labels), _notes(name, lines[0], power),
    )  # fmt: skip


def other_law(
    name: str, speeds: FloatArray, values: FloatArray, std_errors: FloatArray | None, labels: Sequence[str]
) -> ParameterLaw:
    """Return the law of a damping, stiffness or trim: constant, or with a significant slope linear in u or affine in u^2.

    Of the two the one with the smaller residual is taken.
    """
    lines = [fit_powers(k, p, speeds, values, std_errors) for k, p in OTHERS if len(p) <= max(1, values.size - 1)]
    sloped = [line for line in lines[1:] if _is_significant(line, 1)]
    # at two speeds both go through the same two means, and the first of them is taken
    best = max(sloped, key=lambda line: nine_digits(line.r2)) if sloped else lines[0]
    checks = leave_one_out(best, speeds, values, std_errors, labels)
    return ParameterLaw(name, 1.0, speeds, values, std_errors, tuple(lines), best.kind, None, checks)


def leave_one_out(
    line: Regression, speeds: FloatArray, values: FloatArray, std_errors: FloatArray | None, labels: Sequence[str]
) -> tuple[PointCheck, ...]:
    """Return the leave-one-out check of each point; empty where too few points remain to estimate a scatter."""
    count, size = values.size, len(line.powers)
    degrees = count - 1 - size
    if degrees < 1:
        return ()
    limit = t_factor(degrees, count) if degrees >= MIN_DEGREES_OF_FREEDOM else float("inf")
    checks = []
    for i in range(count):
        keep = np.arange(count) != i
        errors = None if std_errors is None else std_errors[keep]
        other = fit_powers(line.kind, line.powers, speeds[keep], values[keep], errors)
        predicted, law_error = float(other.at(speeds[i])[0]), float(other.std(speeds[i])[0])
        point_error = _scatter(other, speeds[keep], values[keep], errors) * (1.0 if std_errors is None else float(std_errors[i]))
        least = max(ROUNDING_SHARE * abs(float(values[i])), float(np.finfo(np.float64).tiny))
        studentised = (float(values[i]) - predicted) / max(float(np.hypot(point_error, law_error)), least)
        leading = float(other.coefficients[-1])
        checks.append(PointCheck(labels[i], float(speeds[i]), float(values[i]), predicted, leading, studentised, limit))
    return tuple(checks)


def _scatter(line: Regression, speeds: FloatArray, values: FloatArray, std_errors: FloatArray | None) -> float:
    """Return the residual standard deviation; with stated errors in units of these, and at least one."""
    error = values - line.at(speeds)
    if std_errors is None:
        return float(np.hypot(np.sqrt(np.sum(error**2) / line.dof), rounding_of(values)))
    return max(1.0, float(np.sqrt(np.sum((error / std_errors) ** 2) / line.dof)))


def _authority_choice(lines: Sequence[Regression]) -> str:
    """Return the kind of the chosen law: affine where its intercept is significant, else through zero."""
    if len(lines) < 2 or lines[0].dof < 1:
        return "through_zero"
    return "affine" if _is_significant(lines[0], 0) else "through_zero"


def _is_significant(line: Regression, index: int) -> bool:
    """Whether the 95 % interval of a coefficient excludes zero; false without a degree of freedom."""
    if line.dof < 1:
        return False
    return bool(abs(line.coefficients[index]) > t_factor(line.dof) * np.sqrt(line.covariance[index, index]))


def _exponent(power: Regression) -> Exponent:
    value, error = float(power.coefficients[1]), float(np.sqrt(power.covariance[1, 1]))
    half = t_factor(power.dof) * error
    p = float("nan")
    if power.dof > 0 and error > 0:
        p = 2.0 * student_tail(abs(value - 2.0) / error, power.dof)
    return Exponent(value, error, (value - half, value + half), p)


def _notes(name: str, affine: Regression, power: Regression) -> tuple[Note, ...]:
    """Return notes: below which speed the affine law has the wrong sign, and that a high R^2 is no evidence for it."""
    notes = []
    if affine.kind == "affine" and affine.coefficients[0] < 0 < affine.coefficients[1] and _is_significant(affine, 0):
        zero = float(np.sqrt(-affine.coefficients[0] / affine.coefficients[1]))
        notes.append(Note("law_crosses_zero", f"the affine law of {name} crosses zero at {zero:.2f} m/s", {"speed_m_s": zero}))
    if affine.r2 > 0.95 and power.dof > 0:
        notes.append(Note("r2_proves_little", f"R^2 = {affine.r2:.3f} proves little: read the exponent", {"r2": affine.r2}))
    return tuple(notes)
