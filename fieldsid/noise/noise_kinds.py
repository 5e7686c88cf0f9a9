"""The kinds of noise: which processes each holds, and the bounds of each parameter.

To add a kind of the processes that are here, add a `NoiseKind`. To add a process, add its parameters to `models.model.Noise` and
to NOISE_PARAMETERS, and its state to `kalman/univariate.py`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fieldsid.noise.white_floor import MIN_ANGLE_NOISE_RAD, MIN_RATE_NOISE_RAD_S

SEA_TIMES_S = (0.5, 8.0)
"""Correlation times (s) of a moment that the water turns a hull by, 95 of 100. A wave has lost its memory after a sixth of its
period, 3 s of chop to 15 s of swell; an eddy as long as the hull, 1 to 6 m, passes it at 1.5 m/s in 0.7 to 4 s. As much again is
left to the slow. What moves more slowly yet is no sea but a trim that changes, which is an effect: without the prior a drift of
the trim was left to a disturbance of 25 to 30 s. The two banks, by different hands, have 0.3 to 2 and 2 to 5 s."""
STANDARD_DEVIATIONS = 4.0
"""Standard deviations of a normal distribution between which 95 of 100 lie."""


@dataclass(frozen=True, slots=True)
class NoiseParameter:
    """Bounds of a field of `Noise`, and its value where a kind does not have it; a standard deviation (SI) or a time in s.

    `usual` are the limits between which 95 of 100 lie before anything is measured, log-normally; None where nothing is known.
    """

    low: float
    high: float
    absent: float = 0.0
    is_standard_deviation: bool = True
    usual: tuple[float, float] | None = None

    @property
    def log_prior(self) -> tuple[float, float]:
        """Median and precision of the prior of its logarithm; a precision of zero where nothing is known."""
        if self.usual is None:
            return 0.0, 0.0
        low, high = np.log(self.usual)
        return 0.5 * float(low + high), (STANDARD_DEVIATIONS / float(high - low)) ** 2


@dataclass(frozen=True, slots=True)
class NoiseKind:
    """Fields of `Noise` that are estimated, and what residuals of this kind are said to be."""

    fields: tuple[str, ...]
    says: str

    @property
    def absent(self) -> tuple[int, ...]:
        """The places in the noise vector of the standard deviations that are zero."""
        return tuple(i for i, (n, p) in enumerate(NOISE_PARAMETERS.items()) if p.is_standard_deviation and n not in self.fields)


NOISE_PARAMETERS = {
    "angle": NoiseParameter(MIN_ANGLE_NOISE_RAD, 1.0),
    "rate": NoiseParameter(MIN_RATE_NOISE_RAD_S, 1.0),
    "disturbance": NoiseParameter(1e-7, 10.0),
    "disturbance_time": NoiseParameter(0.1, 30.0, absent=1.0, is_standard_deviation=False, usual=SEA_TIMES_S),
    "coloured_angle": NoiseParameter(1e-7, 1.0),
    "coloured_rate": NoiseParameter(1e-7, 1.0),
    "coloured_time": NoiseParameter(0.05, 30.0, absent=1.0, is_standard_deviation=False),
}
NOISE_FIELDS = tuple(NOISE_PARAMETERS)
"""The order of a noise vector."""
LOG_MEDIANS, LOG_PRECISIONS = np.array([p.log_prior for p in NOISE_PARAMETERS.values()]).T
"""Medians and precisions (7,) of the prior of the logarithms of a noise vector."""
IS_STANDARD_DEVIATION: npt.NDArray[np.bool_] = np.array([p.is_standard_deviation for p in NOISE_PARAMETERS.values()])

NOISE_KINDS = {
    "white": NoiseKind(("angle", "rate"), "no coloured noise fits them better than white noise"),
    "disturbance": NoiseKind(
        ("angle", "rate", "disturbance", "disturbance_time"),
        "of the noises compared a disturbance moment fits them best",
    ),
    "coloured": NoiseKind(
        ("angle", "rate", "coloured_angle", "coloured_rate", "coloured_time"),
        "of the noises compared coloured sensor noise fits them best",
    ),
    "both": NoiseKind(NOISE_FIELDS, "of the noises compared a disturbance moment with coloured sensor noise fits them best"),
}
"""The kinds that a fit compares, simple ones first."""
SINGLE_NOISE_KINDS, JOINT_NOISE = ("disturbance", "coloured"), "both"
"""The kinds that models are compared under, and all of them together."""
