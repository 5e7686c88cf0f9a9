"""Fin limits of vehicle.yaml that the runs of a trial contradict, as a fin went further."""

from __future__ import annotations

from fieldsid.errors import FieldsidError
from fieldsid.logs.run import Note
from fieldsid.page import counted
from fieldsid.trial_folder.state import RUN, FolderState
from fieldsid.vehicle import find_vehicle


def contradicted_limits(state: FolderState) -> list[Note]:
    """Return a note for each fin that went beyond its limit (rad) in an imported run, or why vehicle.yaml cannot be read."""
    try:
        vehicle = find_vehicle(state.folder)
    except FieldsidError as error:  # the overview of the folder is shown nevertheless
        return [Note("vehicle", "; ".join(p for p in (error.what, error.found, error.hint) if p), {})]
    if vehicle is None:
        return []
    found = []
    for fin, limit in (("rudder", vehicle.rudder_max_rad), ("elevator", vehicle.elevator_max_rad)):
        reach = [r for i in state.of_kind(RUN) for name, r in i.fins.items() if name.startswith(fin)]
        beyond = [r for r in reach if limit is not None and r > limit]
        if beyond:
            runs = counted(len(beyond), "run")
            message = (
                f"vehicle.yaml: `{fin}_max_rad: {limit:.4g}` is less than the {max(beyond):.4g} rad that the {fin} went to in "
                f"{runs}: correct it, or log the measured fin where it stopped"
            )
            found.append(Note("fin_limit", message, {"signal": f"{fin}_rad", "value": max(beyond), "limit": limit}))
    return found
