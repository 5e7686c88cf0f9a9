"""Selection of the warnings among the notes of a fit and its logs: problems, and only of signals that the axis uses."""

from __future__ import annotations

from fieldsid.logs.run import READ_AS, READ_WITH, Note
from fieldsid.models.axis import NAMES, Axis

METHOD_CHOSEN = "method_chosen"
"""Code of the note that says why `auto` took a method."""
NO_WARNING = (READ_WITH, READ_AS, "noise_model", "fin_measured_used", METHOD_CHOSEN)
"""Codes of notes that describe the procedure and no problem."""


def is_warning(note: Note, axis: Axis) -> bool:
    """Whether a note is a warning; one about a signal is a warning only where the axis uses the signal."""
    names = NAMES[axis]
    used = {names.angle, names.rate, names.fin, names.fin_measured, names.cross, "surge_m_s"}
    return note.code not in NO_WARNING and note.data.get("signal", names.angle) in used
