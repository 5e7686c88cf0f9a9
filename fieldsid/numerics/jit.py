"""The typed interface to numba: `@jit` compiles a function once and caches it on disk, `@inner` marks what it calls.

On a vehicle's computer without numba functions stay plain Python: the online estimate needs 31 us a sample then. Fits of whole
logs would take minutes.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from hashlib import sha256
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any, ParamSpec, TypeVar, cast

P = ParamSpec("P")
R = TypeVar("R")
HAS_NUMBA = find_spec("numba") is not None


def jit(function: Callable[P, R]) -> Callable[P, R]:
    """Return the function compiled by numba, without Python objects, division by zero giving inf as in NumPy."""
    if not HAS_NUMBA:
        return function
    numba: Any = import_module("numba")
    return cast("Callable[P, R]", numba.njit(cache=True, error_model="numpy", no_cfunc_wrapper=True)(function))


def inner(function: Callable[P, R]) -> Callable[P, R]:
    """Return the function as it is, which functions of `jit` may call, compiled with them; called from Python it is plain."""
    if not HAS_NUMBA:
        return function
    numba: Any = import_module("numba.extending")
    decorator = numba.register_jitable(error_model="numpy", no_cpython_wrapper=True, no_cfunc_wrapper=True)
    return cast("Callable[P, R]", decorator(function))


def plain_of(function: Callable[P, R]) -> Callable[P, R]:
    """Return the Python function behind a compiled one; it is the oracle of the tests."""
    return cast("Callable[P, R]", getattr(function, "py_func", function))


def is_loaded(function: Callable[..., object]) -> bool:
    """Whether a function needs nothing more before it runs: it has run in this process, or is plain Python."""
    return not hasattr(function, "py_func") or bool(cast("Any", function).signatures)


def warmup_marker(functions: Sequence[Callable[..., object]]) -> Path:
    """Return the file, in numba's cache folder, that exists once all of these functions are compiled on this machine.

    Its name changes with what numba compiles anew for: the source files, numba's and Python's version, the processor.
    """
    parts = [import_module("numba").__version__, sys.version, import_module("llvmlite.binding").get_host_cpu_name()]
    for source in sorted({cast("Any", f).py_func.__code__.co_filename for f in functions}):
        known = Path(source).stat()
        parts.append(f"{source} {known.st_mtime_ns} {known.st_size}")
    stamp = sha256("\n".join(parts).encode()).hexdigest()[:16]
    return Path(cast("Any", functions[0]).stats.cache_path) / f"fieldsid-{stamp}.nbm"
