"""fieldsid: from a short excitation log of an underwater vehicle to a model, its missing effect, a radius and gains.

    import fieldsid as fs

    runs = fs.load("runs/pulses_*.parquet")
    (fit,) = fs.identify(runs, "yaw", joint=True)
    print(fit.summary())

The functions take the arguments of the commands of their names (`sysid identify --help`) and return records: `summary()` is a
record in words, `to_frame()` a pandas table, `plot()` a matplotlib figure. A name is loaded when it is first used.
"""

from importlib import import_module

from fieldsid._version import __version__

TYPE_CHECKING = False
"""As in `typing`, which is not imported here: `python -m fieldsid` must first remove the working folder from the path."""
if TYPE_CHECKING:
    from typing import Any

    from fieldsid.change.record import Change
    from fieldsid.comparison.compare import Comparison
    from fieldsid.diagnosis import Candidate, Diagnosis
    from fieldsid.errors import FieldsidError
    from fieldsid.extension.extend import Extension
    from fieldsid.face.files import load_model, save
    from fieldsid.face.fits import compare, diagnose, extend, identify
    from fieldsid.face.gains import design_schedule, fit_laws, turn_radius, verify_schedule
    from fieldsid.face.runs import load
    from fieldsid.face.several import Several
    from fieldsid.face.trial import compare_models, report
    from fieldsid.fitting.fit import Fit
    from fieldsid.logs import Run
    from fieldsid.models.axis import Axis
    from fieldsid.models.model import Model
    from fieldsid.online.estimate import OnlineEstimate
    from fieldsid.online.identifier import OnlineIdentifier
    from fieldsid.plant.laws.axis_laws import Laws
    from fieldsid.schedule.record import Schedule
    from fieldsid.schedule.verify import Verification
    from fieldsid.turning.prediction import TurnPrediction

_MODULES = {
    "fieldsid.change.record": ("Change",),
    "fieldsid.comparison.compare": ("Comparison",),
    "fieldsid.diagnosis": ("Candidate", "Diagnosis"),
    "fieldsid.errors": ("FieldsidError",),
    "fieldsid.extension.extend": ("Extension",),
    "fieldsid.face.files": ("load_model", "save"),
    "fieldsid.face.fits": ("compare", "diagnose", "extend", "identify"),
    "fieldsid.face.gains": ("design_schedule", "fit_laws", "turn_radius", "verify_schedule"),
    "fieldsid.face.runs": ("load",),
    "fieldsid.face.several": ("Several",),
    "fieldsid.face.trial": ("compare_models", "report"),
    "fieldsid.fitting.fit": ("Fit",),
    "fieldsid.logs": ("Run",),
    "fieldsid.models.axis": ("Axis",),
    "fieldsid.models.model": ("Model",),
    "fieldsid.online.estimate": ("OnlineEstimate",),
    "fieldsid.online.identifier": ("OnlineIdentifier",),
    "fieldsid.plant.laws.axis_laws": ("Laws",),
    "fieldsid.schedule.record": ("Schedule",),
    "fieldsid.schedule.verify": ("Verification",),
    "fieldsid.turning.prediction": ("TurnPrediction",),
}
"""The modules of the names: the same as the imports above, which are for mypy and editors only."""

__all__ = [
    "Axis", "Candidate", "Change", "Comparison", "Diagnosis", "Extension", "FieldsidError", "Fit", "Laws", "Model",
    "OnlineEstimate", "OnlineIdentifier", "Run", "Schedule", "Several", "TurnPrediction", "Verification", "__version__",
    "compare", "compare_models", "design_schedule", "diagnose", "extend", "fit_laws", "identify", "load", "load_model",
    "report", "save", "turn_radius", "verify_schedule",
]  # fmt: skip


def __getattr__(name: str) -> "Any":
    module = next((module for module, names in _MODULES.items() if name in names), None)
    if module is None:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(module), name)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
