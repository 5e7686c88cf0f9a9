"""One typed door to numba: `@jit` compiles a function once and caches it on disk, `@inner` what it calls."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any, ParamSpec, TypeVar, cast

P = ParamSpec("P")
R = TypeVar("R")


def jit(function: Callable[P, R]) -> Callable[P, R]:
    """Return the function compiled by numba, without Python objects, division by zero giving inf as in NumPy."""
    numba: Any = import_module("numba")
    return cast("Callable[P, R]", numba.njit(cache=True, error_model="numpy")(function))


def inner(function: Callable[P, R]) -> Callable[P, R]:
    """Return the function as it is, which functions of `jit` may call: compiled with them, without a door from Python."""
    numba: Any = import_module("numba.extending")
    door = numba.register_jitable(error_model="numpy", no_cpython_wrapper=True, no_cfunc_wrapper=True)
    return cast("Callable[P, R]", door(function))


def plain_of(function: Callable[P, R]) -> Callable[P, R]:
    """Return the Python function behind a compiled one; it is the oracle of the tests."""
    return cast("Callable[P, R]", getattr(function, "py_func", function))


def is_loaded(function: Callable[..., object]) -> bool:
    """Whether a function needs nothing more before it runs: it has run in this process, or is plain Python."""
    return not hasattr(function, "py_func") or bool(cast("Any", function).signatures)


def is_compiled(function: Callable[..., object]) -> bool:
    """Whether a function is compiled in this process, or by an earlier one that left it on the disk, newer than its source."""
    if is_loaded(function):
        return True
    door: Any = function
    code = door.py_func.__code__
    source = Path(code.co_filename)
    kept = Path(door.stats.cache_path).glob(f"{source.stem}.{door.py_func.__qualname__}-{code.co_firstlineno}.*.nbi")
    return any(file.stat().st_mtime >= source.stat().st_mtime for file in kept)
