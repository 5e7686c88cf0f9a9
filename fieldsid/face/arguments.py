"""What a step takes where nothing is given: the folder's vehicle and effects, the limits of the fin, the models' own runs."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Sequence
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

from fieldsid.effects._user_folder import add_user_effects
from fieldsid.errors import ArtifactError, FieldsidError, UsageError
from fieldsid.models.allocation import PlaneFins
from fieldsid.models.axis import Axis
from fieldsid.records.named_inputs import where_now
from fieldsid.registry import near
from fieldsid.vehicle import Vehicle, find_vehicle, load_vehicle

if TYPE_CHECKING:
    from fieldsid.logs.channels import ChannelMap
    from fieldsid.logs.run import Run
    from fieldsid.plant.parameter_source import NamedLog, ParameterSource
    from fieldsid.schedule.record import Schedule

File: TypeAlias = "str | PathLike[str]"
OWN_EFFECTS = Path("effects")
UNKNOWN = Vehicle("")
"""A vehicle that nothing is stated of."""


def own_effects() -> None:
    """Make the user's effects of the working folder known, as every command does; raises EffectError naming the file."""
    if OWN_EFFECTS.is_dir():
        add_user_effects(OWN_EFFECTS)


def axis_of(axis: Axis | str | None) -> Axis | None:
    """Return an axis by its name, None for None; raises UsageError."""
    if axis is None:
        return None
    known = [a.value for a in Axis]
    if axis not in known:
        raise UsageError(f"there is no axis {axis!r}", found=", ".join(known), hint=near(str(axis), known))
    return Axis(axis)


def axis_excited(runs: Sequence[Run], written: str = '`axis="{axis}"`') -> Axis:
    """Return the axis that runs excite; written: how one is stated. Raises what `excited_axis` does."""
    from fieldsid.logs.segments import excited_axis

    return Axis(excited_axis(runs, written=written))


def names_of(names: str | Iterable[str] | None) -> tuple[str, ...]:
    """Return names given one by one, or as the command line takes them, `a,b` or `a+b`; none where none are given."""
    parts = re.split(r"[,+\s]+", names) if isinstance(names, str) else names or ()
    return tuple(n.strip() for n in parts if n.strip())


def vehicle_of(vehicle: Vehicle | File | None) -> Vehicle:
    """Return a vehicle, that of a file, or without one that of the working folder, else one that states nothing.

    Raises VehicleError.
    """
    if isinstance(vehicle, Vehicle):
        return vehicle
    return (find_vehicle(Path()) or UNKNOWN) if vehicle is None else load_vehicle(Path(vehicle))


def fins_of(vehicle: Vehicle, axis: Axis) -> PlaneFins | None:
    """Return the fins that an axis' command is made of; None where it is one."""
    return None if vehicle.fins is None else vehicle.fins.of(axis.value)


def fin_limit_of(vehicle: Vehicle, source: ParameterSource, say: Callable[[str], None], fin: str = "fin limit") -> float:
    """Return the largest angle of the fin in rad where none is given: the vehicle's limit, or that of the models' runs.

    say is called with the last, and what the `fin` is called. Raises UsageError where there is none.
    """
    if (limit := vehicle.fin_max_rad(source.axis.value)) is not None:
        return limit
    fins: Sequence[float] = [m.trained["fin_max"] for m in source.models if m.trained.get("fin_max", 0.0) > 0]
    if not fins:
        raise UsageError("how far does the fin go", found="no --fin-max and no vehicle.yaml", hint="add `--fin-max 0.26`")
    say(f"{fin}: {max(fins):.4g} rad, the largest in the models' runs; `--fin-max` takes another")
    return max(fins)


def read_again(log: NamedLog, mapping: ChannelMap | None = None) -> Run:
    """Return the run of a log that a model names, by a mapping, else by that of then; raises as `load_run` does."""
    from fieldsid.logs import load_run

    return load_run(str(log.now), log.mapping if mapping is None else mapping, recognise=True)


def run_files(source: ParameterSource, say: Callable[[str], None]) -> list[NamedLog]:
    """Return the logs that the model files of a source name, where they still are; say is called where some are not.

    Models without effects go by a formula, which needs none.
    """
    from fieldsid.plant.parameter_source import logs_of

    if not any(m.effects for m in source.models):
        return []
    named = logs_of(source.paths)
    there = [log for log in named if log.now is not None]
    if len(there) < len(named):
        say("some runs of the models are not where they were: name them with `--runs` for the loss of speed")
    return there


def runs_behind(source: ParameterSource, say: Callable[[str], None]) -> list[Run]:
    """Return the runs that the models of a yaw source came from, where they still are: they have the speed lost in a turn."""
    from fieldsid.logs.several.sifting import attempt
    from fieldsid.plant.parameter_source import logs_of
    from fieldsid.runtime.parallel_map import parallel_map

    if not source.models or not source.paths or source.axis is not Axis.YAW:
        return []
    named = logs_of(source.paths)
    there = [log for log in named if log.now is not None]
    runs = [run for run in parallel_map(lambda log: attempt(read_again, log), there) if not isinstance(run, FieldsidError)]
    if len(runs) < len(named):
        lost = f"{len(named) - len(runs)} of {len(named)} runs of the models"
        say(f"{lost} are gone, closed or outside of this folder: the speed lost in a turn is not measured in them")
    return runs


def designed_from(schedule: Schedule, name: str) -> list[Path]:
    """Return the files of the models a schedule was designed from; raises ArtifactError where they are not there any more."""
    named = [(m["path"], where_now(m, Path(name))) for m in schedule.provenance.get("models", [])]
    missing = [said for said, p in named if p is None]
    if not named or missing:
        raise ArtifactError(
            f"the models of `{name}` are not where they were",
            found=", ".join(missing) or "none named",
            hint=f"name them: `sysid schedule verify {name} --model MODEL`",
        )
    return [p for _, p in named if p is not None]
