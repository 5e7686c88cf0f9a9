"""A Model: axis, effects, values with their covariance, speed law and noise; saved and loaded as YAML."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

import numpy as np

from fieldsid.artifacts import save_record
from fieldsid.display import Brief, Displayed, InControl
from fieldsid.errors import ArtifactError
from fieldsid.logs.wrong_file import unless_log
from fieldsid.models.axis import NAMES, Axis
from fieldsid.models.definition import Definition, definitions_body, read_definitions
from fieldsid.models.effect import definitions_of, effect_held
from fieldsid.models.speed_law import SpeedLaw, with_speed
from fieldsid.numerics.arrays import FloatArray
from fieldsid.records.check import ShapeError
from fieldsid.records.keys import Key, Number
from fieldsid.records.reading import load_record

KIND = "fieldsid/model"


@dataclass(frozen=True, slots=True, repr=False)
class Noise(Brief):
    """Noise of the measurement and of the motion.

    Standard deviations of the white angle noise (rad), the white rate noise (rad/s), the disturbance (rad/s^2, an AR(1) moment
    with the correlation time `disturbance_time`, s), the coloured sensor noise (correlation time `coloured_time`, s), and
    `own_moment` (rad/s^2): of a constant moment that differs from run to run, because the trim does.
    """

    angle: Annotated[Number, Key("Standard deviation of the angle, in rad.", "angle_rad")]
    rate: Annotated[Number, Key("Standard deviation of the rate, in rad/s.", "rate_rad_s")]
    disturbance: float = 0.0
    disturbance_time: float = 1.0
    coloured_angle: float = 0.0
    coloured_rate: float = 0.0
    coloured_time: float = 1.0
    own_moment: float = 0.0


@dataclass(frozen=True, slots=True, repr=False)
class Model(InControl, Displayed):
    """An identified model.

    `values` holds the base parameters at the law's reference speed and the effects' shared coefficients (SI, rad), `units` their
    units, `covariance` (p, p) their covariance in the order of `free`, the names of the estimated ones. `trained` holds the range
    of the data: speed_low, speed_high, fin_max, rate_max (all in SI); where the authority is not significant also `fin_t`, the
    t-value with which the data show the sign of the response to the fin. `own` holds the definitions of the effects that are not
    built in (models/definition.py): a model that is read back uses these and not what the current folder defines.
    """

    axis: Axis
    effects: tuple[str, ...]
    values: Mapping[str, float]
    units: Mapping[str, str]
    free: tuple[str, ...]
    covariance: FloatArray
    law: SpeedLaw
    noise: Noise
    trained: Mapping[str, float] = field(default_factory=dict)
    method: str = ""
    runs: tuple[str, ...] = ()
    info: Mapping[str, Any] = field(default_factory=dict)
    own: Mapping[str, Definition] = field(default_factory=dict)

    @property
    def base(self) -> dict[str, float]:
        """The base parameters at the reference speed."""
        return {n: self.values[n] for n in NAMES[self.axis].base}

    def std_error(self, name: str) -> float:
        """Return the standard error of a free value, NaN for one that was not estimated."""
        if name not in self.free:
            return float("nan")
        i = self.free.index(name)
        return float(np.sqrt(max(self.covariance[i, i], 0.0)))

    def shown(self, name: str) -> str:
        """Return a parameter's name as it is printed: with the speed it holds at, like `b2@1.4`, for a model of several runs."""
        at = self.law
        return with_speed(name, self.axis, at.reference, trim_of_fin=at.trim_of_fin) if len(self.runs) > 1 else name

    def at_speed(self, speed: float) -> dict[str, float]:
        """Return the base parameters at a speed (m/s) by the model's speed law."""
        names = NAMES[self.axis]
        out = self.base
        out[names.damping] *= self.law.damping_factor(speed)
        out[names.trim] *= self.law.trim_factor(speed)
        out[names.authority] = self.law.authority(speed, out[names.authority])
        return out


def save_model(
    model: Model,
    path: Path,
    *,
    inputs: Sequence[Path] = (),
    mapping: Path | None = None,
    parent: Path | None = None,
    force: bool = False,
) -> Path:
    """Write a model as YAML, with the definitions of its effects that are not built in; raises ArtifactError.

    inputs: the logs it was fitted to; mapping: the file they were read with, where one was named. Raises EffectError for an
    effect that is not known.
    """
    own = definitions_of(effect_held(name, model.own) for name in model.effects)
    body = {
        "axis": model.axis.value,
        "effects": list(model.effects),
        **({"own_effects": definitions_body(own)} if own else {}),
        "method": model.method,
        "runs": list(model.runs),
        "parameters": {
            n: {"value": v, "std_error": model.std_error(n), "unit": model.units.get(n, "")} for n, v in model.values.items()
        },
        "free": list(model.free),
        "covariance": model.covariance,
        "speed_law": {
            "reference_m_s": model.law.reference,
            "damping_exponent": model.law.damping_exponent,
            "authority_exponent": model.law.authority_exponent,
            "points": [list(p) for p in model.law.points],
            "snap": model.law.snap,
            "trim_of_fin": model.law.trim_of_fin,
        },
        "noise": {f: getattr(model.noise, f) for f in Noise.__dataclass_fields__},
        "trained": dict(model.trained),
        "info": dict(model.info),
    }
    return save_record(path, f"{KIND}/1", body, inputs=inputs, mapping=mapping, parent=parent, force=force)


def load_model(path: Path) -> Model:
    """Read a model back; raises ArtifactError naming the key that is missing or wrong."""
    with unless_log(path, "a model"):
        body = load_record(path, KIND)
    return model_of(body, path)


def model_of(body: Mapping[str, Any], path: Path) -> Model:
    """Return the model of a record that `save_model` wrote to a file at `path`; raises ArtifactError as `load_model` does."""
    try:
        law, size = body["speed_law"], len(body["free"])
        model = Model(
            axis=Axis(body["axis"]),
            effects=tuple(body["effects"]),
            values={k: float(p["value"]) for k, p in body["parameters"].items()},
            units={k: p["unit"] for k, p in body["parameters"].items()},
            free=tuple(body["free"]),
            covariance=np.array(body["covariance"], dtype=np.float64).reshape(size, size),
            law=SpeedLaw(
                _or_nan(law["reference_m_s"]),
                float(law["damping_exponent"]),
                float(law["authority_exponent"]),
                tuple((float(a), float(b)) for a, b in law["points"]),
                float(law["snap"]),
                law.get("trim_of_fin", False),
            ),
            noise=Noise(**{k: float(v) for k, v in body["noise"].items()}),
            trained={k: _or_nan(v) for k, v in body["trained"].items()},
            method=body["method"],
            runs=tuple(body["runs"]),
            info=dict(body["info"]),
            own=read_definitions(body.get("own_effects", ()), path),
        )
        _check_names(model)
    except (TypeError, ValueError) as error:
        found = str(error) if isinstance(error, ShapeError) else f"{type(error).__name__}: {error}"
        raise ArtifactError(
            f"`{path}` is not a complete model file", found=found, hint="identify again, with `--force`"
        ) from error
    return model


def _or_nan(value: float | None) -> float:
    return float("nan") if value is None else float(value)


def _check_names(model: Model) -> None:
    """Raise ShapeError where a base parameter, or one listed in `free`, has no value."""
    missing = [n for n in (*NAMES[model.axis].base, *model.free) if n not in model.values]
    if missing:
        raise ShapeError(f"no value of `{missing[0]}` under `parameters`")
