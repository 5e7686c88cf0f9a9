"""A model with one physical effect more, kept only where that pays, and the line of models it comes from."""

from fieldsid.extension.extend import Extension, Gain, extend_in_steps, whole_of
from fieldsid.extension.lineage import (
    CHANGED,
    INTACT,
    MISSING,
    Generation,
    Step,
    history_of,
    kept_by,
    parent_of,
    save_extension,
    save_steps,
)
from fieldsid.extension.loop import Loop, LoopStep, loop_of

__all__ = [
    "CHANGED",
    "INTACT",
    "MISSING",
    "Extension",
    "Gain",
    "Generation",
    "Loop",
    "LoopStep",
    "Step",
    "extend_in_steps",
    "history_of",
    "kept_by",
    "loop_of",
    "parent_of",
    "save_extension",
    "save_steps",
    "whole_of",
]
