"""From runs to a model, and to the effect it lacks: `sysid identify`, `compare`, `diagnose` and `extend` as functions."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from fieldsid.errors import UsageError
from fieldsid.face.arguments import File, axis_excited, axis_of, names_of, own_effects, vehicle_of
from fieldsid.face.models import AnyModel, model_of
from fieldsid.face.runs import Logs, runs_mapped
from fieldsid.face.several import Several

if TYPE_CHECKING:
    from fieldsid.comparison.compare import Comparison
    from fieldsid.diagnosis import Diagnosis
    from fieldsid.extension.extend import Extension
    from fieldsid.fitting.fit import Fit
    from fieldsid.logs import ChannelMap, Run
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
) -> Several[Fit]:
    """Return the fit of the yaw or pitch model to each run, or a single one to all of them when joint.

    axis: by default the one that the runs excite. Of each run the part is used that excites it; all of it when `whole`, or
    between start and end in s. bandwidth: that of the state-variable filter in rad/s. forgetting: the factor of `svf_rls`. Raises
    DataError for runs that do not allow the fit, UsageError for a method or effect that cannot do what is asked or runs that
    excite both axes or none, and as `load` does.
    """
    from fieldsid.fitting.identify import identify as fit_runs
    from fieldsid.fitting.problem.estimator import Options

    own_effects()
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
    """Return the comparison of a model's free run with each run, and where it fails.

    start and end cut the runs, in s. Raises DataError for a run without the signals, ModelError when the model grows without
    bound, ArtifactError for a file that is no model, and as `load` does.
    """
    from fieldsid.comparison.compare import compare as compare_runs

    own_effects()
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
    is held back. model: one whose effects are known already. thorough: go on for as long as there is something to try. Raises
    DataError for a run that cannot be fitted, UsageError for a model of the other axis or runs that excite both or none,
    EffectError for an effect of the user's that fails, and as `load` does.
    """
    from fieldsid.diagnosis import diagnose as diagnose_runs

    own_effects()
    known, plane = None if model is None else model_of(model), axis_of(axis)
    if known is not None and plane is not None and known.axis is not plane:
        raise UsageError(f"that is a {known.axis.value} model", found=f"axis {plane.value}", hint=f'write `"{known.axis.value}"`')
    learned, unseen = _both(runs, validate, mapping, model)
    plane = known.axis if known else plane or axis_excited(learned)
    return diagnose_runs(learned, plane, unseen, model=known, thorough=thorough)


def extend(
    model: AnyModel,
    runs: Logs,
    add: str | Iterable[str],
    *,
    validate: Logs = (),
    mapping: ChannelMap | File | None = None,
) -> Extension:
    """Return a model with effects added by name and everything refitted to the runs; `pays` says whether to keep it.

    validate: runs that no fit sees, to judge by; without them a part of the runs is held back. Raises UsageError for an effect
    that is unknown, of the other axis or in the model already, DataError for runs that cannot be used, and as `load` does.
    """
    from fieldsid.extension.extend import extend_in_steps, whole_of

    own_effects()
    known = model_of(model)
    return whole_of(extend_in_steps(known, names_of(add), *_both(runs, validate, mapping, model)))


def _both(
    runs: Logs, validate: Logs, mapping: ChannelMap | File | None, model: AnyModel | None
) -> tuple[Several[Run], Several[Run]]:
    """Return the runs to learn from and those not seen, all names different."""
    learned, unseen = (runs_mapped(logs, mapping, models=[model]) for logs in (runs, validate))
    both = runs_mapped((*learned, *unseen), None)
    return Several(both[: len(learned)]), Several(both[len(learned) :])
