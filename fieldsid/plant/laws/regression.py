"""One law y(u) with its confidence band: a sum of powers of u by (weighted) least squares, or k u^e fitted in logarithms."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
import numpy.typing as npt

from fieldsid.display import Brief
from fieldsid.errors import DataError
from fieldsid.numerics.arrays import ROUNDING_SHARE, FloatArray, known
from fieldsid.numerics.tail_probabilities import student_quantile
from fieldsid.records.check import ShapeError, finite_number
from fieldsid.records.keys import Key, Number
from fieldsid.records.laws import LARGEST_COEFFICIENT, LARGEST_LOGARITHM

CONFIDENCE_LEVEL = 0.95


@dataclass(frozen=True, slots=True, repr=False)
class Regression(Brief):
    """y(u) = sum_k c_k u^p_k, or exp(c_0) u^c_1 where `powers` is empty, with the covariance of c and its degrees of freedom."""

    kind: Annotated[str, Key("`constant`, `linear`, `affine`, `through_zero` or `power`.")]
    powers: Annotated[tuple[float, ...], Key("The powers p.")]
    coefficients: Annotated[FloatArray, Key("The numbers c.", of=tuple[float, ...])]
    covariance: Annotated[FloatArray, Key("Their covariance.", of=tuple[tuple[Number, ...], ...])]
    dof: Annotated[int, Key("Degrees of freedom.")]
    r2: Annotated[Number, Key("Share of the points' variance it explains; proves little.")]
    rms: Annotated[float, Key("Root mean square of what it leaves.")]

    def columns(self, speed: npt.ArrayLike) -> FloatArray:
        """Return the derivative of y with respect to c, (n, k)."""
        u = np.atleast_1d(np.asarray(speed, dtype=np.float64))
        if self.powers:
            return np.stack([u**p for p in self.powers], axis=1)
        value = self.at(u)
        return np.stack([value, value * np.log(u)], axis=1)

    def at(self, speed: npt.ArrayLike) -> FloatArray:
        """Return y, (n,), at speeds (n,) in m/s."""
        u = np.atleast_1d(np.asarray(speed, dtype=np.float64))
        if self.powers:
            return np.asarray(self.columns(u) @ self.coefficients)
        return np.asarray(np.exp(self.coefficients[0]) * u ** self.coefficients[1])

    def std(self, speed: npt.ArrayLike) -> FloatArray:
        """Return the standard error of y, (n,); NaN where there are no degrees of freedom."""
        x = self.columns(speed)
        return np.asarray(np.sqrt(np.maximum(np.einsum("ni,ij,nj->n", x, self.covariance, x), 0.0)))

    def band(self, speed: npt.ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Return the 95 % confidence band of the law, two arrays (n,)."""
        half = t_factor(self.dof) * self.std(speed)
        middle = self.at(speed)
        return middle - half, middle + half

    @property
    def std_errors(self) -> Annotated[FloatArray, Key(of=tuple[Number, ...])]:
        """Their standard errors."""
        return np.asarray(np.sqrt(np.maximum(np.diag(self.covariance), 0.0)))


def regression_of(record: Mapping[str, Any]) -> Regression:
    """Return the law of a record of the shape REGRESSION; raises ShapeError where the sizes of its parts do not agree."""
    powers, count = tuple(float(p) for p in record["powers"]), len(record["coefficients"])
    largest = LARGEST_COEFFICIENT if powers else LARGEST_LOGARITHM
    coefficients = [finite_number(c, "coefficients", -largest, largest) for c in record["coefficients"]]
    covariance = [[np.nan if v is None else v for v in row] for row in record["covariance"]]
    if len(powers) != (count if powers else 0) or (not powers and count != 2):
        raise ShapeError(f"{len(powers)} powers for {count} coefficients")
    if [len(row) for row in covariance] != [count] * count:
        raise ShapeError(f"a covariance that is not {count} by {count}")
    return Regression(
        kind=record["kind"],
        powers=powers,
        coefficients=np.array(coefficients, dtype=np.float64),
        covariance=np.array(covariance, dtype=np.float64).reshape(count, count),
        dof=record["dof"],
        r2=known(record["r2"]),
        rms=known(record["rms"]),
    )


def fit_powers(
    kind: str, powers: tuple[float, ...], speed: FloatArray, value: FloatArray, std_error: FloatArray | None
) -> Regression:
    """Fit sum_k c_k u^p_k to values (n,), by QR; weighted by 1/std_error where given.

    With weights the covariance is multiplied by the squared Birge ratio where that exceeds one, and never reduced.
    """
    with np.errstate(over="ignore"):  # `_least_squares` refuses an overflow
        x = np.stack([speed**p for p in powers], axis=1)
    coefficients, covariance, dof = _least_squares(x, value, std_error, rounding_of(value))
    error = value - x @ coefficients
    return Regression(kind, powers, coefficients, covariance, dof, _r2(value, error), _rms(error))


def fit_power_law(speed: FloatArray, value: FloatArray, std_error: FloatArray | None) -> Regression:
    """Fit value = k u^e (value > 0) in logarithms, with std_error/value as the error of the logarithm."""
    x = np.stack([np.ones_like(speed), np.log(speed)], axis=1)
    log_error = None if std_error is None else std_error / value
    coefficients, covariance, dof = _least_squares(x, np.log(value), log_error, ROUNDING_SHARE)
    error = value - np.exp(x @ coefficients)
    return Regression("power", (), coefficients, covariance, dof, _r2(value, error), _rms(error))


def t_factor(dof: int, tests: int = 1) -> float:
    """Return the two-sided 95 % quantile of Student's t, with Bonferroni's correction for `tests`; the normal one for dof 0."""
    return student_quantile(1.0 - (1.0 - CONFIDENCE_LEVEL) / (2 * tests), dof)


def rounding_of(value: FloatArray) -> float:
    """Return the size of the rounding errors of values (n,)."""
    return ROUNDING_SHARE * float(np.max(np.abs(value)))


def _least_squares(
    x: FloatArray, y: FloatArray, std_error: FloatArray | None, rounding: float
) -> tuple[FloatArray, FloatArray, int]:
    weight = np.ones_like(y) if std_error is None else 1.0 / std_error
    q, r = np.linalg.qr(x * weight[:, None])
    if not bool(np.all(np.abs(np.diag(r)) > 0.0) and np.all(np.isfinite(r))):
        raise DataError(
            "no law can be drawn through these points", found="speeds or standard errors that are zero or beyond all bounds",
            hint="check the column of speeds and those of standard errors",
        )  # fmt: skip
    coefficients = np.linalg.solve(r, q.T @ (y * weight))
    inverse = np.linalg.inv(r)
    dof = y.size - x.shape[1]
    residual = np.hypot(y - x @ coefficients, rounding) * weight
    scatter = float(np.sum(residual**2)) / dof if dof > 0 else float("nan")
    if std_error is not None:
        scatter = max(1.0, scatter) if dof > 0 else 1.0
    return coefficients, np.asarray(inverse @ inverse.T * scatter), dof


def _r2(value: FloatArray, error: FloatArray) -> float:
    total = float(np.sum((value - value.mean()) ** 2))
    return 1.0 - float(np.sum(error**2)) / total if total > value.size * rounding_of(value) ** 2 else float("nan")


def _rms(error: FloatArray) -> float:
    return float(np.sqrt(np.mean(error**2)))
