"""One typed door to numba: `@jit` compiles a function once, caches it on disk and keeps its signature."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from typing import Any, ParamSpec, TypeVar, cast

P = ParamSpec("P")
R = TypeVar("R")


def jit(function: Callable[P, R]) -> Callable[P, R]:
    """Return the function compiled by numba, without Python objects, division by zero giving inf as in NumPy."""
    numba: Any = import_module("numba")
    return cast("Callable[P, R]", numba.njit(cache=True, error_model="numpy")(function))


def plain_of(function: Callable[P, R]) -> Callable[P, R]:
    """Return the Python function behind a compiled one; it is the oracle of the tests."""
    return cast("Callable[P, R]", getattr(function, "py_func", function))
