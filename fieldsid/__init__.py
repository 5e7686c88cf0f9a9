"""fieldsid: from a short excitation log of an underwater vehicle to a model, its missing effect, a radius and gains."""

from fieldsid._version import __version__

__all__ = ["__version__"]
