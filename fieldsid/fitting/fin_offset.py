"""The fin angle that is equivalent to the trim moment: delta_r0 = C0 / b2 in yaw, delta_s0 = Cb / d2 in pitch, in rad."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fieldsid.models.axis import NAMES
from fieldsid.models.model import Model


@dataclass(frozen=True, slots=True)
class Offset:
    """The derived fin offset: its name, value and standard error in rad."""

    name: str
    value: float
    std_error: float


def offset_of(model: Model) -> Offset:
    """Return the fin offset of a model at its reference speed, its error propagated from the covariance of trim and authority."""
    names = NAMES[model.axis]
    trim, authority = model.values[names.trim], model.values[names.authority]
    if authority == 0.0:
        return Offset(names.trim_fin, float("nan"), float("nan"))
    gradient = np.zeros(len(model.free))
    for name, slope in ((names.trim, 1.0 / authority), (names.authority, -trim / authority**2)):
        if name in model.free:
            gradient[model.free.index(name)] = slope
    variance = float(gradient @ model.covariance @ gradient)
    return Offset(names.trim_fin, trim / authority, float(np.sqrt(max(variance, 0.0))))
