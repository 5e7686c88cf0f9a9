"""A model with one physical effect more, kept only where that pays, and the line of models it comes from."""

from fieldsid.extension.extend import Extension, Gain, extend
from fieldsid.extension.lineage import Generation, Step, history_of, parent_of, save_extension

__all__ = ["Extension", "Gain", "Generation", "Step", "extend", "history_of", "parent_of", "save_extension"]
