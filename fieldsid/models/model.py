"""A Model: axis, effects, values with their covariance, speed law and noise; saved and loaded as YAML."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from fieldsid.artifacts import load_record, save_record
from fieldsid.display import Brief, Displayed, InControl
from fieldsid.errors import ArtifactError
from fieldsid.logs.wrong_file import unless_log
from fieldsid.models.axis import NAMES, Axis
from fieldsid.models.definition import Definition, definitions_body, read_definitions
from fieldsid.models.effect import definitions_of, effect_held
from fieldsid.models.speed_law import SpeedLaw, with_speed
from fieldsid.numerics.arrays import FloatArray

KIND = "fieldsid/model"
LARGEST = 1e9
"""No parameter of a vehicle in SI is larger: what is beyond is damage, and its powers would overflow."""


@dataclass(frozen=True, slots=True, repr=False)
class Noise(Brief):
    """Noise of the measurement and of the motion.

    Standard deviations: angle (rad), rate (rad/s), disturbance (rad/s^2, an AR(1) moment of correlation time
    `disturbance_time` s), of coloured sensor noise with correlation time `coloured_time`, and `own_moment` (rad/s^2) of a
    constant moment that each run has of its own: its trim is not quite that of the next.
    """

    angle: float
    rate: float
    disturbance: float = 0.0
    disturbance_time: float = 1.0
    coloured_angle: float = 0.0
    coloured_rate: float = 0.0
    coloured_time: float = 1.0
    own_moment: float = 0.0


@dataclass(frozen=True, slots=True, repr=False)
class Model(InControl, Displayed):
    """An identified model.

    `values` holds the base parameters at the law's reference speed and the effects' shared coefficients (SI,
    rad); `units` theirs; `covariance` (p, p) in the order of `free`, the names that were estimated. `trained`
    says what the data reached: speed_low, speed_high, fin_max, rate_max (all in SI), and with what t-value `fin_t` they show
    which way the fin turns, where the authority does not. `own` defines the effects that are not
    built in, as `models.definition` has it: a model that is read back uses these, whatever the folder it is used in holds.
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
        """Return a parameter's name as it is printed: that of several runs with the speed it belongs to."""
        at = self.law
        return with_speed(name, self.axis, at.reference, trim_of_fin=at.trim_of_fin) if len(self.runs) > 1 else name

    def at_speed(self, speed: float) -> dict[str, float]:
        """Return the base parameters at a speed by the model's own law."""
        names = NAMES[self.axis]
        out = self.base
        out[names.damping] *= self.law.damping_factor(speed)
        out[names.trim] *= self.law.trim_factor(speed)
        out[names.authority] = self.law.authority(speed, out[names.authority])
        return out


def save_model(model: Model, path: Path, *, inputs: Sequence[Path] = (), parent: Path | None = None, force: bool = False) -> Path:
    """Write a model as YAML, with the definitions of its effects that are not built in; raises ArtifactError.

    Raises EffectError for an effect that is not known.
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
    return save_record(path, f"{KIND}/1", body, inputs=inputs, parent=parent, force=force)


def load_model(path: Path) -> Model:
    """Read a model back; raises ArtifactError naming the key that is missing or wrong."""
    with unless_log(path, "a model"):
        body = load_record(path, KIND)
    return model_of(body, path)


def model_of(body: Mapping[str, Any], path: Path) -> Model:
    """Return the model of a record that `save_model` has written, found in a file; raises ArtifactError as `load_model` does."""
    try:
        law = body["speed_law"]
        reference = law["reference_m_s"]
        model = Model(
            axis=Axis(body["axis"]),
            effects=tuple(str(e) for e in body["effects"]),
            values={k: finite_number(p["value"], k) for k, p in body["parameters"].items()},
            units={k: str(p["unit"]) for k, p in body["parameters"].items()},
            free=tuple(str(n) for n in body["free"]),
            covariance=np.array(body["covariance"], dtype=np.float64).reshape(len(body["free"]), len(body["free"])),
            law=SpeedLaw(
                float("nan") if reference is None else float(reference),
                float(law["damping_exponent"]),
                float(law["authority_exponent"]),
                tuple((float(a), float(b)) for a, b in law["points"]),
                float(law["snap"]),
                bool(law.get("trim_of_fin", False)),
            ),
            noise=Noise(**{k: float(v) for k, v in body["noise"].items()}),
            trained={k: float("nan") if v is None else float(v) for k, v in body["trained"].items()},
            method=str(body["method"]),
            runs=tuple(str(r) for r in body["runs"]),
            info=dict(body["info"]),
            own=read_definitions(body.get("own_effects", ()), path),
        )
        _check(model, body)
    except (KeyError, TypeError, ValueError, AttributeError, OverflowError) as error:
        raise ArtifactError(
            f"`{path}` is not a complete model file",
            found=f"{type(error).__name__}: {error}",
            hint="identify again, with `--force`",
        ) from error
    return model


def _check(model: Model, body: Mapping[str, Any]) -> None:
    """Raise ValueError, TypeError or KeyError where a record's parts do not belong together, or a number is none of a vehicle."""
    lacking = [n for n in (*NAMES[model.axis].base, *model.free) if n not in model.values]
    if lacking:
        raise ValueError(f"no value of `{lacking[0]}` under `parameters`")
    law, stated = model.law, dict(model.info.get("law_parameters", {}))
    speeds = {"reference_m_s": law.reference} if np.isfinite(law.reference) else {}
    speeds |= {f"points: {s}": s for s, _ in law.points} | {"disturbance_time": model.noise.disturbance_time}
    wrong = [f"{name} = {value}" for name, value in speeds.items() if not value > 0.0]
    if wrong:
        raise ValueError(f"{wrong[0]} is not above zero")
    numbers = speeds | {"damping_exponent": law.damping_exponent, "authority_exponent": law.authority_exponent, "snap": law.snap}
    numbers |= {f"points: {s}": b for s, b in law.points} | {f: getattr(model.noise, f) for f in Noise.__dataclass_fields__}
    numbers |= {str(n): entry["std_error"] for n, entry in stated.items() if entry["std_error"] is not None}
    for name, value in numbers.items():
        finite_number(value, name)
    # what could not be estimated is not a number in it, and written as nothing
    if bool((np.abs(np.nan_to_num(model.covariance)) > LARGEST**2).any()):
        raise ValueError("a covariance is no number of a vehicle")
    for entry in body.get("inputs", []):
        str(entry["path"])


def finite_number(value: float | str, name: str) -> float:
    """Return a value of a record as the number it must be; raises ValueError for what is none, or is none of a vehicle."""
    number = float(value)
    if not abs(number) <= LARGEST:
        raise ValueError(f"{name} = {number} is no number of a vehicle")
    return number
