"""Leave out a measured fin that is the command itself, as a simulator without a servo logs it.

A measured fin is a line between its samples, and a command is held. A copy taken for a measurement would move the fin half a
sample before its command, and would hide a servo that was not measured.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from fieldsid.logs.run import FINS, Note
from fieldsid.numerics.arrays import FloatArray


def without_copied_fins(signals: Mapping[str, FloatArray]) -> tuple[dict[str, FloatArray], list[Note]]:
    """Return the signals (n,) without measured fins that equal a moving command at every sample, and a note on each."""
    copies = {
        measured: command
        for command, measured in zip(FINS[:2], FINS[2:], strict=True)
        if {command, measured} <= signals.keys()
        and np.array_equal(signals[command], signals[measured], equal_nan=True)
        and np.unique(signals[command][np.isfinite(signals[command])]).size > 1
    }
    notes = [
        Note(
            "copied",
            f"{measured} equals {command} at all {signals[command].size} samples: it is the command again, no measurement of the "
            "fin, and is left out",
            {"signal": measured, "count": int(signals[command].size)},
        )
        for measured, command in copies.items()
    ]
    return {s: v for s, v in signals.items() if s not in copies}, notes
