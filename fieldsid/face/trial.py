"""`sysid compare OLD NEW` and `sysid report` as functions."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from fieldsid.face.arguments import File, load_user_effects, vehicle_of
from fieldsid.face.models import Models, source_of

if TYPE_CHECKING:
    from fieldsid.change.record import Change
    from fieldsid.vehicle import Vehicle


def compare_models(old: Models, new: Models, *, vehicle: Vehicle | File | None = None) -> Change:
    """Return which parameters and effects differ between two states by more than their errors, and what that means for the gains.

    old, new: the models of one axis before and after, with a speed in common. vehicle: gives the fin's limit and rate; by default
    that of the working folder, else the limit is the largest fin angle in the old models' runs. Raises UsageError for models
    of two axes or without a common speed.
    """
    from fieldsid.change.compare import compare_models as compare_sources
    from fieldsid.schedule.linear_plant import FinLimits

    load_user_effects()
    before, known = source_of(old), vehicle_of(vehicle)
    limit, stated = known.fin_max_rad(before.axis.value), FinLimits(rate=known.fin_rate_rad_s)
    return compare_sources(before, source_of(new), fin_limit=limit, stated=stated)


def report(folder: File = ".", output: File | None = None, *, force: bool = False) -> Path:
    """Write the results of a trial folder to one HTML file, or to a PDF where the output ends in .pdf, and return its path.

    output: by default `report.html` in the folder. Raises UsageError for a folder without runs and models and for another
    suffix, ArtifactError for a file that exists, unless forced, and for a PDF without a browser.
    """
    from fieldsid.reporting.write import written
    from fieldsid.trial_folder.state import state_of

    load_user_effects()
    place = Path(folder)
    path = Path(output) if output is not None else place / "report.html"
    written(state_of(place), path, force=force)
    return path
