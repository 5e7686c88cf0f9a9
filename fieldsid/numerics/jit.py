"""The typed interface to numba: `@jit` compiles a function once and caches it on disk, `@inner` marks what it calls.

A cache is code that will be executed. It is therefore in a folder of the user, and no file of the working folder may redirect it:
numba by default reads `.numba_config.yaml` there, which may come from somebody else.

On a vehicle's computer without numba, functions stay plain Python: the online estimate then needs 31 us for a sample. Fits of
entire logs would take minutes.
"""

from __future__ import annotations

import os
import sys
import warnings
from collections.abc import Callable, Sequence
from functools import cache
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
    numba = _numba()
    given = numba.config.CACHE_DIR
    numba.config.CACHE_DIR = given or cache_folder()  # numba reads it here only; the caller's functions keep their cache
    try:
        return cast("Callable[P, R]", numba.njit(cache=True, error_model="numpy", no_cfunc_wrapper=True)(function))
    finally:
        numba.config.CACHE_DIR = given


def inner(function: Callable[P, R]) -> Callable[P, R]:
    """Return the function, which functions of `jit` may call and compile in; called from Python it stays plain Python."""
    return _callable_when_compiled(function, forceinline=False)


def inlined(function: Callable[P, R]) -> Callable[P, R]:
    """Return the function as `inner` does, inlined into its callers: results that a caller ignores are not computed."""
    return _callable_when_compiled(function, forceinline=True)


def _callable_when_compiled(function: Callable[P, R], *, forceinline: bool) -> Callable[P, R]:
    if not HAS_NUMBA:
        return function
    options = {"error_model": "numpy", "no_cpython_wrapper": True, "no_cfunc_wrapper": True, "forceinline": forceinline}
    return cast("Callable[P, R]", _numba().extending.register_jitable(**options)(function))


def cache_folder() -> str:
    """Return the folder of compiled code in the user's cache folder; empty, for numba's default, where there is none.

    The variable NUMBA_CACHE_DIR takes precedence where it is set.
    """
    places = (os.environ.get("XDG_CACHE_HOME", ""), os.environ.get("LOCALAPPDATA", ""), os.path.expanduser("~/.cache"))  # noqa: PTH111
    place = next((p for p in places if os.path.isabs(p)), "")  # noqa: PTH117 - a relative one is one of the working folder
    return place and os.path.join(place, "fieldsid", "numba")  # noqa: PTH118


@cache
def _numba() -> Any:
    """Return numba, imported while `yaml` is hidden: without that library it cannot read settings from the working folder."""
    modules = cast("dict[str, Any]", sys.modules)
    hidden = {"yaml": modules["yaml"]} if "yaml" in modules else {}
    modules["yaml"] = None
    warnings.filterwarnings("ignore", "A Numba config file is found")  # it is issued for each function that is compiled
    try:
        numba = import_module("numba")
        import_module("numba.extending")
    finally:
        del modules["yaml"]
        modules.update(hidden)
    return numba


def plain_of(function: Callable[P, R]) -> Callable[P, R]:
    """Return the Python function behind a compiled one; it is the oracle of the tests."""
    return cast("Callable[P, R]", getattr(function, "py_func", function))


def is_loaded(function: Callable[..., object]) -> bool:
    """Whether a function runs without compiling or loading: it has run in this process, or is plain Python."""
    return not hasattr(function, "py_func") or bool(cast("Any", function).signatures)


def warmup_marker(functions: Sequence[Callable[..., object]]) -> Path:
    """Return the file, in numba's cache folder, that exists once all of these functions are compiled on this machine.

    Its name depends on all that makes numba compile again: the source files, the versions of numba and Python, the processor.
    """
    parts = [_numba().__version__, sys.version, import_module("llvmlite.binding").get_host_cpu_name()]
    for source in sorted({cast("Any", f).py_func.__code__.co_filename for f in functions}):
        known = Path(source).stat()
        parts.append(f"{source} {known.st_mtime_ns} {known.st_size}")
    stamp = sha256("\n".join(parts).encode()).hexdigest()[:16]
    return Path(cast("Any", functions[0]).stats.cache_path) / f"fieldsid-{stamp}.nbm"
