"""Defaults of the steps: the working folder's vehicle and effects, the fin's limit, the runs that models were fitted to."""

from __future__ import annotations

import logging
import re
from collections.abc import Iterable, Sequence
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

from fieldsid.effects._user_folder import add_user_effects
from fieldsid.errors import ArtifactError, UsageError
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
"""A vehicle without any stated property."""
say = logging.getLogger("fieldsid").info
"""Tells the user something: a command prints it on stderr, a script has it in this logger, at level INFO."""


def load_user_effects() -> None:
    """Register the user's effects of the working folder, as every command does; raises EffectError naming the file."""
    if OWN_EFFECTS.is_dir():
        add_user_effects(OWN_EFFECTS)


def axis_of(axis: Axis | str | None) -> Axis | None:
    """Return the axis of a name, None for None; raises UsageError for an unknown name."""
    if axis is None:
        return None
    known = [a.value for a in Axis]
    if axis not in known:
        raise UsageError(f"there is no axis {axis!r}", found=", ".join(known), hint=near(str(axis), known))
    return Axis(axis)


def axis_excited(runs: Sequence[Run], written: str = '`axis="{axis}"`') -> Axis:
    """Return the axis that runs excite; raises as `excited_axis` does.

    written: how the caller states an axis, for the hint of an error.
    """
    from fieldsid.logs.segments import excited_axis

    return Axis(excited_axis(runs, written=written))


def names_of(names: str | Iterable[str] | None) -> tuple[str, ...]:
    """Return names from a sequence, or from a text as the command line takes it, `a,b` or `a+b`; none for None."""
    parts = re.split(r"[,+\s]+", names) if isinstance(names, str) else names or ()
    return tuple(n.strip() for n in parts if n.strip())


def vehicle_of(vehicle: Vehicle | File | None) -> Vehicle:
    """Return the given vehicle, that of a file, or for None that of the working folder; without any of them UNKNOWN.

    Raises VehicleError.
    """
    if isinstance(vehicle, Vehicle):
        return vehicle
    return (find_vehicle(Path()) or UNKNOWN) if vehicle is None else load_vehicle(Path(vehicle))


def fins_of(vehicle: Vehicle, axis: Axis) -> PlaneFins | None:
    """Return the fins that together make the command of an axis; None where it is a single fin."""
    return None if vehicle.fins is None else vehicle.fins.of(axis.value)


def fin_limit_of(vehicle: Vehicle, source: ParameterSource, fin: str = "fin limit") -> float:
    """Return the largest fin angle in rad: the vehicle's limit, else the largest angle in the models' runs.

    A message tells of the second case, in which `fin` names the fin. Raises UsageError where neither is known.
    """
    if (limit := vehicle.fin_max_rad(source.axis.value)) is not None:
        return limit
    fins: Sequence[float] = [m.trained["fin_max"] for m in source.models if m.trained.get("fin_max", 0.0) > 0]
    if not fins:
        raise UsageError("how far does the fin go", found="no --fin-max and no vehicle.yaml", hint="add `--fin-max 0.26`")
    say(f"{fin}: {max(fins):.4g} rad, the largest in the models' runs; `--fin-max` takes another")
    return max(fins)


def read_again(log: NamedLog, mapping: ChannelMap | None = None) -> Run:
    """Return the run of a log that a model names, read with a mapping, else with its former one; raises as `load_run` does."""
    from fieldsid.logs import load_run

    return load_run(str(log.now), log.mapping if mapping is None else mapping, recognise=True)


def runs_of_models(
    source: ParameterSource, mapping: ChannelMap | None = None, *, hint: str = "", depth: bool = False
) -> list[Run]:
    """Return the runs to which the models of a source were fitted, which show the speed lost in turns, or the path of a dive.

    Each is read with the mapping, else with its former one. Those that cannot be read again are left out, and a message has their
    names and the hint. Empty for a source that is no model, and for pitch without `depth`.
    """
    from fieldsid.logs.few_of import few_of
    from fieldsid.logs.run import Run
    from fieldsid.logs.several.sifting import attempt
    from fieldsid.plant.parameter_source import logs_of
    from fieldsid.runtime.parallel_map import parallel_map

    if not source.models or (source.axis is not Axis.YAW and not depth):
        return []
    named = logs_of(source.paths)
    outcomes = parallel_map(lambda log: None if log.now is None else attempt(lambda of: read_again(of, mapping), log), named)
    if missing := [f"`{log.now or log.named}`" for log, run in zip(named, outcomes, strict=True) if not isinstance(run, Run)]:
        what = "speed lost in a turn" if source.axis is Axis.YAW else "path of a dive"
        say(f"the {what} is not measured in runs of the models that cannot be read again: {few_of(missing)}{hint}")
    return [run for run in outcomes if isinstance(run, Run)]


def runs_of_turn(source: ParameterSource, mapping: ChannelMap | None = None) -> list[Run]:
    """Return the runs of `runs_of_models` for a turning radius; none for models without effects, whose radius is a formula."""
    if not any(m.effects for m in source.models):
        return []
    return runs_of_models(source, mapping, hint="; `--runs` takes others")


def designed_from(schedule: Schedule, name: str) -> list[Path]:
    """Return the model files that a schedule was designed from; raises ArtifactError where one of them no longer exists."""
    named = [(m["path"], where_now(m, Path(name))) for m in schedule.provenance.get("models", [])]
    missing = [path for path, now in named if now is None]
    if not named or missing:
        raise ArtifactError(
            f"the models of `{name}` are not where they were",
            found=", ".join(missing) or "none named",
            hint=f"name them: `sysid schedule verify {name} --model MODEL`",
        )
    return [now for _, now in named if now is not None]
