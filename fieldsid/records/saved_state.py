"""The state of an object as plain values, by the attributes that its `STATE` names, and the object restored from them.

An array is a flat list; a number that is not finite is null, and NaN again when it is restored. What is restored has been checked
against a shape (`check.py`).
"""

from __future__ import annotations

from collections.abc import Mapping
from math import isfinite, nan
from typing import Any

import numpy as np


def state_of(value: Any) -> Any:
    """Return a value as plain values; the names of attributes are without their leading underscore."""
    if hasattr(value, "STATE"):
        return {name.lstrip("_"): state_of(getattr(value, name)) for name in value.STATE}
    if isinstance(value, Mapping):
        return {name: state_of(v) for name, v in value.items()}
    if isinstance(value, np.ndarray):
        return [v if isfinite(v) else None for v in value.ravel().tolist()]
    if isinstance(value, (list, tuple)):
        return [state_of(v) for v in value]
    return None if isinstance(value, float) and not isfinite(value) else value


def restored(value: Any, state: Any) -> Any:
    """Return a value like the one given with the numbers of a state, an object with a `STATE` changed in place.

    Raises KeyError, ValueError or TypeError where the state is not of such a value.
    """
    if hasattr(value, "STATE"):
        for name in value.STATE:
            setattr(value, name, restored(getattr(value, name), state[name.lstrip("_")]))
        return value
    if isinstance(value, np.ndarray):
        return np.array(state, dtype=np.float64).reshape(-1, *value.shape[1:])
    if isinstance(value, Mapping):
        return {name: restored(v, state[name]) for name, v in value.items()}
    return _item(state) if isinstance(value, list) or state is None else type(value)(state)


def _item(state: Any) -> Any:
    """Return a list of plain values with tuples for the lists in it, and NaN for null."""
    if isinstance(state, list):
        return [tuple(part) if isinstance(part := _item(one), list) else part for one in state]
    return nan if state is None else state
