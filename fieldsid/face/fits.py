"""`sysid identify`, `compare`, `diagnose` and `extend` as functions: from runs to a model, and to the effect that it lacks."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING

from fieldsid.errors import UsageError
from fieldsid.face.arguments import File, axis_excited, axis_of, load_user_effects, names_of, vehicle_of
from fieldsid.face.models import AnyModel, model_of
from fieldsid.face.runs import Logs, runs_mapped
from fieldsid.face.several import Several

if TYPE_CHECKING:
    from fieldsid.comparison.compare import Comparison
    from fieldsid.diagnosis import Diagnosis
    from fieldsid.extension.extend import Extension
    from fieldsid.fitting.fit import Fit
    from fieldsid.logs import ChannelMap, Run
    from fieldsid.logs.several.sifting import Refused
    from fieldsid.models.axis import Axis
    from fieldsid.vehicle import Vehicle


def identify(
    runs: Logs,
    axis: Axis | str | None = None,
    *,
    method: str = "auto",
    effects: str | Iterable[str] = (),
    joint: bool = False,
    whole: bool = False,
    start: float | None = None,
    end: float | None = None,
    bandwidth: float = 4.0,
    forgetting: float = 1.0,
    mapping: ChannelMap | File | None = None,
    vehicle: Vehicle | File | None = None,
    done: Callable[[], None] = lambda: None,
    unfit: Refused[Run] | None = None,
) -> Several[Fit]:
    """Return the fit of the yaw or pitch model to each run, or with `joint` a single fit to all of them.

    axis: by default the one that the runs excite. Of each run the part that excites the axis is used; all of it with `whole`, or
    the part from start to end in s. bandwidth: that of the state-variable filter in rad/s. forgetting: the factor of `svf_rls`.
    done: called after each fit. unfit: called with each of several runs that cannot be fitted, and the error, which is raised
    without it. Raises DataError for runs that do not allow the fit, UsageError for a method that does not take the effects or
    several runs, for an unknown effect and for runs that excite both axes or none, and as `load` does.
    """
    from fieldsid.fitting.identify import identify as fit_runs
    from fieldsid.fitting.problem.estimator import Options

    load_user_effects()
    plane, known = axis_of(axis), runs_mapped(runs, mapping, start, end)
    return Several(
        fit_runs(
            known,
            plane or axis_excited(known),
            method=method,
            effects=names_of(effects),
            joint=joint,
            whole=whole or start is not None or end is not None,
            options=Options(bandwidth, forgetting),
            vehicle=vehicle_of(vehicle),
            done=done,
            unfit=unfit,
        )
    )


def compare(
    model: AnyModel,
    runs: Logs,
    *,
    start: float | None = None,
    end: float | None = None,
    mapping: ChannelMap | File | None = None,
) -> Several[Comparison]:
    """Return the comparison of a model's free run with each run, and the conditions under which it fails.

    start, end: the part of each run, in s. Raises DataError for a run without the signals, ModelError where the simulation
    diverges, ArtifactError for a file that is no model, and as `load` does.
    """
    from fieldsid.comparison.compare import compare as compare_runs

    load_user_effects()
    return Several(compare_runs(model_of(model), runs_mapped(runs, mapping, start, end, models=[model])))


def diagnose(
    runs: Logs,
    axis: Axis | str | None = None,
    *,
    validate: Logs = (),
    model: AnyModel | None = None,
    mapping: ChannelMap | File | None = None,
    thorough: bool = False,
) -> Diagnosis:
    """Return which physical effect a model of the runs lacks, how sure that is, and what else it could be.

    axis: by default the model's, or that which the runs excite. validate: runs that no fit sees; without them a part of the runs
    is held out. model: one whose effects are known already. thorough: search until nothing is left to try. Raises
    DataError for a run that cannot be fitted, UsageError for a model of the other axis or runs that excite both or none,
    EffectError for an effect of the user's that fails, and as `load` does.
    """
    from fieldsid.diagnosis import diagnose as diagnose_runs

    load_user_effects()
    known, plane = None if model is None else model_of(model), axis_of(axis)
    if known is not None and plane is not None and known.axis is not plane:
        raise UsageError(f"that is a {known.axis.value} model", found=f"axis {plane.value}", hint=f'write `"{known.axis.value}"`')
    training, unseen = _training_and_unseen(runs, validate, mapping, model)
    plane = known.axis if known else plane or axis_excited(training)
    return diagnose_runs(training, plane, unseen, model=known, thorough=thorough)


def extend(
    model: AnyModel,
    runs: Logs,
    add: str | Iterable[str],
    *,
    validate: Logs = (),
    mapping: ChannelMap | File | None = None,
) -> Extension:
    """Return a model with effects added by name and everything refitted to the runs; `pays` says whether to keep it.

    validate: runs that no fit sees, to judge by; without them a part of the runs is held out. Raises UsageError for an effect
    that is unknown, of the other axis or in the model already, DataError for runs that cannot be used, and as `load` does.
    """
    from fieldsid.extension.extend import extend_in_steps, whole_of

    load_user_effects()
    known = model_of(model)
    return whole_of(extend_in_steps(known, names_of(add), *_training_and_unseen(runs, validate, mapping, model)))


def _training_and_unseen(
    runs: Logs, validate: Logs, mapping: ChannelMap | File | None, model: AnyModel | None
) -> tuple[Several[Run], Several[Run]]:
    """Return the training runs and those that no fit sees, with a different name each."""
    training, unseen = (runs_mapped(logs, mapping, models=[model]) for logs in (runs, validate))
    both = runs_mapped((*training, *unseen), None)
    return Several(both[: len(training)]), Several(both[len(training) :])
