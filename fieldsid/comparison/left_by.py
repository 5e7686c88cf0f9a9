"""What a model's own record says that it leaves, over the noise floor: what is made of it rests on that."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from math import isfinite
from typing import TYPE_CHECKING, Any

from fieldsid.comparison.sufficient import is_noise, over_noise

if TYPE_CHECKING:
    from fieldsid.models.model import Model

DISTURBED = "pem"
"""The method whose fit takes what is left for a disturbance: the free-run error says nothing of an effect there."""


def left_by_addition(info: Mapping[str, Any]) -> float:
    """Return what an extended model leaves, the larger of fitted and unseen runs; NaN for one that was not extended."""
    record = info.get("extension") or {}
    over = (over_noise(errors, record.get("noise_floor") or {}) for errors in (record.get("after") or {}).values())
    return max((o for o in over if isfinite(o)), default=float("nan"))


def lacking(models: Iterable[Model]) -> float:
    """Return the most that one of some models leaves, by its last addition or else its fit; NaN where that is the noise.

    Of a model whose record does not say nothing is known.
    """
    over = [left_by_addition(m.info) if "extension" in m.info else _left_by_fit(m) for m in models]
    return max((o for o in over if not is_noise(o)), default=float("nan"))


def _left_by_fit(model: Model) -> float:
    left = model.info.get("left") or {}
    return over_noise(left, left.get("noise_floor") or {}) if model.method != DISTURBED else float("nan")
