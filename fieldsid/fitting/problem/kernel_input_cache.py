"""The kernel inputs of each run at its last parameters: a residual and its sensitivities at one point assemble them once."""

from __future__ import annotations

from collections.abc import Callable, Hashable

from fieldsid.dynamics.assemble import KernelInputs


class KernelInputCache:
    """One entry for each run; it changes no result."""

    __slots__ = ("_entries",)

    def __init__(self) -> None:
        self._entries: dict[int, tuple[Hashable, KernelInputs]] = {}

    def get(self, run: int, key: Hashable, make: Callable[[], KernelInputs]) -> KernelInputs:
        """Return the kernel inputs of a run at a key: those of the last call with this key, or new ones."""
        last = self._entries.get(run)
        if last is None or last[0] != key:
            last = self._entries[run] = key, make()
        return last[1]
