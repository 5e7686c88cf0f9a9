"""The residual error of a model over the noise floor, as its file records it: what is derived from the model depends on it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from math import isfinite
from typing import TYPE_CHECKING, Any

from fieldsid.comparison.sufficient import is_noise, over_noise

if TYPE_CHECKING:
    from fieldsid.models.model import Model

DISTURBED = "pem"
"""The method that attributes residuals to a disturbance: its free-run error does not show that an effect is missing."""


def left_by_addition(info: Mapping[str, Any]) -> float:
    """Return the residual error of an extended model, the larger of fitted and unseen runs; NaN for one not extended."""
    record = info.get("extension") or {}
    over = (over_noise(errors, record.get("noise_floor") or {}) for errors in (record.get("after") or {}).values())
    return max((o for o in over if isfinite(o)), default=float("nan"))


def lacking(models: Iterable[Model]) -> float:
    """Return the largest residual error of some models, each by its last addition or else its fit; NaN where all are noise.

    Models whose files do not record it are left out.
    """
    over = [left_by_addition(m.info) if "extension" in m.info else _error_of_fit(m) for m in models]
    return max((o for o in over if not is_noise(o)), default=float("nan"))


def _error_of_fit(model: Model) -> float:
    residual = model.info.get("left") or {}
    return over_noise(residual, residual.get("noise_floor") or {}) if model.method != DISTURBED else float("nan")
