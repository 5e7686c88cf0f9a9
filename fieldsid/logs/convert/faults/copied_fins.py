"""Leave out a measured fin that is the command itself, as a simulator without a servo logs it.

A measured fin is a line between its samples, and a command is held. A copy taken for a measurement would move the fin half a
sample before its command, and would hide a servo that was not measured.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from fieldsid.logs.run import MEASURED_FIN, Note
from fieldsid.numerics.arrays import FloatArray


def without_copied_fins(signals: Mapping[str, FloatArray]) -> tuple[dict[str, FloatArray], list[Note]]:
    """Return the signals (n,) without measured fins that equal a moving command at every sample, and a note on each."""
    kept, notes = dict(signals), list[Note]()
    for command, measured in MEASURED_FIN.items():
        one, other = signals.get(command), signals.get(measured)
        if (
            one is None
            or other is None
            or not np.array_equal(one, other, equal_nan=True)
            or np.unique(one[np.isfinite(one)]).size < 2
        ):
            continue
        message = (
            f"{measured} equals {command} at all {one.size} samples: it is the command again, no measurement of the fin, and "
            "is left out"
        )
        del kept[measured]
        notes.append(Note("copied", message, {"signal": measured, "count": int(one.size)}))
    return kept, notes
