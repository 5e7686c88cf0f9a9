"""The kinds of noise: the processes of which each consists, and the bounds of each parameter.

To add a kind of the processes that are here, add a `NoiseKind`. To add a process, add its parameters to `models.model.Noise` and
to NOISE_PARAMETERS, and its state to `kalman/univariate.py`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fieldsid.noise.white_floor import MIN_ANGLE_NOISE_RAD, MIN_RATE_NOISE_RAD_S

SEA_TIMES_S = (0.5, 8.0)
"""95 % prior range of the correlation time (s) of the moment that the water exerts on a hull. The correlation time of a wave is a
sixth of its period, which is 3 s (chop) to 15 s (swell); an eddy as long as the hull, 1 to 6 m, passes it at 1.5 m/s in 0.7 to 4
s. The upper limit is twice as long. Anything slower is not the sea but a change of the trim, which is an effect: without this
prior a drift of the trim was explained by a disturbance of 25 to 30 s. The two banks of simulated logs have 0.3 to 2 and 2 to 5
s."""
STANDARD_DEVIATIONS = 4.0
"""Width of the 95 % range of a normal distribution in standard deviations."""


@dataclass(frozen=True, slots=True)
class NoiseParameter:
    """Bounds of a field of `Noise`, and its value where a kind does not have it; a standard deviation (SI) or a time in s.

    `usual` are the limits of the 95 % range of its log-normal prior; None where there is no prior.
    """

    low: float
    high: float
    absent: float = 0.0
    is_standard_deviation: bool = True
    usual: tuple[float, float] | None = None

    @property
    def log_prior(self) -> tuple[float, float]:
        """Median and precision of the prior of its logarithm; the precision is zero where there is no prior."""
        if self.usual is None:
            return 0.0, 0.0
        low, high = np.log(self.usual)
        return 0.5 * float(low + high), (STANDARD_DEVIATIONS / float(high - low)) ** 2


@dataclass(frozen=True, slots=True)
class NoiseKind:
    """The fields of `Noise` that are estimated, and the sentence that describes residuals of this kind."""

    fields: tuple[str, ...]
    says: str

    @property
    def absent(self) -> tuple[int, ...]:
        """The indices in the noise vector of the standard deviations that are zero."""
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
"""The kinds under which models are compared, and the kind that combines them."""
